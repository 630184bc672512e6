# SPDX-License-Identifier: BSD-3-Clause
"""Rigs of equal cameras."""

import numpy as np

import event_fusion as ef


def rig_of(camera, *rights):
    """Return a camera once for each distance to the right, in metres."""
    poses = [np.eye(4) for _ in rights]
    for pose, right in zip(poses, rights):
        pose[0, 3] = right
    lens = camera.width, camera.height, camera.K, camera.distortion, camera.coefficients
    return [ef.Camera(*lens, pose) for pose in poses]
