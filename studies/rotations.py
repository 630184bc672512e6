# SPDX-License-Identifier: BSD-3-Clause
"""Rotations by vectors."""

import numpy as np


def rotations(vectors):
    """Return the matrices (n, 3, 3) of rotation vectors (n, 3), in radians (Rodrigues' formula)."""
    angle = np.linalg.norm(vectors, axis=1)
    x, y, z = vectors.T / np.maximum(angle, 1e-12)
    cross = np.moveaxis(np.array([[0 * x, -z, y], [z, 0 * x, -x], [-y, x, 0 * x]]), -1, 0)
    angle = angle[:, None, None]
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
