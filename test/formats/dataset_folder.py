# SPDX-License-Identifier: BSD-3-Clause
"""Reads a dataset folder as event-fusion writes it, with numpy: for the scripts that write other formats."""
import pathlib

import numpy as np


def cameras_of(folder):
    return sorted(pathlib.Path(folder).glob("cam[0-9]/events.txt"))


def read_events(file):
    """A structured array t (ns), x, y, p."""
    numbers = np.fromfile(file, sep=" ").reshape(-1, 4)
    events = np.zeros(len(numbers), dtype=[("t", "i8"), ("x", "u2"), ("y", "u2"), ("p", "u1")])
    events["t"] = np.rint(numbers[:, 0] * 1e6).astype("i8") * 1000
    for column, name in ((1, "x"), (2, "y"), (3, "p")):
        events[name] = numbers[:, column].astype(events.dtype[name])
    return events


def read_poses(folder):
    """Pairs of a time in ns, which passes through no float, and seven numbers tx ty tz qx qy qz qw."""
    poses = []
    for line in open(pathlib.Path(folder) / "poses.txt"):
        fields = line.split()
        if not fields or fields[0].startswith("#"):
            continue
        seconds, _, decimals = fields[0].partition(".")
        poses.append((int(seconds) * 10**9 + int(decimals.ljust(9, "0")), [float(field) for field in fields[1:]]))
    return poses


def sensor_size(folder):
    import yaml

    return yaml.safe_load(open(pathlib.Path(folder) / "camchain.yaml"))["cam0"]["resolution"]
