# SPDX-License-Identifier: BSD-3-Clause
"""Errors of depth maps, maps and trajectories against their truth, as ``event-fusion evaluate`` computes them.

Results are dictionaries with the keys that ``event-fusion evaluate depth --help`` (map, trajectory) explains. Lengths are
metres. A truth is a file or folder, a recording whose folder has the truth (simulated ones do), or arrays.
"""

from __future__ import annotations

import json
import os
import pathlib
import tempfile
from typing import Any, Iterable, Sequence, Union

import numpy as np

from . import _engine
from ._engine import Keyframe
from ._events import Array, Path
from ._mapping import Map, Mapper
from ._recording import Recording

__all__ = ["depth", "map", "trajectory", "true_depth"]


def _is_path(value: Any) -> bool:
    return isinstance(value, (str, os.PathLike))


def _recorded(value: Any) -> Any:
    """Return the folder of a recording, and anything else unchanged."""
    return value.files[0] if isinstance(value, Recording) else value


def _depth_file(value: Any, folder: pathlib.Path) -> str:
    """Return the path of depth maps; arrays and keyframes are written into a folder."""
    value = _recorded(value)
    if _is_path(value):
        return str(os.fspath(value))
    folder.mkdir()
    if isinstance(value, np.ndarray):
        np.save(folder / "depth.npy", value)
        return str(folder / "depth.npy")
    for i, one in enumerate([value] if isinstance(value, Keyframe) else value):
        if isinstance(one, Keyframe):
            np.save(folder / f"{one.t // 10**9}.{one.t % 10**9:09}.npy", one.depth)
        else:
            np.save(folder / f"{i}.npy", one)
    return str(folder)


def true_depth(truth: Union[Path, Recording], t: int) -> Array:
    """Return the true depth map (rows, columns) of a recording at a keyframe's time; metres, 0: no depth.

    Parameters
    ----------
    truth : Recording or path
        A recording whose folder has true depth maps, or a folder of depth maps.
    t : int
        Nanoseconds. The nearest map is at most 1 ms away.

    Raises
    ------
    OSError
        If there is no such map.
    """
    return _engine.true_depth(os.fspath(_recorded(truth)), t)


def depth(
    estimate: Union[Path, Map, Keyframe, Iterable[Keyframe], Array, Sequence[Array]],
    truth: Union[Path, Recording, Array, Sequence[Array]],
    *,
    tolerance_px: int = 0,
    max_depth: float | None = None,
    png_scale: float | None = None,
    mask: Path = "",
    thresholds: Sequence[float] = (),
    focal_baseline: float | None = None,
) -> dict[str, Any]:
    """Compare depth maps with the truth. Maps of a folder are paired by time, within 1 ms; arrays by their order.

    Parameters
    ----------
    estimate : path, Map, Keyframe, keyframes, array of shape (rows, columns), or arrays
        Metres; 0, negative values and NaN mean no depth.
    truth : path, Recording, array or arrays
        As the estimate.
    tolerance_px : int
        Compare with the best truth within this number of columns and rows, 0 to 100.
    max_depth : float
        Leave out truth beyond it.
    png_scale : float
        Of 16-bit PNG files: units per metre; below 1 metres per unit.
    mask : path
        An image: only pixels that are not black are compared.
    thresholds : sequence of float
        Errors for precision and recall.
    focal_baseline : float
        Focal length in pixels times baseline in metres of a stereo pair, for the errors of disparity (bad_pix). By
        default from the calibration beside the files.

    Returns
    -------
    dict
        maps (a dict each), mean and all: points, mean_abs_m, median_abs_m, beyond_tenth (fraction of the depths that
        are wrong by more than a tenth), bad_pix_3px, …; curve: threshold_m, precision, recall, f1; without_truth,
        without_estimate (numbers of maps).

    Raises
    ------
    OSError, ValueError
        If a file cannot be read; if sizes differ; if nothing can be compared.
    """
    if isinstance(estimate, np.ndarray) and isinstance(truth, np.ndarray) and estimate.shape != truth.shape:
        raise ValueError(f"an estimate of shape {estimate.shape} and a truth of shape {truth.shape}: expected one shape")
    with tempfile.TemporaryDirectory() as folder:
        estimated = _depth_file(estimate, pathlib.Path(folder, "estimate"))
        true = _depth_file(truth, pathlib.Path(folder, "truth"))
        errors: dict[str, Any] = json.loads(
            _engine.depth_errors(
                estimated, true, tolerance_px, max_depth, png_scale, os.fspath(mask), list(thresholds), focal_baseline
            )
        )
    return errors


def xyz_of(value: Union[Map, Mapper, Array]) -> Array:
    """Return the points of a map, of a structured array or of (n, 3) as (n, 3)."""
    points = np.asarray(value.points if isinstance(value, (Map, Mapper)) else value)
    if points.dtype.names is not None:
        points = np.stack([points[axis] for axis in "xyz"], axis=1)
    if points.ndim != 2 or points.shape[1] != 3:
        raise ValueError(f"points of shape {points.shape}: expected a map, (n, 3), or the fields x, y, z")
    return points


def _cloud_file(value: Any, file: pathlib.Path) -> str:
    """Return the path of a cloud; maps and arrays are written to a file."""
    value = _recorded(value)
    if _is_path(value):
        return str(os.fspath(value))
    points = xyz_of(value)
    properties = "".join(f"property double {axis}\n" for axis in "xyz")
    header = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n{properties}end_header\n"
    file.write_bytes(header.encode() + np.ascontiguousarray(points, "<f8").tobytes())
    return str(file)


def map(
    estimate: Union[Path, Map, Mapper, Array],
    truth: Union[Path, Recording, Map, Array],
    *,
    align: bool = False,
    to_find: Path = "",
    distances: Sequence[float] = (),
) -> dict[str, Any]:
    """Compare a point cloud with the true surfaces.

    Parameters
    ----------
    estimate : path, Map, Mapper, or array
        Points: (n, 3), or a structured array with x, y and z.
    truth : path, Recording, Map or array
        Points of the surfaces.
    align : bool
        Align the map with the truth first (ICP: rotation and translation).
    to_find : path
        The true points for completeness, if not all of the truth.
    distances : sequence of float
        Distances for completeness and outliers.

    Returns
    -------
    dict
        accuracy and completeness_distance (points, mean_m, median_m, rms_m, p90_m, max_m) and the curve: distance_m,
        within, outliers, completeness, f1.

    Raises
    ------
    OSError, ValueError
        If a file cannot be read, or a cloud has too few points.
    """
    with tempfile.TemporaryDirectory() as folder:
        estimated = _cloud_file(estimate, pathlib.Path(folder, "estimate.ply"))
        true = _cloud_file(truth, pathlib.Path(folder, "truth.ply"))
        errors: dict[str, Any] = json.loads(
            _engine.map_errors(estimated, true, align, os.fspath(to_find), list(distances))
        )
    return errors


def _pose_file(value: Any, file: pathlib.Path) -> str:
    value = _recorded(value)
    if _is_path(value):
        return str(os.fspath(value))
    times, poses = value.trajectory if isinstance(value, (Map, Mapper)) else value
    _engine.write_poses(str(file), times, poses)
    return str(file)


def trajectory(
    estimate: Union[Path, Map, Mapper, "tuple[Array, Array]"],
    truth: Union[Path, Recording, "tuple[Array, Array]"],
    *,
    alignment: str = "se3",
    max_difference: float = 0.01,
    pose_time_unit: str = "",
    truth_time_unit: str = "",
) -> dict[str, Any]:
    """Compare a trajectory with the truth: absolute and relative pose errors.

    Parameters
    ----------
    estimate : path, Map, Mapper, or (times, poses)
        A file that `open` reads as poses; or times (n,) in nanoseconds and matrices (n, 4, 4).
    truth : path, Recording, or (times, poses)
        As the estimate.
    alignment : {'se3', 'origin', 'none'}
        How the estimate is aligned with the truth.
    max_difference : float
        Maximum time between the two poses of a pair, seconds.
    pose_time_unit, truth_time_unit : {'', 's', 'ms', 'us', 'ns'}
        Unit of the times in the file of the estimate and of the truth, where it names none. Default: found.

    Returns
    -------
    dict
        pairs, alignment, ate (translation_m, rotation_deg) and rpe.

    Raises
    ------
    OSError, ValueError
        If a file cannot be read, or no poses are near enough in time.
    """
    with tempfile.TemporaryDirectory() as folder:
        estimated = _pose_file(estimate, pathlib.Path(folder, "estimate.txt"))
        true = _pose_file(truth, pathlib.Path(folder, "truth.txt"))
        errors: dict[str, Any] = json.loads(
            _engine.trajectory_errors(estimated, true, alignment, max_difference, pose_time_unit, truth_time_unit)
        )
    return errors
