#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes a dataset folder as NumPy arrays, with numpy.

  write_numpy.py DATASET_FOLDER OUT

OUT/NAME/camN.npy:
    metavision      a structured array x y p t, microseconds, as Metavision's
    metavision_ns   the same in nanoseconds, as event_fusion.events makes it
    fields          fields in another order, big-endian, with gaps between them and others beside them; seconds
"""
import pathlib
import sys

import numpy as np

from dataset_folder import cameras_of, read_events

METAVISION = [("x", "<u2"), ("y", "<u2"), ("p", "<i2"), ("t", "<i8")]
FIELDS = {"names": ["p", "id", "y", "t", "name", "x"],
          "formats": ["?", "(3,)<f4", ">u4", ">f8", "S5", ">f8"],
          "offsets": [1, 4, 16, 24, 33, 40], "itemsize": 50}


def main(folder, out):
    def save(name, camera, array):
        (out / name).mkdir(parents=True, exist_ok=True)
        np.save(out / name / f"cam{camera}.npy", array)

    for camera, file in enumerate(cameras_of(folder)):
        events = read_events(file)
        t, x, y, p = (events[name] for name in "txyp")
        for folder_name, times in (("metavision", t // 1000), ("metavision_ns", t)):
            structured = np.zeros(len(t), dtype=METAVISION)
            for name, values in (("x", x), ("y", y), ("p", p), ("t", times)):
                structured[name] = values
            save(folder_name, camera, structured)
        fields = np.zeros(len(t), dtype=np.dtype(FIELDS))
        for name, values in (("p", p), ("id", 9), ("y", y), ("t", t // 1000 / 1e6), ("name", "text"), ("x", x)):
            fields[name] = values
        save("fields", camera, fields)


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]))
