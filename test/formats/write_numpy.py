#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes a dataset folder as NumPy arrays, with numpy.

  write_numpy.py DATASET_FOLDER OUT

OUT/NAME/camN.npy or .npz; t in seconds (float64), except where it says otherwise:
    metavision   a structured array x y p t, microseconds, as Metavision's
    fields       fields in another order, big-endian, with gaps between them and others beside them; t_ns
    rows         N x 4: x y t p
    columns      N x 4 in Fortran order: t x y p
    lying        4 x N: p t x y
    transposed   4 x N in Fortran order: t x y p
    stored       .npz: t x y p, not compressed
    deflated     .npz: xs ys ps (bool) timestamps_us, and an array of text, compressed
    named        .npz: a b c d = t x y p, compressed
    packed       .npz: the array of `columns`, compressed
"""
import pathlib
import sys

import numpy as np

from dataset_folder import cameras_of, read_events

METAVISION = [("x", "<u2"), ("y", "<u2"), ("p", "<i2"), ("t", "<i8")]
FIELDS = {"names": ["polarity", "id", "row", "t_ns", "name", "col"],
          "formats": ["?", "(3,)<f4", ">u4", ">i8", "S5", ">f8"],
          "offsets": [1, 4, 16, 24, 33, 40], "itemsize": 50}


def main(folder, out):
    def save(name, camera, array):
        (out / name).mkdir(parents=True, exist_ok=True)
        np.save(out / name / f"cam{camera}.npy", array)

    def archive(name, camera, writer=np.savez_compressed, **arrays):
        (out / name).mkdir(parents=True, exist_ok=True)
        writer(out / name / f"cam{camera}.npz", **arrays)

    for camera, file in enumerate(cameras_of(folder)):
        events = read_events(file)
        t, x, y, p = (events[name] for name in "txyp")
        t_us = t // 1000
        t_s = t_us / 1e6
        structured = np.zeros(len(t), dtype=METAVISION)
        for name, values in (("x", x), ("y", y), ("p", p), ("t", t_us)):
            structured[name] = values
        save("metavision", camera, structured)
        fields = np.zeros(len(t), dtype=np.dtype(FIELDS))
        for name, values in (("polarity", p), ("id", 9), ("row", y), ("t_ns", t), ("name", "text"), ("col", x)):
            fields[name] = values
        save("fields", camera, fields)
        columns = np.stack([t_s, x, y, p])
        save("rows", camera, np.stack([x, y, t_s, p], axis=1))
        save("columns", camera, columns.T)
        save("lying", camera, np.stack([p, t_s, x, y]))
        save("transposed", camera, np.ascontiguousarray(columns.T).T)
        archive("stored", camera, np.savez, t=t_s, x=x, y=y, p=p)
        archive("deflated", camera, xs=x, notes=np.array(["a", "b"]), ys=y[:, None], ps=p == 1, timestamps_us=t_us)
        archive("named", camera, a=t_s, b=x, c=y, d=p)
        archive("packed", camera, events=columns.T)


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]))
