# SPDX-License-Identifier: BSD-3-Clause
"""Figures of depth maps, maps and errors with matplotlib, in the colours of the program's pictures.

Each function draws into `ax`, or into a new figure, and returns its Axes: ``plot.depth(k).figure.savefig("depth.pdf")``.
Lines and text of a PDF or SVG are vectors; pixels and points of clouds are embedded as images. Own figures:
``plt.subplots(layout="constrained")`` leaves room for the labels; ``plt.rcParams["pdf.fonttype"] = 42`` embeds the fonts
that publishers ask for.
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
from .evaluate import true_depth, xyz_of

__all__ = ["confidence", "depth", "error", "map", "precision_recall", "trajectory"]

_BLUE, _ORANGE, _GREEN = "#1f77b4", "#d95f02", "#1b9e77"
_DOTS_PER_INCH = 300  # of embedded images


def __dir__() -> list[str]:
    return __all__


def _palette(name: str, begin: float, end: float) -> Colormap:
    colours = matplotlib.colormaps[name](np.linspace(begin, end, 256))
    return ListedColormap(colours, name=f"event_fusion_{name}")


_DEPTH = _palette("plasma", 0.88, 0.0)  # near bright, far dark; readable in grey
_HEIGHT = _palette("turbo", 0.06, 0.96)
_ERROR = LinearSegmentedColormap.from_list("event_fusion_error", ["#2166ac", "#a0a0a0", "#b2182b"])


def _axes(ax: Axes | None) -> Axes:
    return pyplot.subplots(layout="constrained", dpi=_DOTS_PER_INCH / 2)[1] if ax is None else ax


def _colour_bar(ax: Axes, drawn: Any, label: str, extend: str = "neither") -> Any:
    return ax.figure.colorbar(drawn, cax=ax.inset_axes([1.02, 0, 0.035, 1]), label=label, extend=extend)


def _image(
    ax: Axes, values: Array, label: str, ticks: Sequence[float] | None = None, extend: str = "neither", **style: Any
) -> Axes:
    """Draw an image with pixel (0, 0) at the top left, and its colour bar."""
    if not np.isfinite(values).any():
        ax.text(0.5, 0.5, "no depth", transform=ax.transAxes, ha="center", va="center")
    drawn = ax.imshow(values, interpolation="nearest", **style)
    ax.set_xticks([])
    ax.set_yticks([])
    bar = _colour_bar(ax, drawn, label, extend)
    if ticks is not None:
        bar.set_ticks(ticks)
        bar.set_ticklabels([f"{tick:.2g}" for tick in ticks])
        bar.ax.minorticks_off()
    return ax


def _depths(value: Union[Keyframe, Array]) -> Array:
    if not isinstance(value, (Keyframe, np.ndarray)):
        raise TypeError(f"{value!r}: expected a keyframe, such as map.keyframes[0], or an array of rows and columns")
    image = np.asarray(value.depth if isinstance(value, Keyframe) else value, float)
    return np.where(np.isfinite(image) & (image > 0), image, np.nan)


def _title(ax: Axes, value: Any) -> None:
    """Name a keyframe by its time."""
    if isinstance(value, Keyframe):
        ax.set_title(f"{value.t / 1e9:.3f} s", fontsize="medium")


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
        Near and far end of the colours; by default the depths' 2nd and 98th percentile. The same limits make figures comparable.

    Raises
    ------
    TypeError, ValueError
        If it is neither a keyframe nor an array, or the limits are not 0 < near < far.
    """
    ax = _axes(ax)
    metres = _depths(keyframe)
    if limits is None:
        valid = metres[np.isfinite(metres)]
        near, far = np.percentile(valid, [2, 98]) if valid.size else (1.0, 2.0)
        limits = float(near), float(max(far, 1.1 * near))
    if not 0 < limits[0] < limits[1]:
        raise ValueError(f"limits = {limits}: expected 0 < near < far, metres")
    _title(ax, keyframe)
    if isinstance(keyframe, Keyframe):
        grey = np.sqrt(np.maximum(keyframe.confidence, 0))
        ax.imshow(grey, cmap="Greys", vmin=0, vmax=4.25 * max(float(grey.max()), 1e-9), interpolation="nearest")
    norm = FuncNorm((lambda z: -1 / np.maximum(z, 1e-9), lambda i: -1 / np.minimum(i, -1e-9)), *limits)
    ticks = 1 / np.linspace(1 / limits[0], 1 / limits[1], 6)
    return _image(ax, metres, "depth [m]", list(ticks), cmap=_DEPTH, norm=norm)


def confidence(keyframe: Union[Keyframe, Array], ax: Axes | None = None) -> Axes:
    """Draw the confidence (ray density) of each pixel: white is 0, black the largest."""
    values = keyframe.confidence if isinstance(keyframe, Keyframe) else np.asarray(keyframe)
    ax = _axes(ax)
    _title(ax, keyframe)
    return _image(ax, values, "confidence", cmap="Greys", vmin=0)


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
    ax = _axes(ax)
    _title(ax, keyframe)
    return _image(ax, percent, "depth error [%]", extend="both", cmap=_ERROR, vmin=-end, vmax=end)


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
    if not paths or (labels and len(labels) != len(paths)):
        raise ValueError(f"{len(paths)} paths and {len(labels)} labels: expected a path, and a label for each or none")
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


def _direction(direction: Array) -> str:
    """Name a direction of the world: the axis that it is, or is near."""
    axis = int(np.argmax(np.abs(direction)))
    exact = abs(direction[axis]) > 0.999
    return f"{'' if exact else 'about '}{'-' if direction[axis] < 0 else ''}{'xyz'[axis]}"


def map(
    points: Union[Map, Mapper, Array],
    ax: Axes | None = None,
    *,
    up: Sequence[float] | None = None,
    size: float | None = None,
) -> Axes:
    """Draw a point cloud from above, coloured by height; of a map, the path of its keyframes, too.

    Parameters
    ----------
    points : Map, Mapper, structured array with x, y, z, or array of shape (n, 3)
        Metres.
    ax : matplotlib.axes.Axes
        By default of a new figure.
    up : sequence of 3 float
        The upward direction of the world. By default that of the keyframes' images of a map, and z for arrays.
    size : float
        Area of a point in square typographic points; by default by the number of points.
    """
    cloud = xyz_of(points)
    poses = points.trajectory[1] if isinstance(points, (Map, Mapper)) else np.empty((0, 4, 4))
    if up is None:
        up = -np.mean(poses[:, :3, 1], axis=0) if len(poses) else (0, 0, 1)
    ax = _axes(ax)
    upward = np.asarray(up, float)
    if upward.shape != (3,) or not np.linalg.norm(upward) > 0:
        raise ValueError(f"up = {up}: expected three numbers, not all 0")
    upward = upward / np.linalg.norm(upward)
    # The axis of the world that is nearest to the right stays to the right.
    right = np.eye(3)[int(np.argmin(np.abs(upward[:2])))]
    right = right - right @ upward * upward
    right /= np.linalg.norm(right)
    across = np.cross(upward, right)
    plan = np.stack([right, across], axis=1)
    flat, path = cloud @ plan, poses[:, :3, 3] @ plan
    height = cloud @ upward
    order = np.argsort(height)
    lowest, highest = np.percentile(height, [1, 99]) if len(cloud) else (0.0, 1.0)
    drawn = ax.scatter(
        *flat[order].T,
        c=height[order],
        s=np.clip(4e4 / max(len(cloud), 1), 1, 12) if size is None else size,
        marker=".",
        linewidths=0,
        cmap=_HEIGHT,
        vmin=lowest,
        vmax=highest,
        rasterized=True,
    )
    _colour_bar(ax, drawn, "height [m]")
    if len(path):
        ax.plot(*path.T, "-", color="black", linewidth=1, label="keyframes")
        ax.plot(*path[:1].T, "o", color="black", markersize=3)
        ax.legend(frameon=False, fontsize="small")
    if len(cloud):  # a few far points do not set the limits
        shown = np.concatenate([np.percentile(flat, [0.5, 99.5], axis=0), path])
        low, high = shown.min(axis=0), shown.max(axis=0)
        margin = 0.05 * (high - low) + 1e-3
        (left, bottom), (right_end, top) = low - margin, high + margin
        ax.set(xlim=(left, right_end), ylim=(bottom, top))
    else:
        ax.text(0.5, 0.5, "no points", transform=ax.transAxes, ha="center", va="center")
    names = [_direction(direction) for direction in (right, across)]
    ax.set(xlabel=f"{names[0]} [m]", ylabel=f"{names[1]} [m]")
    ax.set_aspect("equal", adjustable="datalim")
    ax.grid(alpha=0.3)
    return ax
