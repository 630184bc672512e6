#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes a dataset folder as text of other layouts, with numpy.

  write_text.py DATASET_FOLDER OUT

OUT/csv, gz, zip, minus and us are dataset folders:
  csv     camN/events.csv      x,y,polarity,timestamp_us below a header; polarity -1 and 1
  gz      camN/events.txt.gz   t x y p
  zip     camN/events.zip      t x y p
  minus   camN/events.txt      t x y p, polarity -1 and 1, below a first line `width height`
  us      camN/events.txt      x y p t, t in whole microseconds: --event-columns "x y p t" --time-unit us
The poses of all are OUT/poses_*: EuRoC's CSV, TUM-VIE's mocap_data.txt, NumPy arrays.
"""
import gzip
import pathlib
import shutil
import sys
import zipfile

import numpy as np

from dataset_folder import cameras_of, read_events, read_poses, sensor_size


def write_columns(file, columns, separator, header=""):
    lines = columns[0].astype(str)
    for column in columns[1:]:
        lines = np.char.add(np.char.add(lines, separator), column.astype(str))
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(header + "\n".join(lines.tolist()) + ("\n" if len(lines) else ""))


def write_camera(source, name, size, out):
    events = read_events(source)
    x, y, t_us = events["x"], events["y"], events["t"] // 1000
    signed = events["p"].astype("i2") * 2 - 1
    seconds = np.array([b"%d.%06d" % divmod(int(t), 1_000_000) for t in t_us]).astype(str)
    write_columns(out / "csv" / name / "events.csv", [x, y, signed, t_us], ",", "x,y,polarity,timestamp_us\n")
    write_columns(out / "minus" / name / "events.txt", [seconds, x, y, signed], " ", "%d %d\n" % tuple(size))
    write_columns(out / "us" / name / "events.txt", [x, y, events["p"], t_us], " ")
    text = source.read_bytes()
    for folder in ("gz", "zip"):
        (out / folder / name).mkdir(parents=True, exist_ok=True)
    with gzip.open(out / "gz" / name / "events.txt.gz", "wb", compresslevel=1) as file:
        file.write(text)
    with zipfile.ZipFile(out / "zip" / name / "events.zip", "w", zipfile.ZIP_DEFLATED, compresslevel=1) as file:
        file.writestr("events.txt", text)


def write_poses(folder, out):
    poses = read_poses(folder)
    with open(out / "poses_euroc.csv", "w") as file:
        file.write("#timestamp [ns], p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z []\n")
        for t_ns, (x, y, z, qx, qy, qz, qw) in poses:
            file.write(",".join([str(t_ns)] + [repr(v) for v in (x, y, z, qw, qx, qy, qz)]) + "\n")
    with open(out / "poses_mocap_data.txt", "w") as file:
        file.write("# timestamp[us] px py pz qx qy qz qw\n")
        for t_ns, pose in poses:
            file.write("%d.%03d " % divmod(t_ns, 1000) + " ".join(map(repr, pose)) + "\n")
    times = np.array([t_ns for t_ns, _ in poses], dtype="i8")
    vectors = np.array([pose for _, pose in poses])
    np.savez(out / "poses.npz", t_ns=times, poses=vectors)


def main():
    folder, out = map(pathlib.Path, sys.argv[1:3])
    size = sensor_size(folder)
    for source in cameras_of(folder):
        write_camera(source, source.parent.name, size, out)
    for name in ("csv", "gz", "zip", "minus", "us"):
        for file in ("camchain.yaml", "poses.txt"):
            shutil.copy(folder / file, out / name / file)
    write_poses(folder, out)


main()
