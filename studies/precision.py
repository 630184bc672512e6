# SPDX-License-Identifier: BSD-3-Clause
"""Precision and recall of depth maps over the allowed error."""

from pictures import curves

import event_fusion as ef

LIMITS = (0.01, 0.02, 0.03, 0.04, 0.06, 0.08, 0.12, 0.16, 0.25, 0.4, 0.6, 1)  # allowed errors, metres


def precision(result, truths):
    """Return for each limit the fractions of the points of a method, and of all pixels of the truth, within it."""
    depths = [depth for depth, _ in result.maps]
    return ef.evaluate.depth(depths, list(truths), tolerance_px=1, thresholds=LIMITS)["curve"]


def percents(curve, key):
    """Return precision, recall or f1 over the limits, in percent."""
    return [100 * step[key] for step in curve]


def percent_at(precisions, key, limit):
    """Return precision, recall or f1 of each method within a limit, in percent."""
    return [percents(curve, key)[LIMITS.index(limit)] for curve in precisions.values()]


def draw_precision(axes, precisions):
    """Draw precision, recall and, into a third of the axes, F1 of methods over the allowed error; one legend."""
    for ax, key in zip(axes, ("precision", "recall", "f1")):
        over_limit = {name: percents(curve, key) for name, curve in precisions.items()}
        curves(ax, LIMITS, over_limit, "allowed error [m]", f"{key.replace('f1', 'F1')} [%]", xscale="log")
        ax.get_legend().remove()
    axes[-1].legend(loc="center left", bbox_to_anchor=(1, 0.5), frameon=False, fontsize="small")
