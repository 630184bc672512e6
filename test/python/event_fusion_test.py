# SPDX-License-Identifier: BSD-3-Clause
"""The package event_fusion: the arrays of recordings, and maps that are those of the program."""

import glob
import json
import os
import pickle
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
from decimal import Decimal

import matplotlib
import numpy as np
import pytest

import event_fusion as ef
from event_fusion._events import event_records

matplotlib.use("agg")
from event_fusion import plot  # noqa: E402

DESK = os.path.join(os.environ["EFM_RECORDINGS"], "desk_stereo")
SOURCE = os.environ["EFM_SOURCE"]
OPTIONS = {"dsi.min_depth_m": 0.5, "dsi.max_depth_m": 5, "keyframes.stride_s": 0.5}


@pytest.fixture(scope="module")
def desk():
    return ef.open(DESK)


def program(*arguments):
    """Run the program and return what it prints."""
    words = [os.environ["EFM_EVENT_FUSION"], *map(str, arguments)]
    return subprocess.run(words, check=True, capture_output=True, text=True).stdout


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Map the desk by the program."""
    out = tmp_path_factory.mktemp("map") / "out"
    program("map", DESK, "-q", "--out", out, *(f"--set={key}={value}" for key, value in OPTIONS.items()))
    return out


@pytest.fixture(scope="module")
def by_program(folder):
    """Return the points of the program's map."""
    return points_of(folder / "map.pcd")


@pytest.fixture(scope="module")
def made(desk):
    """Map the desk in memory."""
    return ef.map(desk, OPTIONS)


def points_of(pcd):
    """Read a binary PCD file whose fields have four bytes each."""
    content = pcd.read_bytes()
    end = content.index(b"DATA binary\n") + len(b"DATA binary\n")
    header = dict(line.split(" ", 1) for line in content[:end].decode().splitlines() if line[0] != "#")
    kinds = {"F": "f4", "U": "u4"}
    dtype = [(name, kinds[kind]) for name, kind in zip(header["FIELDS"].split(), header["TYPE"].split())]
    return np.frombuffer(content[end:], dtype, int(header["POINTS"]))


def test_all_ways_give_the_map_of_the_program(desk, by_program, made):
    from_file = ef.Mapper(OPTIONS)
    from_file.add_recording(desk)
    from_file.finish()
    keyframes = []
    mapper = ef.Mapper(OPTIONS, keyframes.append)
    for camera in desk.rig:
        mapper.add_camera(camera)
    for line in open(os.path.join(DESK, "poses.txt")).read().splitlines():
        if line[0] != "#":
            t, *pose = line.split()
            mapper.add_pose(int(Decimal(t) * 10**9), np.array(pose, float))
    for camera in range(len(desk.rig)):
        for part in desk.events(camera, 100_000):
            mapper.add_events(camera, part)
    mapper.finish()
    assert len(by_program) > 1000
    for points in (from_file.points, mapper.points, made.points):
        for name in ("x", "y", "z", "intensity", "support", "sigma", "probability"):
            np.testing.assert_array_equal(points[name], by_program[name], name)
    assert [k.t for k in keyframes] == [k.t for k in made] == list(from_file.trajectory[0])
    np.testing.assert_array_equal(keyframes[0].depth, made.keyframes[0].depth)


@pytest.mark.parametrize("windows", [{}, {"keyframes.window_s": 0.5, "keyframes.stride_s": 0.25, "dsi.num_planes": 50}])
def test_cameras_may_come_one_after_another_in_parts(desk, windows):
    options = {**OPTIONS, **windows} if windows else None
    expected = ef.map(desk, options).points
    for order, chunk, poses_first in (([0, 1], 20_000, True), ([1, 0], 20_000, True), ([1, 0], 10**8, False)):
        mapper = ef.Mapper(options)
        for camera in desk.rig:
            mapper.add_camera(camera)
        if poses_first:
            mapper.add_poses(*desk.poses)
        for camera in order:
            for part in desk.events(camera, chunk):
                mapper.add_events(camera, part)
        if not poses_first:
            mapper.add_poses(*desk.poses)
        mapper.finish()
        np.testing.assert_array_equal(mapper.points, expected)


def test_a_hand_eye_transform_makes_one_map_in_all_ways(desk, tmp_path):
    T_body_rig = np.eye(4)
    T_body_rig[:3, :3] = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    T_body_rig[:3, :3] *= np.linalg.det(T_body_rig[:3, :3])
    T_body_rig[:3, 3] = 0.123456789, -0.2, 0.3
    np.savetxt(tmp_path / "hand_eye.txt", T_body_rig)
    times, T_world_rig = desk.poses
    ef.write_poses(tmp_path / "body.txt", (times, T_world_rig @ np.linalg.inv(T_body_rig)))
    files = ("--poses", tmp_path / "body.txt", "--hand-eye", tmp_path / "hand_eye.txt")
    program("import", DESK, "-q", *files, "--out", tmp_path / "imported.rawlog")
    recording = ef.open(DESK, poses=tmp_path / "body.txt", hand_eye=tmp_path / "hand_eye.txt")
    expected = ef.map(recording, OPTIONS).points
    assert len(expected) > 1000
    np.testing.assert_array_equal(ef.map(tmp_path / "imported.rawlog", OPTIONS).points, expected)
    for own in (False, True):
        mapper = ef.Mapper(OPTIONS)
        if own:
            for camera in desk.rig:
                mapper.add_camera(camera)
            mapper.add_poses(*recording.poses)
            for camera in range(2):
                mapper.add_events(camera, np.concatenate(list(desk.events(camera))))
        else:
            mapper.add_recording(recording)
        mapper.finish()
        np.testing.assert_array_equal(mapper.points, expected)


def test_a_keyframe_lies_on_the_points_of_the_map(made):
    keyframe = made.keyframes[0]
    rows, columns = np.nonzero(keyframe.depth)
    assert keyframe.depth.dtype == keyframe.confidence.dtype == keyframe.sigma.dtype == np.float32
    assert np.all(keyframe.sigma[rows, columns] > 0)
    assert keyframe.depth.base is not None and not keyframe.depth.flags.writeable
    z = keyframe.depth[rows, columns]
    p_ref = np.linalg.inv(keyframe.K) @ np.stack([columns * z, rows * z, z])
    p_world = (keyframe.pose @ np.vstack([p_ref, np.ones_like(z)]))[:3].T
    np.testing.assert_allclose(keyframe.points(), p_world, rtol=0, atol=1e-6)  # the depths are floats
    points = np.stack([made.points[axis] for axis in "xyz"], axis=1)
    # The map averages the points of a voxel of 2 cm.
    for p in p_world[:: len(p_world) // 50]:
        assert np.min(np.linalg.norm(points - p, axis=1)) < 0.04


def test_keyframes_can_be_pickled(made):
    keyframe = made.keyframes[0]
    copy = pickle.loads(pickle.dumps(keyframe))
    for name in ("t", "window"):
        assert getattr(copy, name) == getattr(keyframe, name)
    for name in ("depth", "confidence", "sigma", "probability", "pose", "K"):
        np.testing.assert_array_equal(getattr(copy, name), getattr(keyframe, name), name)
    np.testing.assert_array_equal(copy.points(), keyframe.points())
    constructor, arguments, state = keyframe.__reduce_ex__(2)[:3]
    older = constructor(*arguments)
    older.__setstate__(state[:8])  # of a version without probabilities
    assert np.array_equal(np.isnan(older.probability), keyframe.depth > 0)
    assert np.all(older.probability[keyframe.depth == 0] == 0)


def test_candidates_are_the_pixels_that_could_have_a_depth(desk):
    t0, t1 = "1.5", "1.75"
    options = {**OPTIONS, "depth.min_probability": 0.8, "depth.neighbours": True, "performance.coarse_to_fine": False}
    found = ef.candidates(desk, t0, t1, options)
    dsi = ef.dsi(desk, t0, t1, options)
    np.testing.assert_array_equal(found.keyframe.depth, dsi.keyframe.depth)
    y, x = found.candidates["y"], found.candidates["x"]
    inner = np.zeros(dsi.contrast.shape, bool)
    inner[2:-2, 2:-2] = True
    assert {*zip(*np.nonzero(inner & (dsi.contrast > 0.15)))} == {*zip(y, x)}
    np.testing.assert_allclose(found.candidates["inputs"][:, 0], np.log(dsi.contrast[y, x]), rtol=0, atol=1e-5)
    expected = np.zeros_like(dsi.keyframe.depth)
    for of, inputs in ((found.candidates, 7), (found.neighbours, 6)):
        assert of["inputs"].shape == (len(of), inputs)
        kept = of[of["probability"] > 0.8]
        assert len(kept) > 1000
        expected[kept["y"], kept["x"]] = kept["depth"]
        np.testing.assert_array_equal(found.keyframe.probability[kept["y"], kept["x"]], kept["probability"])
        np.testing.assert_allclose(found.keyframe.sigma[kept["y"], kept["x"]], kept["sigma"], rtol=1e-3)
    np.testing.assert_array_equal(expected, found.keyframe.depth)
    with pytest.raises(ValueError, match="depth.extraction"):
        ef.candidates(desk, t0, t1, {"depth.extraction": "paper"})


def test_events_come_in_chunks_of_any_size(desk):
    whole = np.concatenate(list(desk.events(1, 10_000_000)))
    assert np.all(np.diff(whole["t"]) >= 0)
    parts = list(desk.events(1, 77_777))
    assert {part.dtype for part in parts} == {ef.EVENT_DTYPE}
    assert {len(part) for part in parts[:-1]} == {77_777}
    np.testing.assert_array_equal(np.concatenate(parts), whole)
    t0, t1 = int(whole["t"][1000]), int(whole["t"][5000])
    part = np.concatenate(list(ef.open(DESK, t0=t0, t1=t1).events(1)))
    np.testing.assert_array_equal(part, whole[(whole["t"] >= t0) & (whole["t"] < t1)])


def test_the_events_before_damage_come_first(tmp_path):
    lines = [f"{1 + i / 1000:.3f} {i} 5 1\n" for i in range(100)]
    for camera in ("cam0", "cam1"):
        (tmp_path / camera).mkdir()
        (tmp_path / camera / "events.txt").write_text("".join(lines[:90]) + "damage\n" + "".join(lines[91:]))
    for name in ("camchain.yaml", "poses.txt"):
        (tmp_path / name).write_text(open(os.path.join(DESK, name)).read())
    parts = ef.open(tmp_path).events(0, 1000)
    assert len(next(parts)) > 0
    with pytest.raises(OSError, match="events.txt"):
        next(parts)


@pytest.mark.parametrize(
    "dtype, unit, per",
    [
        ([("x", "u2"), ("y", "u2"), ("p", "i2"), ("t", "i8")], "us", 1000),
        ([("t", "f8"), ("x", "i4"), ("y", "i4"), ("polarity", "?")], "s", 1e9),
        ([("x", "u2"), ("y", "u2"), ("p", "i1"), ("timestamp", "u8")], "ns", 1),
    ],
)
def test_arrays_of_other_programs_are_read_by_their_fields(desk, dtype, unit, per):
    whole = next(iter(desk.events(0, 20_000)))
    whole = whole[whole["t"] % 1000 == 0] if unit == "us" else whole
    other = np.zeros(len(whole), dtype)
    names = other.dtype.names
    other["x"], other["y"] = whole["x"], whole["y"]
    other["p" if "p" in names else "polarity"] = whole["p"]
    other[next(name for name in names if name.startswith("t"))] = whole["t"] / per if unit == "s" else whole["t"] // per
    made = event_records(other, unit)
    for name in "xyp":
        np.testing.assert_array_equal(made[name], whole[name])
    assert np.max(np.abs(made["t"] - whole["t"]), initial=0) <= (1 if unit == "s" else 0)


def stereo_mapper():
    mapper = ef.Mapper(OPTIONS)
    mapper.add_camera(m_camera())
    return mapper


def m_camera():
    return ef.Camera(10, 10, np.array([[5, 0, 5], [0, 5, 5], [0, 0, 1.0]]))


ERRORS = {
    "no such file": (lambda: ef.open("/no/such/folder"), OSError, "/no/such/folder"),
    "no such camera": (lambda: ef.open(DESK).events(2), ValueError, "0 to 1"),
    "no such option": (lambda: ef.Mapper({"dsi.max_depth": 1}), ValueError, "max_depth_m"),
    "an option out of range": (lambda: ef.Mapper({"dsi.num_planes": -3}), ValueError, "num_planes"),
    "a pixel below 0": (lambda: ef.events([-1], [0], [1], [0]), ValueError, r"x\[0\] = -1"),
    "two lengths": (lambda: ef.events([1, 2], [0], [1], [0]), ValueError, r"\(2,\), \(1,\)"),
    "no unit": (lambda: ef.events([1], [0], [1], [0], "minutes"), ValueError, "'minutes'"),
    "no fields": (lambda: stereo_mapper().add_events(0, np.zeros((3, 4))), TypeError, "float64"),
    "outside the sensor": (
        lambda: stereo_mapper().add_events(0, ef.events([10], [0], [1], [5])),
        ValueError,
        "camera 0",
    ),
    "no rotation": (lambda: stereo_mapper().add_pose(0, np.ones((4, 4))), ValueError, "rotation matrix"),
    "no quaternion": (lambda: stereo_mapper().add_pose(0, np.ones(7)), ValueError, "length 1"),
    "no time": (lambda: ef.open(DESK, t0="soon"), ValueError, "t0 = 'soon'"),
    "too few cameras": (lambda: ef.open(DESK, cameras=[1]), ValueError, r"cameras = \[1\]: expected 2"),
    "an interval backwards": (lambda: ef.open(DESK, t0=5, t1=4), ValueError, "t1"),
    "an unknown preset": (lambda: ef.simulate("desk"), ValueError, "desk_stereo"),
    "a wrong option of a map": (lambda: ef.map(ef.open(DESK), {"dsi.num_planes": -3}), ValueError, "num_planes"),
    "no truth": (lambda: ef.evaluate.true_depth(DESK, 7), OSError, "7 ns"),
    "no cloud": (lambda: ef.evaluate.map(np.zeros(3), DESK), ValueError, r"\(3,\)"),
    "an unknown unit": (lambda: ef.evaluate.trajectory(DESK, DESK, truth_time_unit="m"), ValueError, "s, ms, us, ns"),
    "an unknown alignment": (lambda: ef.evaluate.trajectory(DESK, DESK, alignment="sim3"), ValueError, "se3"),
    "a fraction of a nanosecond": (lambda: ef.events([1], [1], [1], [0.5]), ValueError, r"t\[0\] = 0.5: .*time_unit='s'"),
    "a time beyond 64 bits": (lambda: ef.events([1], [1], [1], [10**12], "s"), ValueError, r"t\[0\]"),
    "text as pixels": (lambda: ef.events(["a"], [1], [1], [1]), TypeError, "x: "),
    "seconds of a pose": (lambda: stereo_mapper().add_pose(1.5, np.eye(4)), TypeError, "t = 1.5: expected nanoseconds"),
    "a pose that is not finite": (lambda: stereo_mapper().add_pose(5, np.full((4, 4), np.nan)), ValueError, "finite"),
    "seconds as a float": (lambda: ef.open(DESK, t0=0.5), ValueError, "t0 = 0.5"),
    "options as a list": (lambda: ef.map(DESK, [("dsi.num_planes", 50)]), TypeError, "section.key"),
    "a chunk as a float": (lambda: ef.open(DESK).events(chunk=1e6), TypeError, "chunk"),
    "two shapes": (lambda: ef.evaluate.depth(np.ones((3, 4)), np.ones((4, 4))), ValueError, r"\(4, 4\)"),
    "a map as a keyframe": (lambda: plot.depth("x.png"), TypeError, "keyframes"),
    "no limits": (lambda: plot.depth(np.ones((3, 4)), limits=(0, 5)), ValueError, "0 < near"),
    "a file of another kind": (lambda: stereo_mapper().save("map.txt"), ValueError, "pcd or .ply"),
    "a masked pixel": (
        lambda: ef.events(np.ma.masked_array([1, 2], [False, True]), [1, 1], [1, 1], [1, 2]),
        ValueError,
        r"x\[1\] is masked",
    ),
    "a masked pose": (
        lambda: stereo_mapper().add_poses([1], np.ma.masked_invalid(np.full((1, 7), np.nan))),
        ValueError,
        "T_world_rig.*masked",
    ),
    "a transposed K": (lambda: ef.Camera(10, 10, [[5, 0, 0], [0, 5, 0], [5, 5, 1]]), ValueError, "K: expected"),
    "a scaled K": (lambda: ef.Camera(10, 10, [[5, 0, 5], [0, 5, 5], [0, 0, 2]]), ValueError, "K: expected"),
    "a polarity of 2": (lambda: ef.events([1], [1], [2], [1]), ValueError, r"p\[0\] = 2: expected polarity"),
    "a polarity of 2 in records": (
        lambda: stereo_mapper().add_events(0, np.array([(1, 1, 2, 5)], ef.EVENT_DTYPE)),
        ValueError,
        r"p\[0\] = 2: expected polarity",
    ),
    "a pose's unit": (lambda: stereo_mapper().add_poses([1.5], np.eye(4)[None], "minutes"), ValueError, "'minutes'"),
    "a camera after events": (
        lambda: (m := stereo_mapper(), m.add_events(0, ef.events([1], [1], [1], [1])), m.add_camera(m_camera())),
        RuntimeError,
        "after the first events",
    ),
    "an unknown unit of a file": (lambda: ef.open(DESK, time_unit="min"), ValueError, "time_unit = 'min': expected one of s"),
    "an unknown format": (lambda: ef.open(DESK, format="nope"), ValueError, "expected one of auto, rawlog"),
    "a name that is not UTF-8": (lambda: ef.open("/no/\udcff"), OSError, "no such file"),
    "no poses": (lambda: ef.map(os.path.join(DESK, "cam0", "events.txt")).points, OSError, "calibration=FILE"),
    "no pose": (lambda: stereo_mapper().add_pose(0, np.ones((3, 4))), ValueError, r"\(3, 4\)"),
}


@pytest.mark.parametrize("name", ERRORS)
def test_mistakes_are_errors_that_name_the_value(name):
    call, kind, text = ERRORS[name]
    with pytest.raises(kind, match=text):
        call()


def test_times_of_poses_have_a_unit_and_no_poses_are_none(desk, made):
    maps = []
    for unit, per in (("ns", 1), ("us", 1000), ("s", 1e9)):
        mapper = ef.Mapper(OPTIONS)
        for camera in desk.rig:
            mapper.add_camera(camera)
        times, poses = desk.poses
        mapper.add_poses([], np.empty((0, 4, 4)))
        mapper.add_poses(times / per if unit == "s" else times // per, poses, unit)
        for camera in range(2):
            mapper.add_events(camera, np.concatenate(list(desk.events(camera))))
        mapper.finish()
        maps.append(mapper.points)
    for points in maps:
        np.testing.assert_array_equal(points, made.points)  # matrices, too: rotations are rounded


def test_warnings_are_of_what_was_used(desk):
    mapper = ef.Mapper(OPTIONS)
    mapper.finish()
    assert [name for name, _ in mapper.warnings] == ["no-keyframe"]
    mapper = ef.Mapper(OPTIONS)
    for camera in desk.rig:
        mapper.add_camera(camera)
    times, poses = desk.poses
    for i in range(0, len(times), 500):  # in falling order within half a second
        mapper.add_poses(times[i : i + 500][::-1], poses[i : i + 500][::-1])
    for camera in range(2):
        mapper.add_events(camera, np.concatenate(list(desk.events(camera))))
    with pytest.raises(ValueError):  # outside the sensor
        mapper.add_events(0, ef.events([999], [0], [1], [int(times[-1]) + 100 * 10**9]))
    mapper.finish()
    assert not {"clock-overlap", "no-motion", "rotation-only"} & {name for name, _ in mapper.warnings}, mapper.warnings
    assert len(mapper.points) > 1000


def test_the_exception_of_a_callback_ends_the_call(desk):
    class Enough(Exception):
        pass

    def stop(keyframe):
        raise Enough(keyframe.t)

    mapper = ef.Mapper(OPTIONS, stop)
    with pytest.raises(Enough):
        mapper.add_recording(desk)
        mapper.finish()


def test_two_mappers_run_in_two_threads(desk, by_program):
    made = []
    threads = [threading.Thread(target=lambda: made.append(ef.map(desk, OPTIONS))) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for result in made:
        np.testing.assert_array_equal(result.points["z"], by_program["z"])
    assert len(made) == 2


def test_the_map_is_that_of_the_program_with_options_from_the_data_and_its_folder_too(tmp_path):
    program("map", DESK, "-q", "--t1", "+0.6", "--out", tmp_path / "program")
    made = ef.map(ef.open(DESK, t1="+0.6"), out=tmp_path / "python")
    points = points_of(tmp_path / "program" / "map.pcd")
    for name in points.dtype.names:
        np.testing.assert_array_equal(made.points[name], points[name], name)
    assert (tmp_path / "python" / "map.pcd").read_bytes() == (tmp_path / "program" / "map.pcd").read_bytes()
    files = [sorted(os.listdir(tmp_path / way)) for way in ("program", "python")]
    assert files[0] == files[1]
    report = json.loads((tmp_path / "program" / "report.json").read_text())
    assert made.report["chosen"] == report["chosen"] != []
    assert made.report["keyframes"] == report["keyframes"] and made.report["votes"] == report["votes"]
    assert [name for name, _ in made.warnings] == [warning["name"] for warning in report["warnings"]]
    assert len(made.keyframes) == report["keyframes"]


def test_keyframes_come_while_the_recording_is_mapped_and_need_not_be_kept(desk, made):
    fractions = []
    streamed = ef.map(desk, OPTIONS, keep=False, progress=lambda activity, done: fractions.append((activity, done)))
    times = []
    for keyframe in streamed:
        times.append(keyframe.t)
        assert streamed._result is None  # it is still being made
    assert times == [keyframe.t for keyframe in made]
    np.testing.assert_array_equal(streamed.points["x"], made.points["x"])
    assert {activity for activity, _ in fractions} == {"first look", "mapping"}
    assert all(0 <= done <= 1 for _, done in fractions)
    for again in (lambda: streamed.keyframes, lambda: list(streamed)):
        with pytest.raises(RuntimeError, match="keep=False"):
            again()
    assert len(list(ef.map(desk, OPTIONS, keep=False))) == len(times)


def test_a_map_that_nobody_waits_for_ends(desk):
    before = threading.active_count()
    abandoned = ef.map(desk, OPTIONS, keep=False)
    next(iter(abandoned))
    del abandoned
    closed = ef.map(desk, OPTIONS)
    first = next(iter(closed))
    closed.close()  # the map so far stays
    assert closed.keyframes[0].t == first.t and len(closed.points) > 1000
    deadline = time.monotonic() + 30
    while threading.active_count() > before and time.monotonic() < deadline:
        time.sleep(0.01)
    assert threading.active_count() == before


def test_a_folder_is_made_also_if_nobody_looks_at_the_map(tmp_path):
    ef.map(ef.open(DESK, t1="+0.6"), OPTIONS, tmp_path / "out")
    assert json.loads((tmp_path / "out" / "report.json").read_text())["keyframes"] > 0
    with pytest.warns(ef.EventFusionWarning, match="nobody looked at failed: .*holds other files"):
        ef.map(DESK, OPTIONS, os.path.dirname(__file__))


def test_ctrl_c_ends_a_map(tmp_path):
    script = tmp_path / "wait.py"
    script.write_text(
        "import sys, event_fusion as ef\n"
        "made = ef.map(ef.open(sys.argv[1]), {'keyframes.stride_s': 0.001}, keep=False)\n"
        "try:\n"
        "    for i, keyframe in enumerate(made): i or print(keyframe.t, flush=True)\n"
        "finally: print(len(made.points), 'points so far')\n"
    )
    with subprocess.Popen(
        [sys.executable, script, DESK], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as running:
        running.stdout.readline()
        time.sleep(0.5)  # by now the loop waits for a keyframe, and is not in its own body
        running.send_signal(signal.SIGINT)
        printed, errors = running.communicate(timeout=600)
    assert int(printed.splitlines()[-1].split()[0]) > 0
    assert errors.strip().endswith("KeyboardInterrupt")
    assert running.returncode != 0


def damaged_desk(folder):
    """Copy the desk with a line of damage at 60 % of camera 1's events."""
    for name in ("camchain.yaml", "poses.txt"):
        shutil.copy(os.path.join(DESK, name), folder)
    for camera in ("cam0", "cam1"):
        (folder / camera).mkdir()
        text = open(os.path.join(DESK, camera, "events.txt")).read()
        cut = text.index("\n", int(0.6 * len(text))) + 1
        (folder / camera / "events.txt").write_text(text if camera == "cam0" else text[:cut] + "damage\n" + text[cut:])
    return folder


def test_damage_is_raised_once_and_the_map_before_it_stays(tmp_path):
    made = ef.map(ef.open(damaged_desk(tmp_path)), OPTIONS)
    with pytest.raises(OSError, match="events.txt"):
        made.points
    assert len(made.points) > 1000
    assert 0 < len(made.keyframes) == made.report["keyframes"]


def test_events_are_read_without_poses_and_calibration(desk, tmp_path):
    shutil.copy(os.path.join(DESK, "cam1", "events.txt"), tmp_path / "events.txt")
    alone = ef.open(tmp_path / "events.txt")
    part = next(alone.events(0, 1000))
    np.testing.assert_array_equal(part, next(desk.events(1, 1000)))
    assert len(alone.poses[0]) == 0 and alone.rig[0].K[0, 0] == 0
    for unit, per in (("us", 1000), ("s", 1e9)):
        np.testing.assert_allclose(next(alone.events(0, 1000, unit))["t"], part["t"] // per if unit == "us" else part["t"] / per)
    with pytest.raises(OSError, match="or calibration=FILE"):
        ef.map(alone).points


def test_a_calibration_may_have_more_cameras_than_the_recording(desk, tmp_path):
    shutil.copy(os.path.join(DESK, "cam1", "events.txt"), tmp_path / "events.txt")
    given = {"poses": os.path.join(DESK, "poses.txt"), "calibration": os.path.join(DESK, "camchain.yaml"), "t1": "+0.5"}
    with pytest.raises(ValueError, match=r"cameras=\[1\] takes"):
        ef.open(tmp_path / "events.txt", **given)
    alone = ef.open(tmp_path / "events.txt", **given, cameras=[1])
    np.testing.assert_array_equal(alone.rig[0].T_rig_cam, desk.rig[1].T_rig_cam)
    assert len(ef.map(alone).points) > 100


def test_times_are_those_of_the_command_line(desk):
    first = int(next(desk.events(0, 1))["t"][0])
    for t0, expected in (("+0.25", first + 250_000_000), ("1.25", 1_250_000_000), (1_250_000_007, 1_250_000_007)):
        part = next(ef.open(DESK, t0=t0).events(0, 1000))
        assert part["t"][0] >= expected > part["t"][0] - 1_000_000


def test_the_dsi_is_that_of_the_program(desk, tmp_path):
    all_planes = "performance.coarse_to_fine=false"  # the depths are those of the DSI alone
    window = "--t0", "1.5", "--t1", "1.75"
    program("depth", DESK, "-q", *window, "--save-dsi", "--set", all_planes, "--out", tmp_path / "depth")
    dsi = ef.dsi(desk, "1.5", "1.75", {"performance.coarse_to_fine": False})
    values, depths = dsi
    np.testing.assert_array_equal(values, np.load(tmp_path / "depth" / "dsi.npy"))
    assert values.dtype == np.float32 and len(depths) == len(values) and np.all(np.diff(depths) > 0)
    # A depth is near the best plane: values of its neighbours are summed.
    rows, columns = np.nonzero(dsi.keyframe.depth)
    best = np.argmax(values[:, rows, columns], axis=0)
    plane = np.interp(dsi.keyframe.depth[rows, columns], depths, np.arange(len(depths)))
    assert np.mean(np.abs(plane - best) <= 3) > 0.9
    # A pixel with a depth has contrast, and few others have it.
    assert dsi.contrast.shape == dsi.keyframe.depth.shape
    assert np.all(dsi.contrast[rows, columns] > 0.15) and np.mean(dsi.contrast > 0.15) < 0.5
    whole = ef.dsi(ef.open(DESK, t0="1.5", t1="1.75"))
    assert whole.keyframe.window[0] >= 1_500_000_000 and whole.keyframe.window[1] <= 1_750_000_000
    assert whole.keyframe.window[1] - whole.keyframe.window[0] > 240_000_000


def test_the_info_is_that_of_the_program(desk):
    info = desk.info()
    text = program("info", DESK)
    for camera in info["cameras"]:
        assert f"{camera['events']} events from" in text and f"{camera['width']}x{camera['height']} pixels" in text
    assert f"{info['poses'][0]['poses']} poses from" in text and info["poses"][0]["used"]
    for option in info["chosen"]:
        assert option["reason"] in text
    assert desk.warnings() == []
    events = os.path.join(DESK, "cam0", "events.txt")
    assert "no-poses" in [name for name, _ in ef.open(events, sensor_size=(346, 260), t1="+0.2").warnings()]


def test_errors_are_those_of_the_program(made, desk, folder, tmp_path):
    of_depth, of_map = ef.evaluate.depth(folder, DESK), ef.evaluate.map(folder, DESK)
    assert of_depth == json.loads(program("evaluate", "depth", folder, DESK, "--json"))
    assert of_map == json.loads(program("evaluate", "map", folder, DESK, "--json"))
    of_path = ef.evaluate.trajectory(folder, DESK)
    assert of_path == json.loads(program("evaluate", "trajectory", folder, DESK, "--json"))
    # From memory: the same numbers, but for the names, and float32 in the PCD file.
    assert ef.evaluate.depth(iter(made), desk)["all"] == of_depth["all"]
    for points in (made, np.stack([made.points[axis] for axis in "xyz"], 1)):
        assert ef.evaluate.map(points, desk)["accuracy"] == of_map["accuracy"]
    assert ef.evaluate.trajectory(made, desk)["pairs"] == of_path["pairs"]
    poses = np.loadtxt(os.path.join(DESK, "poses.txt"))
    rows = "".join(f"{round(1e9 * row[0])},{','.join(map(repr, row[1:]))}\n" for row in poses.tolist())
    (tmp_path / "ns.csv").write_text("timestamp,x,y,z,qx,qy,qz,qw\n" + rows)
    with pytest.raises(OSError, match="truth_time_unit='ns'"):
        ef.evaluate.trajectory(folder, tmp_path / "ns.csv")
    in_ns = ef.evaluate.trajectory(folder, tmp_path / "ns.csv", truth_time_unit="ns")
    assert in_ns["ate"] == of_path["ate"]
    keyframe = made.keyframes[0]
    truth = ef.evaluate.true_depth(desk, keyframe.t)
    np.save(tmp_path / "truth.npy", truth)
    one = ef.evaluate.depth(keyframe.depth, truth)["all"]
    assert one == ef.evaluate.depth(keyframe.depth, tmp_path / "truth.npy")["all"]
    assert one["points"] == of_depth["maps"][0]["points"]


def test_a_simulation_is_that_of_the_program_and_shows_its_progress(tmp_path, monkeypatch, capsys):
    program("simulate", "-q", "--preset", "slider", "--duration", "0.1", "--seed", "3", "--out", tmp_path / "program")
    ef.simulate("slider", 3, duration=0.1, out=tmp_path / "python")
    for file in glob.glob("**/*", root_dir=tmp_path / "program", recursive=True):
        if (tmp_path / "program" / file).is_file():
            assert (tmp_path / "python" / file).read_bytes() == (tmp_path / "program" / file).read_bytes(), file
    monkeypatch.setitem(sys.modules, "tqdm.auto", None)  # not installed
    temporary = ef.simulate("slider", duration=0.1)
    assert re.search(r"simulating: \d+%, \d+ s left", capsys.readouterr().err)
    path = temporary.files[0]
    assert len(next(temporary.events())) > 0
    del temporary
    assert not os.path.exists(path)


def test_a_simulation_has_the_truth_of_its_recording(tmp_path):
    simulation = ef.Simulation("desk_stereo", duration=0.1)
    recording = simulation.record(tmp_path / "desk", progress=False)
    times, poses = simulation.poses()
    np.testing.assert_array_equal(times, recording.poses[0])
    np.testing.assert_allclose(poses, recording.poses[1], atol=1e-9)
    made = simulation.events()
    for camera, (events, points) in enumerate(made):
        np.testing.assert_array_equal(events, np.concatenate(list(recording.events(camera))))
        assert points.shape == (len(events), 3)
    # Events lie where the camera sees their points.
    events, points = made[0]
    t = int(events["t"][len(events) // 2])
    now = np.abs(events["t"] - t) < 200_000
    in_camera = (np.linalg.inv(simulation.poses([t])[1][0]) @ np.c_[points[now], np.ones(now.sum())].T)[:3]
    pixels = (simulation.cameras[0].K @ in_camera / in_camera[2])[:2]
    assert np.median(np.hypot(pixels[0] - events["x"][now], pixels[1] - events["y"][now])) < 0.7
    # The keyframe of a window is that of `dsi`; its truth at a time of the folder is the folder's.
    options = {"dsi.min_depth_m": 0.5, "dsi.max_depth_m": 5, "dsi.num_planes": 60, "performance.coarse_to_fine": False}
    window = simulation.start, simulation.start + 10**8, simulation.start + 5 * 10**7
    keyframe = ef.keyframes(simulation.cameras, [events for events, _ in made], simulation.poses(), [window], options)[0]
    assert keyframe.window == window[:2] and keyframe.t == window[2]
    of_dsi = ef.dsi(recording, *window[:2], {**options, "filter.hot_pixels": False}, t_ref=window[2]).keyframe
    np.testing.assert_allclose(keyframe.depth, of_dsi.depth, rtol=1e-5)
    truth = simulation.depth(keyframe)
    np.testing.assert_array_equal(truth, ef.evaluate.true_depth(recording, keyframe.t))
    both = ef.evaluate.depth([keyframe.depth, 0 * truth], [truth, truth], focal_baseline=10)
    assert both["all"]["points"] == np.count_nonzero((keyframe.depth > 0) & (truth > 0))
    assert both["all"]["bad_pix_5px"] < 0.2 and len(both["maps"]) == 2
    # Other cameras and another motion in the scene of a preset.
    small = ef.Camera(100, 80, [[60, 0, 50], [0, 60, 40], [0, 0, 1]])
    other = ef.Simulation("desk_stereo", calibration=[small], trajectory=simulation.poses(), duration=0.05)
    assert other.cameras[0].width == 100 and len(other.events()) == 1
    assert simulation.surfaces.shape[1:] == (3, 3)


def test_poses_and_cameras_are_written_and_read(desk, tmp_path):
    ef.write_poses(tmp_path / "poses.txt", desk.poses)
    ef.write_cameras(tmp_path / "camchain.yaml", desk.rig)
    for written, read in zip(desk.poses, ef.read_poses(tmp_path / "poses.txt")):
        np.testing.assert_allclose(read, written, rtol=0, atol=1e-12)  # rotations are rounded
    turned = desk.rig[1].T_rig_cam.copy()
    turned[:3, :3] = turned[:3, :3] @ np.array([[0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    right = ef.Camera(346, 260, desk.rig[1].K, T_rig_cam=turned)
    changed = ef.open(DESK, calibration=[desk.rig[0], right], poses=ef.perturb(desk.poses, {"noise_m": 0.1, "seed": 3}))
    np.testing.assert_allclose(changed.rig[1].T_rig_cam, turned, atol=1e-12)
    off = np.linalg.norm(changed.poses[1][:, :3, 3] - desk.poses[1][:, :3, 3], axis=1)
    assert 0.1 < np.median(off) < 0.2
    assert ef.read_cameras(tmp_path / "camchain.yaml")[1].K.tolist() == desk.rig[1].K.tolist()
    with pytest.raises(ValueError, match="noise_x"):
        ef.perturb(desk.poses, {"noise_x": 1})


def test_the_errors_for_other_numpy_files_name_lines_that_work(desk, tmp_path):
    events = np.concatenate(list(desk.events()))[:5000]
    np.savez(tmp_path / "own.npz", xs=events["x"], ys=events["y"], pol=events["p"], ts=events["t"] // 1000)
    with pytest.raises(OSError) as error:
        ef.open(tmp_path / "own.npz")
    python = re.search(r"import numpy.*?(?=, if these)", str(error.value)).group(0)
    subprocess.run([sys.executable, "-c", python], cwd=tmp_path, check=True)
    read = np.concatenate(list(ef.open(tmp_path / "events.npy", time_unit="ns").events()))
    np.testing.assert_array_equal(read, events)
    np.savez(tmp_path / "poses.npz", t=desk.poses[0] * 1e-9, T=desk.poses[1])
    with pytest.raises(OSError, match="ef.write_poses"):
        ef.open(DESK, poses=tmp_path / "poses.npz")


def test_a_live_mapper_maps_in_its_own_thread(desk):
    keyframes = []
    mapper = ef.Mapper({**OPTIONS, "live.enabled": True, "live.max_queue_mb": 1000}, keyframes.append)
    mapper.add_recording(desk)
    mapper.finish()
    assert mapper.status == {"keyframes": len(keyframes), "drop_ratio": 0}
    assert len(keyframes) > 1 and len(mapper.points) > 1000


@pytest.mark.parametrize("far", [(500_000, 4_500_000, 100.0), (4_177_000, 855_000, 4_727_000)], ids=["UTM", "ECEF"])
def test_points_are_in_the_world_wherever_it_is(far, desk, made, tmp_path):
    times, poses = desk.poses
    poses = poses.copy()
    poses[:, :3, 3] += far
    recording = ef.open(DESK, poses=(times, poses))
    mapper = ef.Mapper(OPTIONS)
    for camera in desk.rig:
        mapper.add_camera(camera)
    mapper.add_poses(times, poses)
    for camera in range(2):
        mapper.add_events(camera, np.concatenate(list(desk.events(camera))))
    with pytest.warns(ef.EventFusionWarning, match="far-coordinates"):
        mapper.finish()
    with pytest.warns(ef.EventFusionWarning, match="far-coordinates"):
        by_map = ef.map(recording, OPTIONS)
        by_map.points
    near = np.median([made.points[axis] for axis in "xyz"], axis=1)
    for one in (mapper, by_map):
        np.testing.assert_allclose(np.median([one.points[axis] for axis in "xyz"], axis=1), near + far, atol=0.01)
        one.save(tmp_path / "map.ply")
        assert ef.evaluate.map(one, tmp_path / "map.ply")["accuracy"]["max_m"] < 1e-6
    mapper.save(tmp_path / "map.pcd")
    assert ef.evaluate.map(mapper, tmp_path / "map.pcd")["accuracy"]["max_m"] < 1e-6


def in_threads(count, call):
    """Call a function in threads; return their results and exceptions. It fails where one does not end."""
    results = []

    def run():
        try:
            results.append(call())
        except Exception as error:
            results.append(error)

    threads = [threading.Thread(target=run, daemon=True) for _ in range(count)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(600)
    assert not any(thread.is_alive() for thread in threads)
    return results


def test_threads_may_share_a_map_a_reader_and_a_mapper(desk, made):
    times = [k.t for k in made]
    shared = ef.map(desk, OPTIONS)
    assert in_threads(4, lambda: [k.t for k in shared]) == [times] * 4
    once = ef.map(desk, OPTIONS, keep=False)
    results = in_threads(4, lambda: [k.t for k in once])
    assert sum(isinstance(r, RuntimeError) for r in results) == 3 and times in results
    reader = ef._engine.EventReader(desk._source)
    parts = in_threads(4, lambda: read_all(reader))
    assert sum(len(part) for parts_of_one in parts for part in parts_of_one) == sum(map(len, desk.events(0)))

    # A thread that asks for the points again and again keeps neither others nor the interpreter waiting.
    mapper = ef.Mapper({**OPTIONS, "live.max_queue_mb": 1})
    for camera in desk.rig:
        mapper.add_camera(camera)
    mapper.add_poses(*desk.poses)
    done, polls = threading.Event(), []

    def poll():
        while not done.is_set():
            polls.append(len(mapper.points) + mapper.status["keyframes"] + len(mapper.trajectory[0]))

    poller = threading.Thread(target=poll, daemon=True)
    poller.start()
    for camera in range(2):
        for part in desk.events(camera, 100_000):
            mapper.add_events(camera, part)
    mapper.finish()
    done.set()
    poller.join(600)
    assert not poller.is_alive() and len(polls) > 0 and mapper.status["keyframes"] > 1


def read_all(reader):
    parts = []
    while len(part := reader.next(0, 10_000)) > 0:
        parts.append(part)
    return parts


ENDS = {
    "a live callback runs": """
def slow(keyframe):
    for _ in range(20):
        time.sleep(0.005)
mapper = ef.Mapper({**OPTIONS, "live.enabled": True}, slow)
mapper.add_recording(desk)
time.sleep(0.3)
""",
    "a daemon thread finishes": """
mapper = ef.Mapper({**OPTIONS, "live.enabled": True})
mapper.add_recording(desk)
threading.Thread(target=mapper.finish, daemon=True).start()
time.sleep(0.05)
""",
    "a daemon thread asks": """
mapper = ef.Mapper({**OPTIONS, "live.enabled": True})
mapper.add_recording(desk)
def poll():
    while True:
        mapper.status, mapper.points
threading.Thread(target=poll, daemon=True).start()
time.sleep(0.1)
""",
    "a daemon thread maps in playback": """
mapper = ef.Mapper(OPTIONS)
threading.Thread(target=lambda: (mapper.add_recording(desk), mapper.finish()), daemon=True).start()
time.sleep(0.3)
""",
    "a map goes on": """
made = ef.map(desk, OPTIONS)
next(iter(made))
""",
    "a daemon thread simulates": """
threading.Thread(target=lambda: ef.simulate("slider", duration=2), daemon=True).start()
time.sleep(0.3)
""",
    "the callback drops the mapper": """
def drop(keyframe):
    global mapper
    mapper = None
mapper = ef.Mapper(OPTIONS, drop)
mapper.add_recording(desk)
(mapper or ef.Mapper()).finish()
""",
}


@pytest.mark.parametrize("name", ENDS)
def test_python_ends_while(name):
    code = f"import threading, time, event_fusion as ef\nOPTIONS = {OPTIONS}\ndesk = ef.open({DESK!r})\n" + ENDS[name]
    ended = subprocess.run([sys.executable, "-W", "ignore", "-c", code], capture_output=True, text=True, timeout=600)
    assert ended.returncode == 0, ended.stderr


def test_warnings_are_warnings_of_python(desk):
    options = {**OPTIONS, "dsi.max_depth_m": 0.7, "depth.min_probability": 0}
    inverted = ef.map(ef.open(DESK, poses=os.path.join(DESK, "poses.txt")), options)
    with pytest.warns(ef.EventFusionWarning, match="depths-at-limit"):
        inverted.points


def test_figures_are_drawn_from_keyframes_and_arrays(made, desk, tmp_path):
    keyframe = made.keyframes[0]
    errors = ef.evaluate.depth(made, desk)
    drawn = {
        "depth": plot.depth(keyframe),
        "array": plot.depth(keyframe.depth, limits=(0.5, 5)),
        "empty": plot.depth(np.zeros((20, 30))),
        "confidence": plot.confidence(keyframe),
        "error": plot.error(keyframe, desk, tolerance_px=1),
        "precision": plot.precision_recall(errors),
        "completeness": plot.precision_recall(ef.evaluate.map(made, desk)),
        "map": plot.map(made),
        "points": plot.map(keyframe.points(), up=(0, -1, 0)),
        "trajectory": plot.trajectory(desk, made, labels=["true", "map"]),
    }
    for name, axes in drawn.items():
        assert isinstance(axes, matplotlib.axes.Axes)
        axes.figure.savefig(tmp_path / f"{name}.pdf")
        plot.pyplot.close(axes.figure)
    same = plot.pyplot.figure().add_subplot()
    assert plot.map(made, same) is same


def test_the_error_picture_has_the_errors_of_the_evaluation(made, desk):
    keyframe = made.keyframes[0]
    for tolerance in (0, 1):
        percent = plot.error(keyframe, desk, tolerance_px=tolerance).images[0].get_array()
        shown = np.abs(np.ma.filled(percent, np.nan))
        shown = shown[np.isfinite(shown)]
        errors = ef.evaluate.depth(keyframe.depth, ef.evaluate.true_depth(desk, keyframe.t), tolerance_px=tolerance)["all"]
        assert len(shown) == errors["points"]
        assert abs(np.mean(shown > 10) - errors["beyond_tenth"]) < 1e-3  # relative to truth or estimate


def test_types_are_right(tmp_path):
    typed = [os.path.dirname(ef.__file__), *glob.glob(os.path.join(SOURCE, "examples", "python", "*.py"))]
    mypy = [sys.executable, "-m", "mypy", "--config-file", os.path.join(SOURCE, "pyproject.toml"), "--cache-dir", tmp_path]
    checked = subprocess.run([*mypy, *typed], capture_output=True, text=True)
    assert checked.returncode == 0, checked.stdout
    # The compiled module has what its stub says. Its classes have another metaclass, and constructors without names.
    (tmp_path / "allowed").write_text(r"event_fusion\._engine\.[A-Z]\w*(\.__init__)?" + "\n")
    stubtest = [sys.executable, "-m", "mypy.stubtest", "event_fusion._engine", "--allowlist", tmp_path / "allowed"]
    config = ["--mypy-config-file", os.path.join(SOURCE, "pyproject.toml"), "--ignore-unused-allowlist"]
    checked = subprocess.run([*stubtest, *config], capture_output=True, text=True, cwd=tmp_path)
    assert checked.returncode == 0, checked.stdout + checked.stderr


def test_the_examples_run(tmp_path):
    def example(name, *arguments):
        words = [sys.executable, os.path.join(SOURCE, "examples", "python", name), *map(str, arguments)]
        environment = {**os.environ, "MPLBACKEND": "agg"}
        return subprocess.run(words, cwd=tmp_path, env=environment, check=True, capture_output=True, text=True).stdout

    part = tmp_path / "part"
    program("export", DESK, "-q", "--to", "folder", "--t0", "+0.5", "--duration", "0.6", "--out", part)
    assert "points in own.pcd" in example("own_arrays.py", part)
    assert "depth maps" in example("dsec_depth.py", part, "", "depths")
    assert "pixels have a depth" in example("dsi_to_numpy.py", part, "+0.1", "+0.3")
    assert example("option_study.py", part, "fusion.across_cameras", "min", "harmonic").count("wrong by") == 2
    assert example("compare_maps.py", "own.pcd", "own.pcd", DESK).count("median error") == 2
    example("export_dsec.py", part, "hdf5")
    exported, recorded = ef.open(tmp_path / "hdf5"), ef.open(part)
    for camera in (0, 1):
        np.testing.assert_array_equal(*(np.concatenate(list(of.events(camera, 10**5))) for of in (exported, recorded)))
    late = ef.open(tmp_path / "hdf5", t0="+0.3")  # by the index
    np.testing.assert_array_equal(next(late.events())["t"], next(ef.open(part, t0="+0.3").events())["t"])
    keyframes = {os.path.splitext(file)[0] for file in os.listdir(tmp_path / "depths")}
    assert len(keyframes) > 0
    for file in ("own.pcd", "dsi.npz", "study.pdf", "compared.pdf", *(f"depths/{t}.npy" for t in keyframes)):
        assert (tmp_path / file).stat().st_size > 1000, file
    for lines in map(lambda file: open(file).read().count("\n"), glob.glob(os.path.join(SOURCE, "examples", "python", "*.py"))):
        assert lines < 40
