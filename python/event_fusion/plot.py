# SPDX-License-Identifier: BSD-3-Clause
"""Figures of depth maps, maps and errors with matplotlib, in the colours of the program's pictures.

Each function draws into `ax`, or into a new figure, and returns its Axes: ``plot.depth(k).figure.savefig("depth.pdf")``.
Lines and text of a PDF or SVG are vectors; pixels and points of clouds are embedded as images.
"""

from __future__ import annotations

from typing import Any, Sequence, Union

import numpy as np

try:
    import matplotlib
    from matplotlib import pyplot
    from matplotlib.axes import Axes
    from matplotlib.colors import Colormap, FuncNorm, LinearSegmentedColormap, ListedColormap
except ImportError as missing:
    raise ImportError("event_fusion.plot needs matplotlib: apt install python3-matplotlib") from missing

from ._engine import Keyframe
from ._events import Array, Path
from ._mapping import Map, Mapper
from ._recording import Recording
from .evaluate import true_depth

__all__ = ["confidence", "depth", "error", "map", "precision_recall", "trajectory"]

_BLUE, _ORANGE, _GREEN = "#1f77b4", "#d95f02", "#1b9e77"
_DOTS_PER_INCH = 300  # of embedded images


def _palette(name: str, begin: float, end: float) -> Colormap:
    colours = matplotlib.colormaps[name](np.linspace(begin, end, 256))
    return ListedColormap(colours, name=f"event_fusion_{name}")


_DEPTH = _palette("plasma", 0.88, 0.0)  # near bright, far dark; readable in grey
_HEIGHT = _palette("turbo", 0.06, 0.96)
_ERROR = LinearSegmentedColormap.from_list("event_fusion_error", ["#2166ac", "#a0a0a0", "#b2182b"])


def _axes(ax: Axes | None) -> Axes:
    return pyplot.subplots(layout="constrained", dpi=_DOTS_PER_INCH / 2)[1] if ax is None else ax


def _image(ax: Axes, values: Array, label: str, ticks: Sequence[float] | None = None, **style: Any) -> Axes:
    """Draw an image with pixel (0, 0) at the top left, and its colour bar."""
    drawn = ax.imshow(values, interpolation="nearest", **style)
    ax.set_xticks([])
    ax.set_yticks([])
    bar = ax.figure.colorbar(drawn, ax=ax, label=label, fraction=0.04, pad=0.02)
    if ticks is not None:
        bar.set_ticks(ticks)
        bar.set_ticklabels([f"{tick:g}" for tick in ticks])
        bar.ax.minorticks_off()
    return ax


def _depths(value: Union[Keyframe, Array]) -> Array:
    image = np.asarray(value.depth if isinstance(value, Keyframe) else value, float)
    return np.where(np.isfinite(image) & (image > 0), image, np.nan)


def _round_depths(near: float, far: float) -> list[float]:
    """Return a few round depths whose inverses are spread over the range."""
    found: list[float] = []
    for inverse in np.linspace(1 / near, 1 / far, 6):
        digits = 1 - int(np.floor(np.log10(1 / inverse)))
        depth_m = float(np.round(1 / inverse, digits))
        if near <= depth_m <= far and depth_m not in found:
            found.append(depth_m)
    return found


def depth(
    keyframe: Union[Keyframe, Array], ax: Axes | None = None, *, limits: tuple[float, float] | None = None
) -> Axes:
    """Draw a depth map; colours are linear in inverse depth.

    Parameters
    ----------
    keyframe : Keyframe or array, shape (rows, columns)
        Metres; 0 and NaN mean no depth. Of a keyframe, the confidence is light grey under the depths.
    ax : matplotlib.axes.Axes
        By default of a new figure.
    limits : (float, float)
        Near and far end of the colours; by default the depths' 1 % and 99 %.
    """
    ax = _axes(ax)
    metres = _depths(keyframe)
    if limits is None:
        valid = metres[np.isfinite(metres)]
        near, far = np.percentile(valid, [1, 99]) if valid.size else (1.0, 2.0)
        limits = float(near), float(max(far, 1.001 * near))
    if isinstance(keyframe, Keyframe):
        grey = np.sqrt(np.maximum(keyframe.confidence, 0))
        ax.imshow(grey, cmap="Greys", vmin=0, vmax=4.25 * max(float(grey.max()), 1e-9), interpolation="nearest")
    norm = FuncNorm((lambda z: -1 / np.maximum(z, 1e-9), lambda i: -1 / np.minimum(i, -1e-9)), *limits)
    return _image(ax, metres, "depth [m]", _round_depths(*limits), cmap=_DEPTH, norm=norm)


def confidence(keyframe: Union[Keyframe, Array], ax: Axes | None = None) -> Axes:
    """Draw the confidence (ray density) of each pixel: white is 0, black the largest."""
    values = keyframe.confidence if isinstance(keyframe, Keyframe) else np.asarray(keyframe)
    return _image(_axes(ax), values, "confidence", cmap="Greys", vmin=0)


def error(
    keyframe: Union[Keyframe, Array],
    truth: Union[Array, Recording, Path],
    ax: Axes | None = None,
    *,
    largest: float = 0.2,
    tolerance_px: int = 0,
) -> Axes:
    """Draw the error of each depth as a fraction of the truth.

    Parameters
    ----------
    keyframe : Keyframe or array, shape (rows, columns)
        Metres.
    truth : array, shape (rows, columns); or Recording or path
        Metres; pixels without truth stay white. Of a recording, its true depth map at the keyframe's time.
    ax : matplotlib.axes.Axes
        By default of a new figure.
    largest : float
        End of the colours: 0.2 is 20 %. Blue: too near; grey: right; red: too far.
    tolerance_px : int
        The truth of a pixel is the nearest one within this number of columns and rows, as in `evaluate.depth`.

    Raises
    ------
    ValueError
        If the sizes differ.
    """
    if isinstance(keyframe, Keyframe) and not isinstance(truth, np.ndarray):
        truth = true_depth(truth, keyframe.t)
    metres, true = _depths(keyframe), _depths(truth)  # type: ignore[arg-type]
    if metres.shape != true.shape:
        raise ValueError(f"a depth map of shape {metres.shape} and a truth of shape {true.shape}: expected one shape")
    near = np.full_like(metres, np.nan)  # the best truth
    padded = np.pad(true, tolerance_px, constant_values=np.nan)
    rows, columns = metres.shape
    for y, x in np.ndindex(2 * tolerance_px + 1, 2 * tolerance_px + 1):
        shifted = padded[y : y + rows, x : x + columns]
        nearer = np.abs(1 / shifted - 1 / metres) < np.abs(1 / near - 1 / metres)
        near = np.where(nearer | np.isnan(near), shifted, near)
    percent = 100 * (metres - near) / near
    end = 100 * largest
    return _image(_axes(ax), percent, "depth error [%]", cmap=_ERROR, vmin=-end, vmax=end)


def precision_recall(errors: dict[str, Any], ax: Axes | None = None) -> Axes:
    """Draw what is within an error, what is found, and F1, over the error.

    Parameters
    ----------
    errors : dict
        Result of `evaluate.depth` (precision and recall) or of `evaluate.map` (accuracy and completeness).
    ax : matplotlib.axes.Axes
        By default of a new figure.
    """
    ax = _axes(ax)
    if not errors.get("curve"):
        raise ValueError("errors: expected the result of evaluate.depth or evaluate.map")
    steps = errors["curve"]
    of_depth = "threshold_m" in steps[0]
    metres = [step["threshold_m" if of_depth else "distance_m"] for step in steps]
    names = {"precision": "precision", "recall": "recall", "f1": "F1"}
    if not of_depth:
        names = {"within": "accuracy", "completeness": "completeness", "f1": "F1"}
    for (key, label), colour, marker in zip(names.items(), (_BLUE, _ORANGE, _GREEN), "os^"):
        ax.plot(metres, [100 * step[key] for step in steps], color=colour, marker=marker, markersize=3, label=label)
    ax.set(xscale="log", xlabel="error [m]" if of_depth else "distance [m]", ylabel="[%]", ylim=(0, 102))
    ax.grid(alpha=0.3)
    ax.legend(frameon=False)
    return ax


def _positions(value: Any) -> Array:
    if isinstance(value, Recording):
        value = value.poses
    elif isinstance(value, (Map, Mapper)):
        value = value.trajectory
    poses = np.asarray(value[1] if isinstance(value, tuple) else value, float)
    return poses[:, :3, 3]


def _plane_of(positions: Array) -> tuple[int, int]:
    """Return the two axes of the world without the one of the smallest extent."""
    smallest = int(np.argmin(np.ptp(positions, axis=0)))
    first, second = (axis for axis in range(3) if axis != smallest)
    return first, second


def trajectory(*paths: Any, labels: Sequence[str] = (), ax: Axes | None = None) -> Axes:
    """Draw positions along the axis of the world in which the first path's extent is smallest.

    Parameters
    ----------
    *paths : Recording, Map, Mapper, (times, poses), or array of shape (n, 4, 4)
        Drawn over each other.
    labels : sequence of str
        Names for the legend.
    ax : matplotlib.axes.Axes
        By default of a new figure.
    """
    if not paths:
        raise ValueError("trajectory: expected a path")
    ax = _axes(ax)
    all_positions = [_positions(path) for path in paths]
    first, second = _plane_of(all_positions[0])
    for number, positions in enumerate(all_positions):
        label = labels[number] if number < len(labels) else None
        style = "-" if len(positions) > 50 else "o-"
        ax.plot(positions[:, first], positions[:, second], style, markersize=3, label=label)
    ax.set(xlabel=f"{'xyz'[first]} [m]", ylabel=f"{'xyz'[second]} [m]")
    ax.set_aspect("equal", adjustable="datalim")
    ax.grid(alpha=0.3)
    if labels:
        ax.legend(frameon=False)
    return ax


def map(  # noqa: A001
    points: Union[Map, Mapper, Array], ax: Axes | None = None, *, up: Sequence[float] | None = None, size: float = 1.0
) -> Axes:
    """Draw a point cloud from above, coloured by height.

    Parameters
    ----------
    points : Map, Mapper, structured array with x, y, z, or array of shape (n, 3)
        Metres.
    ax : matplotlib.axes.Axes
        By default of a new figure.
    up : sequence of 3 float
        The upward direction of the world. By default that of the keyframes' images of a map, and z for arrays.
    size : float
        Size of a point in typographic points.
    """
    if up is None:
        up = -np.mean(points.trajectory[1][:, :3, 1], axis=0) if isinstance(points, (Map, Mapper)) else (0, 0, 1)
    cloud = points.points if isinstance(points, (Map, Mapper)) else np.asarray(points)
    if cloud.dtype.names is not None:
        cloud = np.stack([cloud[axis] for axis in "xyz"], axis=1)
    ax = _axes(ax)
    upward = np.asarray(up, float)
    upward = upward / np.linalg.norm(upward)
    # The axis of the world that is nearest to the right stays to the right.
    right = np.eye(3)[int(np.argmin(np.abs(upward[:2])))]
    right = right - right @ upward * upward
    right /= np.linalg.norm(right)
    across = np.cross(upward, right)
    height = cloud @ upward
    order = np.argsort(height)
    if len(cloud):
        lowest, highest = np.percentile(height, [1, 99])
    else:
        lowest, highest = 0.0, 1.0
    drawn = ax.scatter(
        (cloud @ right)[order],
        (cloud @ across)[order],
        c=height[order],
        s=size,
        marker=".",
        linewidths=0,
        cmap=_HEIGHT,
        vmin=lowest,
        vmax=highest,
        rasterized=True,
    )
    ax.figure.colorbar(drawn, ax=ax, label="height [m]", fraction=0.04, pad=0.02)
    ax.set(xlabel="[m]", ylabel="[m]")
    ax.set_aspect("equal", adjustable="datalim")
    ax.grid(alpha=0.3)
    return ax
