#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes a dataset folder as text of other layouts, with numpy.

  write_text.py DATASET_FOLDER OUT

OUT/csv, gz, zip and minus are dataset folders:
  csv     camN/events.csv      x,y,polarity,timestamp_us below a header; polarity -1 and 1
  gz      camN/events.txt.gz   t x y p
  zip     camN/events.zip      t x y p
  minus   camN/events.txt      t x y p, polarity -1 and 1, below a first line `width height`
"""
import gzip
import pathlib
import shutil
import sys
import zipfile

import numpy as np

from dataset_folder import cameras_of, read_events, sensor_size


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
    text = source.read_bytes()
    for folder in ("gz", "zip"):
        (out / folder / name).mkdir(parents=True, exist_ok=True)
    with gzip.open(out / "gz" / name / "events.txt.gz", "wb", compresslevel=1) as file:
        file.write(text)
    with zipfile.ZipFile(out / "zip" / name / "events.zip", "w", zipfile.ZIP_DEFLATED, compresslevel=1) as file:
        file.writestr("events.txt", text)


def main():
    folder, out = map(pathlib.Path, sys.argv[1:3])
    size = sensor_size(folder)
    for source in cameras_of(folder):
        write_camera(source, source.parent.name, size, out)
    for name in ("csv", "gz", "zip", "minus"):
        for file in ("camchain.yaml", "poses.txt"):
            shutil.copy(folder / file, out / name / file)


main()
