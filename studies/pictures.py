# SPDX-License-Identifier: BSD-3-Clause
"""Figures that several studies draw."""

import matplotlib
import numpy as np

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402

from event_fusion import plot  # noqa: E402


def curves(ax, x, series, xlabel, ylabel, xscale="linear", yscale="linear"):
    """Draw lines with markers: `series` has the values over `x` by name."""
    for name, values in series.items():
        ax.plot(x, values, "o-", markersize=3, label=name)
    ax.set(xlabel=xlabel, ylabel=ylabel, xscale=xscale, yscale=yscale)
    if yscale == "linear":
        ax.set_ylim(bottom=0)
    ax.grid(alpha=0.3)
    ax.legend(frameon=False, fontsize="small")


def bold(depth):
    """Return depths whose points are 3 pixels wide: thin edges stay visible on a page."""
    padded = np.pad(np.where(depth > 0, depth, np.inf), 1, constant_values=np.inf)
    nearest = np.min([padded[2:, 1:-1], padded[:-2, 1:-1], padded[1:-1, 2:], padded[1:-1, :-2]], axis=0)
    return np.where(depth > 0, depth, np.where(np.isfinite(nearest), nearest, 0))


def bare(ax, title=""):
    """Leave the image alone, with a title."""
    for child in list(ax.child_axes):
        child.remove()
    ax.set(xticks=[], yticks=[], xlabel="", ylabel="")
    ax.set_title(title, fontsize="small")


def depth_and_confidence(maps, width=2.4, limits=None):
    """Draw the depth maps above the confidence maps, a column for each (depth, confidence), by name."""
    rows, columns = next(iter(maps.values()))[0].shape
    size = (width * len(maps), 2 * width * rows / columns + 0.4)
    figure, axes = pyplot.subplots(2, len(maps), figsize=size, layout="constrained", squeeze=False)
    if limits is None:
        seen = np.concatenate([depth[depth > 0] for depth, _ in maps.values()])
        limits = tuple(np.percentile(seen, [1, 99])) if len(seen) else None
    for (upper, lower), (name, (depth, confidence)) in zip(axes.T, maps.items()):
        plot.depth(bold(depth), ax=upper, limits=limits)
        bare(upper, name)
        plot.confidence(confidence, ax=lower)
        bare(lower)
    return figure
