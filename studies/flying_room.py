# SPDX-License-Identifier: BSD-3-Clause
"""What the studies of the sensor share: a room in the place of the paper's scene flying_room, and a figure."""

import numpy as np
from lab import ONE_CAMERA, PAPER, between, pick, recorded
from matplotlib import pyplot
from pictures import curves
from precision import draw_precision
from rigs import rig_of

import event_fusion as ef

NEAR, FAR = 1, 4  # metres
TWO = {**PAPER, **between(NEAR, FAR)}
METHODS = {"one camera": {**TWO, **ONE_CAMERA}, "two cameras": TWO}


def flying_room(width, threshold=0.2):
    """Simulate the room and the motion of hd_stereo: two ideal cameras, 0.20 m apart, 77° wide, 4:3."""
    height = width * 3 // 4
    # The image is from -0.5 to width - 0.5: the field of view is the same at every size.
    K = np.array([[0.625 * width, 0, (width - 1) / 2], [0, 0.625 * width, (height - 1) / 2], [0, 0, 1]])
    cameras, preset = rig_of(ef.Camera(width, height, K), 0, 0.20), pick("hd_stereo", "slider")
    return recorded(preset, calibration=cameras, threshold=threshold, duration=pick(0.4, 0.05))


def draw_errors(x, results, precisions, xlabel, xscale="linear"):
    """Draw mean and median error of methods over x, and precision and recall over the allowed error."""
    errors = {
        f"{method}, {what}": [100 * one.own[f"{what}_abs_m"] for one in over_x.values()]
        for method, over_x in results.items()
        for what in ("mean", "median")
    }
    figure, axes = pyplot.subplots(1, 3, figsize=(9, 3), layout="constrained")
    curves(axes[0], x, errors, xlabel, "error [cm]", xscale=xscale)
    axes[0].set_ylim(0, 1.6 * max(map(max, errors.values())))  # room for the legend
    axes[0].set_xticks(x, map(str, x))
    axes[0].minorticks_off()
    draw_precision(axes[1:], precisions)
    return figure
