# SPDX-License-Identifier: BSD-3-Clause
"""The quality of points: how many are wrong, how many visible edges have one, and whether their sigma is right."""

import numpy as np
from lab import best_truth, dilated


def visible_edges(recording, keyframe, truth):
    """Return the pixels that could have points: their surface points, seen from the view, fired in the window in each
    camera, and three times on average."""
    to_view, fired = np.linalg.inv(keyframe.pose), []
    for events, points in zip(recording.events, recording.points):
        first, last = np.searchsorted(events["t"], keyframe.window)
        seen = points[first:last] @ to_view[:3, :3].T + to_view[:3, 3]
        seen = seen[seen[:, 2] > 0]
        x, y = np.floor((seen @ keyframe.K.T / seen[:, 2:])[:, :2].T + 0.5).astype(int)
        inside = (x >= 0) & (y >= 0) & (x < truth.shape[1]) & (y < truth.shape[0])
        x, y, z = x[inside], y[inside], seen[inside, 2]
        visible = np.abs(truth[y, x] - z) < 0.03 * truth[y, x]
        count = np.zeros(truth.shape, int)
        np.add.at(count, (y[visible], x[visible]), 1)
        fired.append(count)
    return np.all(fired, axis=0) & (np.sum(fired, axis=0) >= 3 * len(fired))


def known_depths(depth, truth):
    """Return the pixels that have a depth and a truth within a pixel, their depths, and the nearest truths."""
    true = best_truth(depth, truth)
    known = (depth > 0) & np.isfinite(true)
    return known, depth[known].astype(float), true[known]


def quality(made, truths, edges, step, probability=None):
    """Return the quality of the points of all keyframes (above a probability): their number, and fractions."""
    error, planes, sigmas, found = [], [], [], 0
    for keyframe, truth, edge in zip(made, truths, edges):
        depth = np.where(keyframe.probability > probability, keyframe.depth, 0) if probability else keyframe.depth
        known, z, true = known_depths(depth, truth)
        error.append(np.abs(z - true) / true)
        planes.append(np.abs(1 / z - 1 / true) / step)
        sigmas.append(planes[-1] * step * z**2 / keyframe.sigma[known])
        right = np.zeros(truth.shape, bool)
        right[known] = error[-1] <= 0.1
        found += np.count_nonzero(edge & dilated(right))
    error, planes, sigmas = (np.concatenate(values) for values in (error, planes, sigmas))
    wrong, recall, near = np.mean(error > 0.1), found / np.count_nonzero(edges), planes <= 5
    return {"points": len(error), "wrong": wrong, "median": np.median(error), "beyond a plane": np.mean(planes > 1),
            "recall": recall, "F1": 2 * (1 - wrong) * recall / (1 - wrong + recall),
            "within σ": np.mean(sigmas[near] <= 1), "within 2 σ": np.mean(sigmas[near] <= 2)}  # fmt: skip


def at_number(curve, points):
    """Return the quality of a method at a number of points, interpolated between its thresholds."""
    numbers = [one["points"] for one in curve]
    return {key: np.interp(points, numbers, [one[key] for one in curve]) for key in curve[0]}
