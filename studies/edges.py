# SPDX-License-Identifier: BSD-3-Clause
"""The edges of a simulation in the view of a keyframe: their direction, and whether the second camera sees them."""

import numpy as np
from lab import local_contrast


def blurred(image):
    return image - local_contrast(image)


def gradient_angles(recording, keyframe):
    """Return the angle between each pixel's gradient and the horizontal, in degrees: 0 at a vertical edge.

    The image is the number of events of camera 0 at their true places.
    """
    first, last = np.searchsorted(recording.events[0]["t"], keyframe.window)
    to_view = np.linalg.inv(keyframe.pose)
    x, y, z = keyframe.K @ (to_view[:3, :3] @ recording.points[0][first:last].T + to_view[:3, 3:])
    rows, columns = keyframe.depth.shape
    limits = [[-0.5, rows - 0.5], [-0.5, columns - 0.5]]
    dy, dx = np.gradient(blurred(np.histogram2d(y / z, x / z, (rows, columns), limits)[0]))
    # The main axis of the structure tensor.
    return np.degrees(np.abs(np.arctan2(2 * blurred(dx * dy), blurred(dx**2) - blurred(dy**2)) / 2))


def seen_by_right(recording, keyframe, truth):
    """Return the pixels whose front surface, within a column, a parallel right camera sees."""
    pose = recording.simulation.poses([keyframe.t])[1][0] @ recording.cameras[1].T_rig_cam
    there = recording.simulation.depth(keyframe, pose)
    y, x = np.indices(truth.shape)
    z = np.min([truth, np.roll(truth, 1, 1), np.roll(truth, -1, 1)], axis=0).astype(float)
    disparity = np.divide(recording.focal_baseline, z, where=z > 0, out=np.full(z.shape, 2.0 * truth.shape[1]))
    seen = np.zeros(truth.shape, bool)
    for column in np.rint(x - disparity).astype(int) + [[[-1]], [[0]], [[1]]]:
        inside = (column >= 0) & (column < truth.shape[1])
        seen |= inside & (np.abs(there[y, np.where(inside, column, 0)] - z) < 0.02 * z)
    return seen
