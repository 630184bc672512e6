# SPDX-License-Identifier: BSD-3-Clause
"""The studies of public data sets, on a simulated recording in the layouts of these sets."""

import argparse
import json
import os
import pathlib
import shutil
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from PIL import Image

import event_fusion as ef

h5py = pytest.importorskip("h5py")

ROOT = pathlib.Path(__file__).resolve().parents[2]
SOURCE = pathlib.Path(os.environ.get("EFM_SOURCE", ROOT))
STUDIES = pathlib.Path(os.environ.get("EFM_STUDIES", SOURCE / "studies" / "public"))
DESK = pathlib.Path(os.environ["EFM_RECORDINGS"]) / "desk_stereo"
sys.path[:0] = [str(STUDIES), str(SOURCE / "test" / "formats")]

import _study as study  # noqa: E402
import dsec as dsec_study  # noqa: E402
import write_hdf5  # noqa: E402
from dataset_folder import read_poses  # noqa: E402

DURATION = 0.4  # seconds of the cut recording


@pytest.fixture(scope="module")
def cut():
    """Return events of both cameras, poses, times and true depth maps of the begin of a simulated recording."""
    recording = ef.open(DESK)
    begin = int(next(recording.events(0, chunk=1))["t"][0]) // 1000 * 1000
    end = begin + int(DURATION * 1e9)
    part = ef.open(DESK, t0=begin, t1=end)
    cameras = []
    for camera in (0, 1):
        events = np.concatenate(list(part.events(camera)))
        cameras.append({"x": events["x"], "y": events["y"], "t": events["t"] // 1000, "p": events["p"].astype("u1")})
    poses = write_hdf5.matrices_of([pose for pose in read_poses(DESK) if begin - 10**7 <= pose[0] <= end + 10**7])
    times = [round(float(line.split()[0]) * 1e9) for line in open(DESK / "depth" / "index.txt")]
    times = [t for t in times if begin <= t <= end]
    return cameras, poses, np.array(times), np.stack([ef.evaluate.true_depth(DESK, t) for t in times])


@pytest.fixture(scope="module")
def mvsec(cut, tmp_path_factory):
    """Write the cut as a sequence of MVSEC."""
    cameras, poses, times, depths = cut
    folder = tmp_path_factory.mktemp("mvsec")
    write_hdf5.write_mvsec(folder, cameras, poses)
    with h5py.File(folder / "desk_gt.hdf5", "a") as file:
        file["davis/left/depth_image_raw_ts"] = times / 1e9
        file["davis/left/depth_image_raw"] = np.where(depths > 0, depths, np.nan)
    for part in ("data", "gt"):
        (folder / f"desk_{part}.hdf5").rename(folder / f"indoor_flying1_{part}.hdf5")
    shutil.copy(DESK / "camchain.yaml", folder / "camchain-imucam-indoor_flying.yaml")
    return folder


def run(script, *arguments):
    """Run a study and return its exit status, output and errors."""
    words = [sys.executable, str(STUDIES / script), *map(str, arguments)]
    done = subprocess.run(words, capture_output=True, text=True)
    return done.returncode, done.stdout, done.stderr


def values_of(text, row):
    """Return the numbers of a row of a Markdown table."""
    line = next(line for line in text.splitlines() if line.startswith(f"| {row} |"))
    return [float(cell) if cell.strip() != "–" else np.nan for cell in line.split("|")[2:-1]]


SHORT = ("--start", 0, "--stop", 0.35, "--windows", 2)


def compare(text, factors, sequence, recording, truth, windows, max_depth, rtol):
    """Compare the table with what `evaluate` says of maps of the simulated recording against its exact truth."""
    rows = study.methods_of({"H_c∘A_t (Alg. 1)": {}}, sequence, argparse.Namespace(method=None, options="both"))
    for row, options in rows.items():
        made = ef.map(recording, {**windows, **options, "checks.enabled": False})
        assert len(made.keyframes) == 2
        exact = ef.evaluate.depth(made, truth, max_depth=max_depth)["all"]
        expected = [exact[key] * factor for _, key, factor in factors]
        np.testing.assert_allclose(values_of(text, f"{row}, measured"), expected, rtol=rtol, atol=0.006)


def test_mvsec_table_is_that_of_evaluate(mvsec, cut, tmp_path):
    status, text, errors = run("mvsec.py", mvsec, "--sequence", "indoor_flying1", "--table", "functions",
        "--method", "H_c∘A_t", *SHORT, "--out", tmp_path)
    assert status == 0, errors
    assert (tmp_path / "table.md").read_text() + "\n" == text
    assert len(list((tmp_path / "pictures").glob("indoor_flying1_H_c_A_t_*.png"))) == 3
    assert values_of(text, "H_c∘A_t, paper") == [60.16, 25.45, 18.58, 6.61]
    first = int(cut[2][1]) - 50_000_000  # the first window whose reference has a true depth map
    recording = ef.open(DESK, t0=first, t1=first + 152_500_000)
    text = text.replace("| H_c∘A_t, m", "| H_c∘A_t (Alg. 1), m")
    factors = [study.columns("cm")[k] for k in (0, 1, 2, 9)]
    sequence = study.PaperSequence(0, 0, 1, 6.5, 14, 9)
    windows = {"keyframes.window_s": 0.1, "keyframes.stride_s": 0.05}
    compare(text, factors, sequence, recording, DESK, windows, 8.4, 1e-3)


SCALE = 8  # of the desk, as a street


@pytest.fixture(scope="module")
def dsec(cut, tmp_path_factory):
    """Write the cut as a sequence of DSEC, with poses of a LiDAR that looks along x."""
    cameras, (t_us, matrices, _), times, depths = cut
    root = tmp_path_factory.mktemp("dsec")
    folder, name = root / "zurich_city_04_a", "zurich_city_04_a"
    for side, events in zip(("left", "right"), cameras):
        write_hdf5.write_dsec(folder / f"{name}_events_{side}" / "events.h5", events, "u4", [(65536,)] * 4)
    f, cx, cy, baseline = 226.0, 173.0, 130.0, 0.1 * SCALE
    camera = {
        "camera_model": "pinhole", "camera_matrix": [f, f, cx, cy], "distortion_model": "radtan",
        "distortion_coeffs": [0.0] * 4, "resolution": [346, 260],
    }
    moved = np.eye(4)
    moved[0, 3] = -baseline
    T_lidar_cam = np.array([[0, 0, 1, 0.4], [-1, 0, 0, 0.2], [0, -1, 0, -0.2], [0, 0, 0, 1.0]])
    extrinsics = {"T_10": np.eye(4), "T_21": np.eye(4), "T_32": moved, "R_rect0": np.eye(3), "R_rect1": np.eye(3)}
    Q = np.array([[1, 0, 0, -cx], [0, 1, 0, -cy], [0, 0, 0, f], [0, 0, 1 / baseline, 0]])
    calibration = folder / f"{name}_calibration"
    calibration.mkdir()
    (calibration / "cam_to_cam.yaml").write_text(yaml.safe_dump({
        "intrinsics": {f"cam{k}": camera for k in range(4)},
        "extrinsics": {key: value.tolist() for key, value in extrinsics.items()},
        "disparity_to_depth": {"cams_03": Q.tolist()},
    }))
    (calibration / "cam_to_lidar.yaml").write_text(yaml.safe_dump({"T_lidar_camRect1": T_lidar_cam.tolist()}))
    matrices = matrices.copy()
    matrices[:, :3, 3] *= SCALE
    ef._engine.write_poses(str(folder / "lidar.txt"), t_us * 1000, matrices @ np.linalg.inv(T_lidar_cam))
    pictures = folder / f"{name}_disparity_event"
    pictures.mkdir()
    for k, depth in enumerate(depths):
        disparity = f * baseline / np.where(depth > 0, depth * SCALE, np.inf)
        Image.fromarray(np.rint(disparity * 256).astype("u2")).save(pictures / f"{2 * k:06}.png")
    np.savetxt(folder / f"{name}_disparity_timestamps.txt", times // 1000, fmt="%d")
    return root


def test_dsec_table_is_that_of_evaluate(dsec, cut, tmp_path):
    poses = ("--poses", dsec / "zurich_city_04_a" / "lidar.txt")
    status, text, errors = run("dsec.py", dsec, *poses, *SHORT, "--method", "H_c∘A_t (Alg. 1)", "--out", tmp_path)
    assert status == 0, errors
    assert values_of(text, "ESVO, paper")[:2] == [3.88, 1.56]
    truth = tmp_path / "truth"
    truth.mkdir()
    camchain = truth / "camchain.yaml"
    camchain.write_text((DESK / "camchain.yaml").read_text().replace("-0.10000000000000001", str(-0.1 * SCALE)))
    cameras_poses = ef.open(DESK).poses
    cameras_poses[1][:, :3, 3] *= SCALE
    ef._engine.write_poses(str(tmp_path / "poses.txt"), *cameras_poses)
    for t, depth in zip(cut[2], cut[3]):
        np.save(truth / f"{t // 10**9}.{t % 10**9:09}.npy", depth * SCALE)
    end = int(cut[2][4])  # of the first window
    limits = {"t0": end - 200_000_000, "t1": end + 105_000_000}
    recording = ef.open(DESK, poses=tmp_path / "poses.txt", calibration=camchain, **limits)
    windows = {"keyframes.window_s": 0.2, "keyframes.stride_s": 0.1, "keyframes.reference": "end"}
    sequence = study.PaperSequence(0, 0, 4, 200, 4, 5)
    compare(text, study.columns("m"), sequence, recording, truth, windows, 50, 0.01)


def test_disparities_of_a_turned_rectified_view_are_points_of_the_camera():
    f, cx, cy, b = 200.0, 50.0, 40.0, 0.6
    cosine, sine = np.cos(0.1), np.sin(0.1)
    R_rect_cam = np.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]])
    point = np.array([0.3, -0.2, 9.0])  # of the camera
    x, y, z = R_rect_cam @ point
    disparity = np.zeros((80, 100))
    u, v = round(f * x / z + cx), round(f * y / z + cy)
    disparity[v, u] = f * b / z
    Q = [[1, 0, 0, -cx], [0, 1, 0, -cy], [0, 0, 0, f], [0, 0, 1 / b, 0]]
    calibration = {"disparity_to_depth": {"cams_03": Q}, "extrinsics": {"R_rect0": R_rect_cam}}
    made = dsec_study.points_of(disparity, calibration)
    np.testing.assert_allclose(made, [point], atol=9.0 / f)


@pytest.mark.parametrize(
    "lens, coefficients",
    [("equidistant", [-0.048, 0.0113, -0.0554, 0.0215]), ("radtan", [-0.094, 0.194, 1e-4, 2e-3]), ("none", [])],
)
def test_rays_are_those_of_the_engine(lens, coefficients):
    """The ray of a pixel, bent by the lens, falls into the pixel."""
    camera = ef.Camera(346, 260, [[226, 0, 173], [0, 226, 130], [0, 0, 1]], lens, coefficients)
    ray = study.rays(camera)
    x, y = ray[..., 0], ray[..., 1]
    r = np.maximum(np.hypot(x, y), 1e-12)
    k = [*coefficients, 0, 0, 0, 0][:4]
    if lens == "equidistant":
        theta = np.arctan(r)
        bent = theta + sum(k[n] * theta ** (3 + 2 * n) for n in range(4))
        x, y = x / r * bent, y / r * bent
    else:
        radial, r2 = 1 + k[0] * r**2 + k[1] * r**4, r**2
        x, y = (
            x * radial + 2 * k[2] * x * y + k[3] * (r2 + 2 * x * x),
            y * radial + k[2] * (r2 + 2 * y * y) + 2 * k[3] * x * y,
        )
    v, u = np.mgrid[:260, :346]
    np.testing.assert_allclose(226 * x + 173, u, atol=0.01)
    np.testing.assert_allclose(226 * y + 130, v, atol=0.01)


def test_a_pose_between_two_poses_is_interpolated():
    turned = np.eye(4)
    turned[:2, :2] = [[np.cos(0.2), -np.sin(0.2)], [np.sin(0.2), np.cos(0.2)]]
    turned[:3, 3] = [1, 0, 0]
    poses = (np.array([100, 200]), np.stack([np.eye(4), turned]))
    made = study.pose_at(poses, 150)
    np.testing.assert_allclose(made[:2, :2], [[np.cos(0.1), -np.sin(0.1)], [np.sin(0.1), np.cos(0.1)]], atol=1e-12)
    np.testing.assert_allclose(made[:3, 3], [0.5, 0, 0])
    assert study.pose_at(poses, 99) is None and study.pose_at(poses, 201) is None


def test_the_poses_carry_true_depths_to_another_time(cut):
    """The true depth map of 50 ms before, carried to a view, is the view's own, but at the borders of objects."""
    _, (t_us, matrices, _), times, depths = cut
    camera = ef.open(DESK).rig[0]
    ray, poses = study.rays(camera), (t_us * 1000, matrices)
    truth = study.Truth(times[:4], lambda k: ray * depths[k][..., None], poses, 0.06)
    view = SimpleNamespace(t=int(times[4]), pose=study.pose_at(poses, int(times[4])), K=camera.K, depth=depths[4])
    carried = truth(view)
    seen = (carried > 0) & (depths[4] > 0)
    assert seen.mean() > 0.8
    assert (np.abs(carried / np.where(seen, depths[4], 1) - 1)[seen] < 0.01).mean() > 0.95
    view.t += 20_000_000
    assert truth(view) is None


def test_tumvie_has_pictures_and_counts(cut, tmp_path):
    cameras, (t_us, _, rows), _, _ = cut
    for side, events in zip(("left", "right"), cameras):
        write_hdf5.write_dsec(tmp_path / f"mocap-desk2-events_{side}.h5", events, "i8", [(65536,)] * 4)
    status, _, errors = run("tumvie.py", tmp_path, "--sequence", "mocap-desk2", "--out", tmp_path / "out")
    assert status == 1 and "camera-calibrationA.json is missing: download it from https://cvg.cit.tum.de/" in errors

    # Equidistant with the series of the tangent: a lens without distortion
    series = {"k1": 1 / 3, "k2": 2 / 15, "k3": 17 / 315, "k4": 62 / 2835}
    intrinsics = {"fx": 226, "fy": 226, "cx": 173, "cy": 130, **series}
    still = dict(zip(("px", "py", "pz", "qx", "qy", "qz", "qw"), (0.0, 0, 0, 0, 0, 0, 1)))
    (tmp_path / "camera-calibrationA.json").write_text(json.dumps({"value0": {
        "T_imu_cam": [{**still, "px": 0.1 * (k == 3)} for k in range(4)],
        "intrinsics": [{"camera_type": "kb4", "intrinsics": intrinsics}] * 4,
        "resolution": [[1024, 1024]] * 2 + [[346, 260]] * 2,
    }}))
    (tmp_path / "mocap-imu-calibrationA.json").write_text(json.dumps({"value0": {"T_imu_marker": still}}))
    (tmp_path / "mocap-desk2-vi_gt_data").mkdir()
    with open(tmp_path / "mocap-desk2-vi_gt_data" / "mocap_data.txt", "w") as mocap:
        mocap.write("# timestamp[us] px py pz qx qy qz qw\n")
        for t, row in zip(t_us, rows):
            mocap.write(" ".join([str(t), *map(repr, map(float, row))]) + "\n")
    short = ("--start", 0, "--stop", DURATION - 1e-3, "--window", 0.35)
    status, text, errors = run("tumvie.py", tmp_path, "--sequence", "mocap-desk2", *short, "--out", tmp_path / "out")
    assert status == 0, errors
    row = next(line for line in text.splitlines() if study.DEFAULT in line).split("|")
    assert int(row[2]) == 1 and int(row[3]) > 1000
    assert len(list((tmp_path / "out" / "pictures").glob("*.png"))) == 2


def test_rpg_has_pictures_and_counts(cut, tmp_path):
    pytest.importorskip("rosbag")
    import write_ros1_bag

    cameras, (t_us, matrices, _), _, _ = cut
    folder = tmp_path / "folder"
    for k, events in enumerate(cameras):
        (folder / f"cam{k}").mkdir(parents=True)
        columns = [events["t"] / 1e6, events["x"], events["y"], events["p"]]
        np.savetxt(folder / f"cam{k}" / "events.txt", np.stack(columns, 1), "%.6f %d %d %d")
    shutil.copy(DESK / "camchain.yaml", folder)
    ef._engine.write_poses(str(folder / "poses.txt"), t_us * 1000, matrices)
    write_ros1_bag.BAGS = write_ros1_bag.BAGS[:1]
    write_ros1_bag.main(folder, tmp_path)
    (tmp_path / "dvs.bag").rename(tmp_path / "reader.bag")
    shutil.copy(DESK / "camchain.yaml", tmp_path)
    (tmp_path / "hand_eye.yaml").write_text(yaml.safe_dump({"T_body_rig": np.eye(4).tolist()}))
    short = ("--start", 0, "--stop", 0.35, "--method", "A_t∘H_c")
    status, text, errors = run("rpg.py", tmp_path, "--sequence", "reader", *short, "--out", tmp_path / "out")
    assert status == 0, errors
    for row in ("A_t∘H_c", study.DEFAULT):
        assert f"| reader, {row} | 1 |" in text
    assert len(list((tmp_path / "out" / "pictures").glob("*.png"))) == 2


def damaged(folder, copy, name, change):
    """Copy a recording, and change one of its HDF5 files."""
    shutil.copytree(folder, copy)
    with h5py.File(copy / name, "a") as file:
        change(file)
    return copy


def late(key):
    def change(file):
        file[key][...] += 1000.0

    return change


def test_errors_of_mvsec_are_a_sentence(mvsec, tmp_path):
    gt = "indoor_flying1_gt.hdf5"
    no_gt, cut_gt = tmp_path / "no_gt", tmp_path / "cut_gt"
    shutil.copytree(mvsec, no_gt)
    (no_gt / gt).unlink()
    shutil.copytree(mvsec, cut_gt)
    os.truncate(cut_gt / gt, 300_000)
    truth = damaged(mvsec, tmp_path / "truth", gt, late("davis/left/depth_image_raw_ts"))
    poses = damaged(mvsec, tmp_path / "poses", gt, late("davis/left/pose_ts"))
    empty = damaged(mvsec, tmp_path / "empty", gt, lambda file: file.pop("davis/left/depth_image_raw"))
    one = ("--sequence", "indoor_flying1", "--method", "H_c∘A_t", "--start", 0, "--stop", 0.35)
    for folder, expected in (
        (tmp_path / "nothing", "nothing is missing: give the folder of the downloaded files"),
        (no_gt, f"{gt} is missing: download it from https://daniilidis-group.github.io/mvsec"),
        (cut_gt, gt),
        (truth, "are both of the same sequence?"),
        (poses, "poses"),
        (empty, "has no davis/left/depth_image_raw: it is not the whole file"),
    ):
        status, text, errors = run("mvsec.py", folder, *one, "--table", "functions", "--out", tmp_path / "out")
        print(errors)
        assert status == 1 and text == "" and "Traceback" not in errors
        assert errors.splitlines()[-1].startswith("mvsec.py: ") and expected in errors.splitlines()[-1]


def test_errors_of_dsec_are_a_sentence(dsec, tmp_path):
    folder = tmp_path / "zurich_city_04_a"
    shutil.copytree(dsec / "zurich_city_04_a", folder)
    status, _, errors = run("dsec.py", tmp_path, "--out", tmp_path / "out")
    assert status == 1 and "pose.bag is missing: LiDAR odometry is data/DSEC/" in errors
    next((folder / "zurich_city_04_a_disparity_event").glob("*.png")).unlink()
    status, _, errors = run("dsec.py", tmp_path, "--poses", folder / "lidar.txt", "--out", tmp_path / "out")
    assert status == 1 and "expected as many, of one sequence" in errors and "Traceback" not in errors


REAL = [path / "shared/data/real_small/mvsec_indoor_flying1_24s" for path in (SOURCE, SOURCE.parent)]


@pytest.mark.skipif(not any(path.exists() for path in REAL), reason="shared/data/real_small is not here")
def test_mvsec_reads_a_real_piece_of_flying1(tmp_path):
    """0.22 s of the left camera: its events' true depths make one depth map; the clock offset is a measured one."""
    piece = next(path for path in REAL if path.exists())
    t, x, y, p = np.loadtxt(piece / "events.txt").T
    poses = write_hdf5.matrices_of(read_poses(piece))
    true = np.load(f"{piece}_truth.npz")
    depth = np.full((260, 346), np.nan, "f4")
    depth[true["y"].astype(int), true["x"].astype(int)] = true["depth_m"]
    t += 0.055
    with h5py.File(tmp_path / "indoor_flying1_data.hdf5", "w") as file:
        file["davis/left/events"] = np.stack([x, y, t, 2 * p - 1], 1)
    with h5py.File(tmp_path / "indoor_flying1_gt.hdf5", "w") as file:
        file["davis/left/pose_ts"], file["davis/left/pose"] = poses[0] / 1e6, poses[1]
        file["davis/left/depth_image_raw_ts"], file["davis/left/depth_image_raw"] = [t.mean()], depth[None]
    status, text, errors = run(
        "mvsec.py", tmp_path, "--sequence", "indoor_flying1", "--calibration", piece / "calibration.yaml",
        "--table", "functions", "--method", "H_c∘A_t", "--start", 0, "--stop", 0.21, "--out", tmp_path / "out",
    )
    assert status == 0, errors
    print(text, errors)
    mean_cm, median_cm, bad_pix, points = values_of(text, "H_c∘A_t, measured")
    assert points > 0 and np.isnan(bad_pix) and median_cm < 200
