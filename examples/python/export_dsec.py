#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Write a recording in DSEC's layout: export_dsec.py RECORDING OUT. OUT: a new folder with events/left/events.h5,
events/right/events.h5 (x, y, p, t in µs since t_offset, ms_to_idx), camchain.yaml and poses.txt. Debian: python3-h5py."""

import pathlib
import sys

import h5py
import numpy as np

import event_fusion as ef

if len(sys.argv) != 3:
    sys.exit(__doc__)
recording, out = ef.open(sys.argv[1]), pathlib.Path(sys.argv[2])
for camera, calibration in enumerate(recording.rig):
    folder = out / "events" / (("left", "right")[camera] if camera < 2 else f"cam{camera}")
    folder.mkdir(parents=True)
    with h5py.File(folder / "events.h5", "w") as file:
        types = {"x": "u2", "y": "u2", "p": "u1", "t": "u4"}
        lists = {key: file.create_dataset(f"events/{key}", (0,), types[key], maxshape=(None,), compression="gzip") for key in types}
        count, offset = 0, 0
        index: list[int] = []  # the first event of each millisecond
        for events in recording.events(camera):
            t = (events["t"] + calibration.time_offset_ns) // 1000
            offset = offset or int(t[0])
            if t[-1] - offset >= 2**32:
                sys.exit("over 71 minutes, which the layout cannot hold: export a part, with t0= and t1= of ef.open")
            index += list(count + np.searchsorted(t, offset + np.arange(1000 * len(index), t[-1] - offset + 1, 1000)))
            for key, values in {"x": events["x"], "y": events["y"], "p": events["p"], "t": t - offset}.items():
                lists[key].resize((count + len(t),))
                lists[key][count:] = values
            count += len(t)
        file["t_offset"], file["ms_to_idx"] = np.int64(offset), np.array(index, "u8")
if all(camera.K[0, 0] > 0 for camera in recording.rig):
    ef.write_cameras(out / "camchain.yaml", recording.rig)
if len(recording.poses[0]):
    ef.write_poses(out / "poses.txt", recording.poses)
