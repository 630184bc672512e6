# SPDX-License-Identifier: BSD-3-Clause
"""Session files, read by the package and by a reader that knows only the specifications of MCAP, CDR and ROS 2."""

import hashlib
import json
import os
import shutil
import struct
import subprocess
import zlib

import matplotlib.pyplot as plt
import numpy as np
import pytest
import zstandard

import event_fusion as ef

DESK = os.path.join(os.environ["EFM_RECORDINGS"], "desk_stereo")
OPTIONS = {"dsi.min_depth_m": 0.5, "dsi.max_depth_m": 5, "keyframes.stride_s": 0.5, "refinement.enabled": True}


class Fields:
    """Takes the fields of an MCAP record."""

    def __init__(self, data):
        self.data, self.at = data, 0

    def number(self, code):
        (value,) = struct.unpack_from("<" + code, self.data, self.at)
        self.at += struct.calcsize("<" + code)
        return value

    def text(self):
        size = self.number("I")
        self.at += size
        return self.data[self.at - size : self.at].decode()


def records(data):
    at = 0
    while at < len(data):
        op, size = data[at], struct.unpack_from("<Q", data, at + 1)[0]
        yield op, data[at + 9 : at + 9 + size]
        at += 9 + size


def read_mcap(path):
    """Return (topic, type, definition, message) of each message, and the statistics; checks the checksums."""
    with open(path, "rb") as file:
        data = file.read()
    assert data[:8] == data[-8:] == b"\x89MCAP0\r\n"
    schemas, channels, messages, statistics, chunks = {}, {}, [], None, 0

    def take(op, content):
        nonlocal statistics, chunks
        fields = Fields(content)
        if op == 3:
            key, name, encoding = fields.number("H"), fields.text(), fields.text()
            assert encoding == "ros2msg"
            schemas[key] = name, fields.text()
        elif op == 4:
            key, schema, topic, encoding = fields.number("H"), fields.number("H"), fields.text(), fields.text()
            assert encoding == "cdr"
            channels[key] = topic, *schemas[schema]
        elif op == 5:
            channel, sequence, _, _ = (fields.number(code) for code in "HIQQ")
            messages.append((*channels[channel], content[fields.at :], sequence))
        elif op == 6:
            chunks += 1
            _, _, size, checksum = (fields.number(code) for code in "QQQI")
            assert fields.text() == "zstd"
            packed = content[fields.at + 8 : fields.at + 8 + fields.number("Q")]
            unpacked = zstandard.ZstdDecompressor().decompress(packed, size)
            assert len(unpacked) == size and zlib.crc32(unpacked) == checksum
            for inner in records(unpacked):
                take(*inner)
        elif op == 11:
            statistics = [fields.number(code) for code in "QHIIII"]

    for op, content in records(data[8:-8]):
        take(op, content)
    summary_at, _, checksum = struct.unpack("<QQI", data[-28:-8])
    assert zlib.crc32(data[summary_at:-12]) == checksum
    return messages, statistics, chunks


class Cdr(Fields):
    """Takes the values of a message, aligned to their sizes behind the header of four bytes."""

    def __init__(self, data):
        super().__init__(data[4:])

    def number(self, code):
        self.at += -self.at % struct.calcsize("<" + code)
        return super().number(code)

    def text(self):
        return super().text()[:-1]

    def value(self, type_name):
        """Return a value of a ROS 2 type: a number, a text, or an array."""
        codes = {"uint8": "B", "float32": "f", "float64": "d", "int32": "i", "int64": "q", "uint16": "H", "uint32": "I", "uint64": "Q"}
        if type_name == "string":
            return self.text()
        name, _, size = type_name.partition("[")
        if not size:
            return self.number(codes[name])
        count = int(size[:-1]) if size != "]" else self.number("I")
        if count:
            self.at += -self.at % struct.calcsize("<" + codes[name])
        array = np.frombuffer(self.data, "<" + np.dtype(name).str[1:], count, self.at)
        self.at += array.nbytes
        return array


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    out = tmp_path_factory.mktemp("session") / "out"
    return ef.map(DESK, OPTIONS, out=out), out


def test_an_independent_reader_finds_the_keyframes(result):
    made, out = result
    keyframes = made.keyframes
    messages, statistics, chunks = read_mcap(out / "session.mcap")
    assert statistics[0] == len(messages) and statistics[-1] == chunks == len(keyframes) + 3  # run, poses, report
    of = {topic: [(definition, Cdr(data)) for name, _, definition, data, _ in messages if name == topic] for topic, *_ in messages}
    assert len(of["/efm/run"]) == len(of["/efm/poses"]) == len(of["/efm/report"]) == 1
    for number, keyframe in enumerate(keyframes):
        definition, message = of["/efm/keyframe"][number]
        stored = {}
        for line in definition.splitlines():
            type_name, name = line.split("#")[0].split()
            stored[name] = message.value(type_name)
        assert message.at == len(message.data), "the schema describes the whole message"
        v, u = np.nonzero(keyframe.depth)
        assert (stored["t_ref_ns"], stored["t0_ns"], stored["t1_ns"]) == (keyframe.t, *keyframe.window)
        assert np.array_equal(stored["v"], v) and np.array_equal(stored["u"], u)
        for name, image in (("depth_m", keyframe.depth), ("confidence", keyframe.confidence), ("probability", keyframe.probability)):
            assert np.array_equal(stored[name], image[v, u], equal_nan=True), name

        _, cloud = of["/efm/points"][number]
        stamp = cloud.number("i"), cloud.number("I")
        assert stamp[0] * 10**9 + stamp[1] == keyframe.t and cloud.text() == "keyframe"
        assert (cloud.number("I"), cloud.number("I")) == (1, len(u))
        fields = [(cloud.text(), cloud.number("I"), cloud.number("B"), cloud.number("I")) for _ in range(cloud.number("I"))]
        assert [field[0] for field in fields] == ["x", "y", "z", "intensity", "sigma_m"]
        assert cloud.number("B") == 0 and cloud.number("I") == 20 and cloud.number("I") == 20 * len(u)
        points = np.frombuffer(cloud.data, "<f4", cloud.number("I") // 4, cloud.at).reshape(-1, 5)
        assert np.array_equal(points[:, 2], keyframe.depth[v, u]) and np.array_equal(points[:, 3], keyframe.confidence[v, u])
        in_world = np.c_[points[:, :3], np.ones(len(points))] @ keyframe.pose.T
        assert np.allclose(in_world[:, :3], keyframe.points(), atol=1e-5)  # float32 against float64


def test_a_session_gives_what_the_map_was_made_from(result):
    made, out = result
    session = ef.Session(out)
    assert len(session) == len(made.keyframes)
    assert session.damage == ""
    assert session.report == made.report and session.report["map_hash"] == made.hash
    for one, other in zip(session.keyframes, made.keyframes):
        assert np.array_equal(one.depth, other.depth) and one.t == other.t and np.array_equal(one.pose, other.pose)
    assert np.array_equal(session.poses()[1], made.trajectory[1])
    assert np.array_equal(session.poses(refined=False)[1], made.tracker_trajectory[1])
    assert session.run["options"] == made.report["options"] and session.run["given"]["dsi"]["max_depth_m"] == 5
    assert "7 keyframes" in repr(session) or f"{len(session)} keyframes" in repr(session)
    with pytest.raises(IndexError):
        session.keyframe(len(session))
    with pytest.raises(OSError, match="no session file|cannot read"):
        ef.Session(out / "map.pcd")


def test_the_hash_is_that_of_the_sorted_points(result):
    made, _ = result
    points = made.points
    names = ("x", "y", "z", "intensity", "sigma", "probability", "support")
    rows = np.stack([points[name].astype("<f8") for name in names], axis=1)
    rows = np.where(np.isnan(rows), -1, rows)
    rows = rows[np.lexsort(rows.T[::-1])]
    assert hashlib.sha256(rows.tobytes()).hexdigest() == made.hash


def test_a_complete_map_is_not_changed_and_given_again(result):
    made, out = result
    before = {file: os.stat(out / file).st_mtime_ns for file in os.listdir(out)}
    again = ef.map(DESK, OPTIONS, out=out, resume=True)
    assert again.hash == made.hash and again.report == made.report
    assert np.array_equal(again.trajectory[1], made.trajectory[1])
    assert len(again.keyframes) == len(made.keyframes)
    assert {file: os.stat(out / file).st_mtime_ns for file in os.listdir(out)} == before
    with pytest.raises(OSError, match=r"dsi.max_depth_m was 5(\.0)?, now 6"):
        ef.map(DESK, {**OPTIONS, "dsi.max_depth_m": 6}, out=out, resume=True).report
    with pytest.raises(ValueError, match="resume=True: expected out="):
        ef.map(DESK, OPTIONS, resume=True)


def test_mappers_write_a_session_in_playback_and_live(tmp_path):
    file = tmp_path / "live.mcap"
    desk = ef.open(DESK)
    for live in (False, True):
        mapper = ef.Mapper({**OPTIONS, "output.session_file": file, "live.enabled": live})
        mapper.add_recording(desk)
        mapper.finish()
        session = ef.Session(file)
        assert len(session) == len(mapper.trajectory[0]) > 0 and session.damage == ""
        assert session.report["map_hash"] == mapper.hash
        assert np.array_equal(session.poses()[1], mapper.trajectory[1])
    assert sorted(os.listdir(tmp_path)) == ["live.mcap", "live.mcap.1"]
    with pytest.raises(OSError, match="there is no folder"):
        ef.Mapper({"output.session_file": tmp_path / "missing" / "a.mcap"})


def test_program_and_module_have_the_same_hash(result, tmp_path):
    made, _ = result
    words = [os.environ["EFM_EVENT_FUSION"], "map", DESK, "--out", str(tmp_path / "out")]
    words += [f"--set={key}={str(value).lower()}" for key, value in OPTIONS.items()]
    text = subprocess.run([*words, "--set=performance.threads=1"], check=True, capture_output=True, text=True).stdout
    assert f"hash        {made.hash}\n" in text


def program(*words):
    words = [os.environ["EFM_EVENT_FUSION"], *map(str, words)]
    return subprocess.run(words, check=True, capture_output=True, text=True).stdout


def mapped(out, options):
    program("map", DESK, "-q", "--out", out, *(f"--set={key}={str(value).lower()}" for key, value in options.items()))
    return out


EXPORTS = {
    "voxels": ({}, {"map.voxel_size_m": 0.05}),
    "support": ({"map.consistency": "visibility"}, {"map.min_keyframes": 2}),
    "visibility": ({"map.consistency": "none"}, {"map.consistency": "visibility"}),
    "outliers": ({}, {"map.outlier_radius_m": 0.05, "map.outlier_min_neighbors": 4}),
    "quality": ({"keyframes.stride_s": 0.2}, {"map.min_keyframe_quality": "median"}),
    "late": ({"fusion.late": True}, {"map.voxel_size_m": 0.03}),
    "probability": ({"refinement.enabled": False}, {"depth.min_probability": 0.97}),
}


@pytest.mark.parametrize("name", EXPORTS)
def test_the_map_of_a_session_is_that_of_a_new_run(name, tmp_path):
    before, change = EXPORTS[name]
    first = mapped(tmp_path / "first", {**OPTIONS, **before})
    if "median" in change.values():
        shares = json.loads((first / "report.json").read_text())["quality"]["keyframes"]
        change = {"map.min_keyframe_quality": sorted(shares)[len(shares) // 2] + 1e-4}  # they have three decimals
    new = mapped(tmp_path / "new", {**OPTIONS, **before, **change})
    sets = [f"--set={key}={value}" for key, value in change.items()]
    for file in ("map.pcd", "map.simplemap"):
        program("export", first, *sets, "--out", tmp_path / file)
        assert (tmp_path / file).read_bytes() == (new / file).read_bytes(), file
    assert (first / "map.pcd").read_bytes() != (new / "map.pcd").read_bytes()


def test_sessions_are_corrected_cut_and_merged(tmp_path):
    plain = {**OPTIONS, "refinement.enabled": False}
    whole = mapped(tmp_path / "whole", plain)
    times = [float(line.split()[0]) for line in (whole / "trajectory.txt").read_text().splitlines() if line[0] != "#"]
    # By exact poses, the map of a tracker with errors is that of the keyframes at these poses.
    noisy = tmp_path / "noisy"
    words = [f"--set={key}={str(value).lower()}" for key, value in plain.items()]
    program("map", DESK, "-q", "--out", noisy, *words, "--perturb", "tracker=poor", "--perturb", "seed=3")
    before = ef.Session(noisy).poses()[1]
    program("export", noisy, "--out", tmp_path / "fixed.pcd", "--poses", DESK + "/poses.txt", "--store")
    session = ef.Session(noisy)
    exact = ef.Session(whole).poses()[1]
    assert np.allclose(session.poses()[1], exact, atol=1e-6) and not np.allclose(before, exact, atol=1e-3)
    assert session.report["points"] > 0 and session.damage == "" and len(session) == len(times)
    program("export", noisy, "--out", tmp_path / "stored.pcd")
    assert (tmp_path / "stored.pcd").read_bytes() == (tmp_path / "fixed.pcd").read_bytes()
    # Cut between two keyframes, and put together again.
    middle = (times[len(times) // 2 - 1] + times[len(times) // 2]) / 2
    program("export", whole, "--out", tmp_path / "early.mcap", "--t1", middle)
    program("export", whole, "--out", tmp_path / "late.mcap", "--t0", middle)
    program("export", tmp_path / "early.mcap", tmp_path / "late.mcap", "--out", tmp_path / "again.pcd")
    assert (tmp_path / "again.pcd").read_bytes() == (whole / "map.pcd").read_bytes()
    # The points in a box are those of the map.
    program("export", whole, "--out", tmp_path / "box.pcd", "--box", "-0.2,-9,-9,0.3,9,9")
    rows = pcd(whole / "map.pcd")
    inside = rows[(rows["x"] >= -0.2) & (rows["x"] <= 0.3)]
    assert 0 < len(inside) < len(rows) and pcd(tmp_path / "box.pcd").tobytes() == inside.tobytes()
    # Some of a trajectory's keyframes, or fewer poses than keyframes, are not taken for the rig's poses.
    lines = [line for line in (whole / "trajectory.txt").read_text().splitlines() if line[0] != "#"]
    (tmp_path / "fewer.txt").write_text("\n".join(lines[:2] + lines[3:]) + "\n")
    words = [os.environ["EFM_EVENT_FUSION"], "export", str(noisy), "--out", str(tmp_path / "x.pcd"), "--poses"]
    failed = subprocess.run([*words, str(tmp_path / "fewer.txt")], capture_output=True, text=True)
    assert failed.returncode == 1 and "the time of keyframe 2: it has" in failed.stderr and "poses of keyframes" in failed.stderr
    text = program("export", tmp_path / "early.mcap", "--out", tmp_path / "part.pcd", "--poses", whole / "trajectory.txt")
    assert "T_world_ref of the keyframes" in text and (tmp_path / "part.pcd").stat().st_size > 0
    # A simplemap whose poses another program moved: those of the noisy session, and then the exact ones.
    program("export", noisy, "--out", tmp_path / "by_simplemap.pcd", "--poses", whole / "map.simplemap")
    rows, exact_rows = pcd(tmp_path / "by_simplemap.pcd"), pcd(tmp_path / "fixed.pcd")
    assert abs(len(rows) - len(exact_rows)) < 0.001 * len(rows)
    assert np.allclose(np.median(rows["x"]), np.median(exact_rows["x"]), atol=1e-3)


def pcd(path):
    data = path.read_bytes()
    names = ["x", "y", "z", "intensity", "support", "sigma", "probability"]
    return np.frombuffer(data[data.index(b"DATA binary\n") + 12 :], [(n, "<u4" if n == "support" else "<f4") for n in names])


def test_the_module_makes_corrects_and_merges_maps(result, tmp_path):
    made, out = result
    shutil.copy(out / "session.mcap", tmp_path / "a.mcap")
    session = ef.Session(tmp_path / "a.mcap")
    assert session.cloud().tobytes() == made.points.tobytes()
    few = session.cloud(voxel_size_m=0.05, min_keyframes=2, min_probability=0.96, box=[-9, -9, -9, 0.1, 9, 9])
    assert 0 < len(few) < len(made.points) and few["support"].min() >= 2 and few["x"].max() <= 0.1
    program("export", tmp_path / "a.mcap", "--out", tmp_path / "few.pcd", "--set", "map.voxel_size_m=0.05", "--set", "map.min_keyframes=2",
            "--set", "depth.min_probability=0.96", "--box", "-9,-9,-9,0.1,9,9")
    assert np.array_equal(pcd(tmp_path / "few.pcd")["x"], few["x"].astype("f4"))
    with pytest.raises(ValueError, match="min_probability=0.1: expected at least"):
        session.cloud(min_probability=0.1)
    with pytest.raises(ValueError, match="dsi.max_depth_m=3: expected an option of"):
        session.cloud(options={"dsi.max_depth_m": 3})
    # Corrected by poses that are all displaced, the map is displaced.
    times, poses = session.poses()
    moved = poses.copy()
    moved[:, 0, 3] += 1
    session.correct((times, moved))
    assert np.allclose(session.poses()[1], moved) and np.array_equal(ef.Session(tmp_path / "a.mcap").poses()[1], session.poses()[1])
    assert np.isclose(np.median(session.cloud()["x"]), np.median(made.points["x"]) + 1, atol=1e-3)
    # Half of it, displaced by 5 cm and 2 degrees, is registered with the other half.
    whole = ef.Session(out)
    half = int(times[len(times) // 2])
    whole.export(tmp_path / "early.mcap", t1=half)
    whole.export(tmp_path / "late.mcap", t0=half)
    early, late = ef.Session(tmp_path / "early.mcap"), ef.Session(tmp_path / "late.mcap")
    assert len(early) + len(late) == len(whole)
    angle = np.deg2rad(2)
    wrong = np.eye(4)
    wrong[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    wrong[:3, 3] = 0.03, 0.04, 0
    merged = early.merge([late], tmp_path / "merged.mcap", transforms=[wrong], register=True)
    (found,) = merged.registrations
    assert found["pairs"] >= 2 and found["sigma_m"] < 0.02 and found["moved_deg"] == pytest.approx(2, abs=0.3)
    true = poses[len(early) :, :3, 3]
    error = np.linalg.norm(merged.poses()[1][len(early) :, :3, 3] - true, axis=1)
    before = np.linalg.norm(true @ wrong[:3, :3].T + wrong[:3, 3] - true, axis=1)
    assert error.max() < 4 * found["sigma_m"] and error.max() < 0.3 * before.max()  # 4: of a normal distribution, practically all
    assert np.allclose(merged.poses()[1][: len(early)], poses[: len(early)])


def colmap_lines(path):
    return [line.split() for line in path.read_text().split("\n") if not line.startswith("#")]


def test_a_colmap_model_shows_points_on_edges(result, tmp_path):
    """Read by the rules of COLMAP's text format: https://colmap.github.io/format.html."""
    out = tmp_path / "desk_colmap"
    program("export", result[1], "--out", out)
    cameras = {row[0]: (row[1], *map(float, row[2:])) for row in colmap_lines(out / "sparse/0/cameras.txt") if row}
    points = {row[0]: row[1:] for row in colmap_lines(out / "sparse/0/points3D.txt") if row}
    rows = colmap_lines(out / "sparse/0/images.txt")[:-1]
    transforms = json.loads((out / "transforms.json").read_text())
    assert len(rows) == 2 * len(result[0].keyframes) == 2 * len(transforms["frames"]) and len(points) == len(result[0].points)
    tracks = {(row[7 + k], row[8 + k]): key for key, row in points.items() for k in range(0, len(row) - 7, 2)}
    near, all_points = 0, 0
    for frame, image, observed in zip(transforms["frames"], rows[::2], rows[1::2]):
        number, (w, x, y, z), t, (model, width, height, fx, fy, cx, cy) = image[0], map(float, image[1:5]), np.array(image[5:8], float), cameras[image[8]]
        assert model == "PINHOLE" and frame["file_path"] == "images/" + image[9] and frame["fl_x"] == fx
        R = np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                      [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                      [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])
        pose = np.array(frame["transform_matrix"]) @ np.diag([1, -1, -1, 1])  # T_world_camera
        assert np.allclose(np.linalg.inv(pose)[:3], np.c_[R, t])
        picture = plt.imread(out / "images" / image[9])
        assert picture.shape[:2] == (height, width)
        on_edge = np.pad((picture[..., :3] < 1).any(axis=2), 1)
        on_edge = np.any([on_edge[1 + dy : on_edge.shape[0] - 1 + dy, 1 + dx : on_edge.shape[1] - 1 + dx] for dy in (-1, 0, 1) for dx in (-1, 0, 1)], axis=0)
        for k in range(0, len(observed), 3):
            key = observed[k + 2]
            assert tracks[number, str(k // 3)] == key
            p = R @ np.array(points[key][:3], float) + t
            u, v = fx * p[0] / p[2] + cx, fy * p[1] / p[2] + cy
            assert np.hypot(u - float(observed[k]), v - float(observed[k + 1])) < 4  # a voxel of 1 cm at 0.6 m
            near += on_edge[min(int(v), int(height) - 1), min(int(u), int(width) - 1)]
            all_points += 1
    assert all_points > len(points) and near > 0.8 * all_points  # of all pixels, a quarter is as near


def test_a_session_has_a_page(result, tmp_path):
    shutil.copy(result[1] / "session.mcap", tmp_path / "live.mcap")
    for words in (("view", tmp_path / "live.mcap"), ("export", result[1], "--out", tmp_path / "page.html")):
        program(*words)
    for page in ("live.mcap.html", "page.html"):
        text = (tmp_path / page).read_text()
        report = json.loads(text.split('id="report-data" type="application/json">')[1].split("</script>")[0])
        assert report["keyframes"] == len(result[0].keyframes) and report["map_hash"] == result[0].hash
