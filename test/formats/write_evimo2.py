#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes a dataset folder as EVIMO2 v2 has it, with numpy.

  write_evimo2.py DATASET_FOLDER OUT

OUT/left_camera/sfm/eval/scene_00, OUT/right_camera/… and, for further cameras, OUT/camera_2/…, each with
dataset_events_{t,xy,p}.npy, dataset_info.npz with the camera's K and D and a pickled `meta`, and
poses.txt of the rig, exported from there. The calibration of all cameras is the folder's: --calibration camchain.yaml.
"""
import pathlib
import sys

import numpy as np
import yaml

from dataset_folder import cameras_of, read_events

NAMES = ("left_camera", "right_camera")


def main():
    folder, out = map(pathlib.Path, sys.argv[1:3])
    chain = yaml.safe_load(open(folder / "camchain.yaml"))
    for index, source in enumerate(cameras_of(folder)):
        to = out / (NAMES[index] if index < 2 else f"camera_{index}") / "sfm" / "eval" / "scene_00"
        to.mkdir(parents=True, exist_ok=True)
        events = read_events(source)
        np.save(to / "dataset_events_t.npy", events["t"] * 1e-9)
        np.save(to / "dataset_events_xy.npy", np.stack([events["x"], events["y"]], axis=1))
        np.save(to / "dataset_events_p.npy", events["p"])
        camera = chain[f"cam{index}"]
        fx, fy, cx, cy = camera["intrinsics"]
        distortion = camera.get("distortion_coeffs") or [0, 0, 0, 0]
        np.savez(to / "dataset_info.npz", K=np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]], dtype="f8"),
                 D=np.array(distortion, dtype="f8"), meta=np.array({"frames": []}, dtype=object))
        (to / "poses.txt").write_text((folder / "poses.txt").read_text())


main()
