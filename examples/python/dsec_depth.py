#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Depth maps of a sequence of DSEC, or of any recording: dsec_depth.py SEQUENCE POSES OUT. POSES: text, or "" if the
recording has them. OUT gets a float32 array and a picture per keyframe."""

import pathlib
import sys

import matplotlib.pyplot as plt
import numpy as np

import event_fusion as ef
from event_fusion import plot

if len(sys.argv) < 4:
    sys.exit(__doc__)
sequence, poses, out = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
out.mkdir(parents=True, exist_ok=True)
recording = ef.open(sequence, poses=poses)
made = ef.map(recording, {"dsi.max_depth_m": "auto"}, keep=False, progress=True)  # memory does not grow
for keyframe in made:
    np.save(out / f"{keyframe.t}.npy", keyframe.depth)  # metres, 0: no depth
    axes = plot.depth(keyframe)
    axes.figure.savefig(out / f"{keyframe.t}.png", bbox_inches="tight")
    plt.close(axes.figure)
print(made.report["keyframes"], "depth maps,", len(made.points), "points;", made.quality["word"], *made.quality["reasons"])
