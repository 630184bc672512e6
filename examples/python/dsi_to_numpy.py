#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The DSI of a window as an array: dsi_to_numpy.py RECORDING T0 T1 (seconds; "+0.2" counts from the first event)."""

import sys

import numpy as np

import event_fusion as ef

if len(sys.argv) < 4:
    sys.exit(__doc__)
dsi = ef.dsi(ef.open(sys.argv[1]), sys.argv[2], sys.argv[3])
values, depths = dsi  # (planes, rows, columns), (planes,)
print("rays per voxel up to", values.max(), "; planes from", depths[0], "to", depths[-1], "m")

# The depth of a pixel is near the plane with the most rays: those of its neighbours are summed.
rows, columns = np.nonzero(dsi.keyframe.depth)
best = np.argmax(values[:, rows, columns], axis=0)
plane = np.interp(dsi.keyframe.depth[rows, columns], depths, np.arange(len(depths)))
print(len(rows), "pixels have a depth;", f"{np.mean(np.abs(plane - best) <= 3):.1%} within three planes of the best one")
np.savez_compressed("dsi.npz", values=values, depths=depths, K=dsi.keyframe.K, T_world_ref=dsi.keyframe.pose)
