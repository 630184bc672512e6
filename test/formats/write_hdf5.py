#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes a dataset folder in the HDF5 layouts of public data sets, with h5py.

    write_hdf5.py DATASET_FOLDER OUT

Below OUT:
    dsec/        events/{left,right}/events.h5: Blosc with Zstandard
    tum_vie/     desk-events_{left,right}.h5: Blosc with Zstandard, another chunk size per column; mocap_data.txt
    m3ed/        desk_data.h5: both cameras and their calibration, LZF; desk_pose_gt.h5
    e2vid/       left.h5, right.h5: xs ys ts ps, times in seconds, not compressed
    mvsec/       desk_data.hdf5: both cameras, times in seconds, deflate; desk_gt.hdf5
    metavision/  left.h5, right.h5: compound values, not compressed

Needs Debian's python3-h5py and hdf5-filter-plugin-blosc-serial.
"""
import pathlib
import sys

import h5py
import numpy as np
import yaml

from dataset_folder import cameras_of, read_events, read_poses

BLOSC_ZSTD = dict(compression=32001, compression_opts=(0, 0, 0, 0, 1, 1, 5))
SIDES = ("left", "right")


def columns_of(events):
    """x, y, t (whole microseconds) and p of a camera."""
    return {"x": events["x"], "y": events["y"], "t": events["t"] // 1000, "p": events["p"].astype("u1")}


def matrices_of(poses):
    """Times in whole microseconds, rows tx ty tz qx qy qz qw, and 4x4 matrices T_world_cam0."""
    rows = np.array([numbers for _, numbers in poses]).reshape(-1, 7)
    x, y, z, w = (rows[:, 3:] / np.linalg.norm(rows[:, 3:], axis=1, keepdims=True)).T
    matrices = np.tile(np.eye(4), (len(rows), 1, 1))
    matrices[:, 0, :3] = np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)], 1)
    matrices[:, 1, :3] = np.stack([2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)], 1)
    matrices[:, 2, :3] = np.stack([2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)], 1)
    matrices[:, :3, 3] = rows[:, :3]
    return np.array([t_ns // 1000 for t_ns, _ in poses], dtype="i8"), matrices, rows


def index_of_milliseconds(t_us):
    return np.searchsorted(t_us, np.arange(t_us[-1] // 1000 + 1) * 1000).astype("u8")


def new_file(path):
    path.parent.mkdir(parents=True, exist_ok=True)
    return h5py.File(path, "w")


def write_dsec(path, events, time_type, chunks):
    with new_file(path) as file:
        offset = events["t"][0] - 137
        t = (events["t"] - offset).astype(time_type)
        for name, chunk in zip("xytp", chunks):
            values = t if name == "t" else events[name]
            file.create_dataset(f"events/{name}", data=values, chunks=chunk, maxshape=(None,), **BLOSC_ZSTD)
        file.create_dataset("ms_to_idx", data=index_of_milliseconds(t), **BLOSC_ZSTD)
        file["t_offset"] = offset


def write_m3ed(out, cameras, calibration, poses):
    with new_file(out / "desk_data.h5") as file:
        T_c0_ci = np.eye(4)
        for n, (side, events) in enumerate(zip(SIDES, cameras)):
            group = file.create_group(f"prophesee/{side}")
            for name, values in events.items():
                group.create_dataset(name, data=values, compression="lzf", maxshape=(None,))
            if events["t"][-1] < 10**10:  # M3ED's times begin at 0; current times would make a huge index
                group["ms_map_idx"] = index_of_milliseconds(events["t"])
            camera = calibration[f"cam{n}"]
            T_c0_ci = T_c0_ci @ np.linalg.inv(np.array(camera.get("T_cn_cnm1", np.eye(4)), dtype=float))
            group["calib/T_to_prophesee_left"] = T_c0_ci
            for key in ("camera_model", "distortion_coeffs", "distortion_model", "intrinsics", "resolution"):
                group[f"calib/{key}"] = camera[key]
    with new_file(out / "desk_pose_gt.h5") as file:
        file["ts"] = poses[0]
        file["Cn_T_C0"] = np.linalg.inv(poses[1])


def write_mvsec(out, cameras, poses):
    with new_file(out / "desk_data.hdf5") as file:
        for side, events in zip(SIDES, cameras):
            polarity = events["p"] * 2.0 - 1.0
            rows = np.stack([events["x"], events["y"], events["t"] / 1e6, polarity], axis=1)
            file.create_dataset(f"davis/{side}/events", data=rows, compression="gzip", compression_opts=1)
    with new_file(out / "desk_gt.hdf5") as file:
        file["davis/left/pose_ts"] = poses[0] / 1e6
        file["davis/left/pose"] = poses[1]


def write_e2vid(path, events):
    with new_file(path) as file:
        for name, values in (("xs", events["x"]), ("ys", events["y"]), ("ts", events["t"] / 1e6), ("ps", events["p"] == 1)):
            file[f"events/{name}"] = values


def write_metavision(path, events, resolution):
    rows = np.empty(len(events["t"]), dtype=[("x", "u2"), ("y", "u2"), ("p", "i2"), ("t", "i8")])
    for name, values in events.items():
        rows[name] = values
    with new_file(path) as file:
        file.attrs["geometry"] = f"{resolution[0]}x{resolution[1]}"
        file.create_dataset("CD/events", data=rows, chunks=(16384,), maxshape=(None,))


def main(folder, out):
    calibration = yaml.safe_load((folder / "camchain.yaml").read_text())
    cameras = [columns_of(read_events(file)) for file in cameras_of(folder)[:len(SIDES)]]
    poses = matrices_of(read_poses(folder))
    for n, (side, events) in enumerate(zip(SIDES, cameras)):
        write_dsec(out / "dsec/events" / side / "events.h5", events, "u4", [(65536,)] * 4)
        write_dsec(out / f"tum_vie/desk-events_{side}.h5", events, "i8", [(50000,), (50000,), (12500,), (100000,)])
        write_e2vid(out / f"e2vid/{side}.h5", events)
        write_metavision(out / f"metavision/{side}.h5", events, calibration[f"cam{n}"]["resolution"])
    write_m3ed(out / "m3ed", cameras, calibration, poses)
    write_mvsec(out / "mvsec", cameras, poses)
    with open(out / "tum_vie/mocap_data.txt", "w") as mocap:
        mocap.write("# timestamp[us] px py pz qx qy qz qw\n")
        for t_us, row in zip(poses[0], poses[2]):
            mocap.write(" ".join([str(t_us)] + [repr(float(value)) for value in row]) + "\n")


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]))
