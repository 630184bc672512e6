# SPDX-License-Identifier: BSD-3-Clause
"""The package event_fusion: the arrays of recordings, and maps that are those of the program."""

import os
import subprocess
import threading
from decimal import Decimal

import numpy as np
import pytest

import event_fusion as ef

DESK = os.path.join(os.environ["EFM_RECORDINGS"], "desk_stereo")
OPTIONS = {"dsi.min_depth_m": 0.5, "dsi.max_depth_m": 5, "keyframes.stride_s": 0.5}


@pytest.fixture(scope="module")
def desk():
    return ef.open(DESK)


@pytest.fixture(scope="module")
def by_program(tmp_path_factory):
    """Map the desk by the program: the points of map.pcd, and keyframe depths."""
    out = tmp_path_factory.mktemp("map") / "out"
    settings = [word for key, value in OPTIONS.items() for word in ("--set", f"{key}={value}")]
    program = [os.environ["EFM_EVENT_FUSION"], "map", DESK, "-q", "--out", str(out)]
    subprocess.run(program + settings, check=True)
    return points_of(out / "map.pcd")


def points_of(pcd):
    """Read a binary PCD file whose fields have four bytes each."""
    content = pcd.read_bytes()
    end = content.index(b"DATA binary\n") + len(b"DATA binary\n")
    header = dict(line.split(" ", 1) for line in content[:end].decode().splitlines() if line[0] != "#")
    kinds = {"F": "f4", "U": "u4"}
    dtype = [(name, kinds[kind]) for name, kind in zip(header["FIELDS"].split(), header["TYPE"].split())]
    return np.frombuffer(content[end:], dtype, int(header["POINTS"]))


def test_all_ways_give_the_map_of_the_program(desk, by_program):
    from_file = ef.map(desk, OPTIONS)
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
    for points in (from_file.points, mapper.points):
        for name in ("x", "y", "z", "intensity", "support", "sigma"):
            np.testing.assert_array_equal(points[name], by_program[name], name)
    assert [k.t for k in keyframes] == [k.t for k in from_file] == list(from_file.trajectory[0])
    np.testing.assert_array_equal(keyframes[0].depth, from_file.keyframes[0].depth)


def test_a_keyframe_lies_on_the_points_of_the_map(desk):
    made = ef.map(desk, OPTIONS)
    keyframe = made.keyframes[0]
    rows, columns = np.nonzero(keyframe.depth)
    assert keyframe.depth.dtype == keyframe.confidence.dtype == keyframe.sigma.dtype == np.float32
    assert np.all(keyframe.sigma[rows, columns] > 0)
    assert keyframe.depth.base is not None and not keyframe.depth.flags.writeable
    z = keyframe.depth[rows, columns]
    p_ref = np.linalg.inv(keyframe.K) @ np.stack([columns * z, rows * z, z])
    p_world = (keyframe.pose @ np.vstack([p_ref, np.ones_like(z)]))[:3].T
    points = np.stack([made.points[axis] for axis in "xyz"], axis=1)
    # The map averages the points of a voxel of 2 cm.
    for p in p_world[:: len(p_world) // 50]:
        assert np.min(np.linalg.norm(points - p, axis=1)) < 0.04


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
    made = ef._event_records(other, unit)
    for name in "xyp":
        np.testing.assert_array_equal(made[name], whole[name])
    assert np.max(np.abs(made["t"] - whole["t"]), initial=0) <= (1 if unit == "s" else 0)


def stereo_mapper():
    mapper = ef.Mapper(OPTIONS)
    mapper.add_camera(ef.Camera(10, 10, np.array([[5, 0, 5], [0, 5, 5], [0, 0, 1.0]])))
    return mapper


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
    "no pose": (lambda: stereo_mapper().add_pose(0, np.ones((3, 4))), ValueError, "4 x 4"),
}


@pytest.mark.parametrize("name", ERRORS)
def test_mistakes_are_errors_that_name_the_value(name):
    call, kind, text = ERRORS[name]
    with pytest.raises(kind, match=text):
        call()


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
