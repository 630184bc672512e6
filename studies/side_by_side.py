# SPDX-License-Identifier: BSD-3-Clause
"""Methods side by side: a table of errors under several conditions, a grid of depth maps; the truth of points."""

import numpy as np
from lab import COLUMNS, best_truth
from matplotlib import pyplot
from pictures import bare

from event_fusion import plot


def table(page, conditions, columns, paper):
    """Write the errors of the same methods under several conditions: of each, the `columns` of lab.COLUMNS."""
    head, rows = [""], {name: [] for name in next(iter(conditions.values()))}
    for (condition, results), chosen in zip(conditions.items(), columns):
        page.numbers(condition, results)
        for title, key, scale, decimals in (COLUMNS[i] for i in chosen):
            head.append(f"{condition}: {title}")
            for name, row in rows.items():
                row.append(f"{scale * results[name].own[key]:.{decimals}f}" if name in results else "")
    page.table([*head, "paper"], [[name, *row, paper.get(name, "")] for name, row in rows.items()])


def depth_grid(rows, limits, width=2.4):
    """Draw rows of depth maps, each by its name, in the same colours."""
    lines, columns = next(iter(rows[0].values())).shape
    size = (width * len(rows[0]) + 0.7, (width * lines / columns + 0.3) * len(rows))
    figure, axes = pyplot.subplots(len(rows), len(rows[0]), figsize=size, layout="constrained", squeeze=False)
    for row, maps in zip(axes, rows):
        for ax, (name, depth) in zip(row, maps.items()):
            plot.depth(depth, ax=ax, limits=limits)
            if ax is row[-1]:
                ax.set_title(name, fontsize="small")
            else:
                bare(ax, name)
    return figure


def events_in(recording, windows):
    """Return the mean number of events of all cameras in a window."""
    counts = [np.diff(np.searchsorted(events["t"], window[:2])) for events in recording.events for window in windows]
    return np.sum(counts) / len(windows)


def richest(result):
    """Return the window in which a method has most points."""
    return int(np.argmax([np.count_nonzero(depth) for depth, _ in result.maps]))


def copies(depth, truth):
    """Return what MF copies to the four neighbours of the points, if each point had its true depth."""
    kept = (depth > 0) & (truth > 0)
    padded = np.pad(np.where(kept, np.nan_to_num(best_truth(depth, truth)), 0), 1)
    neighbours = padded[2:, 1:-1], padded[1:-1, 2:], padded[1:-1, :-2], padded[:-2, 1:-1]
    return [np.where(kept, 0, of_neighbour) for of_neighbour in neighbours]
