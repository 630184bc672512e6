# SPDX-License-Identifier: BSD-3-Clause
"""Depth maps and point clouds from event cameras with known poses.

Times are integer nanoseconds, lengths metres. `T_a_b` maps coordinates of frame b to frame a. Frames: `world`; `rig`, the
common frame of the cameras; `cam` and a keyframe's view: x right, y down, z forward. Options have the names of the .ini
files: ``{"dsi.max_depth_m": 8}``. Errors of data and files are OSError, wrong arguments ValueError.

>>> import event_fusion as ef
>>> ef.EVENT_DTYPE.names
('x', 'y', 'p', 't')
"""

from __future__ import annotations

import os
from functools import cached_property
from typing import Any, Callable, Iterator, Mapping, Sequence, Union

import numpy as np

from . import _engine
from ._engine import EVENT_DTYPE, Camera, Keyframe

__all__ = ["EVENT_DTYPE", "Camera", "Keyframe", "Map", "Mapper", "Recording", "events", "map", "open"]

Path = Union[str, "os.PathLike[str]"]
Options = Mapping[str, Any]

_NS_PER = {"s": 1_000_000_000, "ms": 1_000_000, "us": 1_000, "ns": 1}


def events(x: Any, y: Any, p: Any, t: Any, time_unit: str = "ns") -> np.ndarray:
    """Make an event array of four columns.

    Parameters
    ----------
    x, y : array_like of int, shape (n,)
        Pixels, from 0.
    p : array_like, shape (n,)
        Polarity: above 0, or True, if the pixel became brighter.
    t : array_like, shape (n,)
        Times. Integers keep all digits.
    time_unit : {'ns', 'us', 'ms', 's'}
        Unit of `t`.

    Returns
    -------
    numpy.ndarray
        Of dtype `EVENT_DTYPE`; its times are nanoseconds.

    Raises
    ------
    ValueError
        If the lengths differ, a pixel is not in 0 to 65535, or the unit is unknown.

    Examples
    --------
    >>> events([3], [4], [1], [2.5], time_unit="us")["t"]
    array([2500])
    """
    if time_unit not in _NS_PER:
        raise ValueError(f"time_unit = {time_unit!r}: expected one of {', '.join(_NS_PER)}")
    columns = [np.asarray(column) for column in (x, y, p, t)]
    if len({column.shape for column in columns}) != 1 or columns[0].ndim != 1:
        shapes = ", ".join(str(column.shape) for column in columns)
        raise ValueError(f"x, y, p, t have the shapes {shapes}: expected four columns of one length")
    made = np.empty(len(columns[0]), EVENT_DTYPE)
    for name, column in zip("xy", columns):
        wrong = np.flatnonzero(~((column >= 0) & (column <= 65535) & (column == np.floor(column))))
        if wrong.size:
            raise ValueError(f"{name}[{wrong[0]}] = {column[wrong[0]]}: expected a whole number from 0 to 65535")
        made[name] = column
    made["p"] = columns[2] > 0
    times = columns[3]
    if times.dtype.kind == "f":
        if not np.all(np.isfinite(times)):
            raise ValueError("t: expected finite times")
        made["t"] = np.rint(times * _NS_PER[time_unit])
    else:
        made["t"] = times.astype(np.int64) * _NS_PER[time_unit]
    return made


def _event_records(array: np.ndarray, time_unit: str) -> np.ndarray:
    """Return an array of events as `EVENT_DTYPE`: the same array if it has this layout."""
    array = np.asarray(array)
    names = array.dtype.names or ()
    if time_unit == "ns" and array.dtype == EVENT_DTYPE:
        return array
    time = next((name for name in ("t", "ts", "timestamp") if name in names), None)
    polarity = next((name for name in ("p", "polarity") if name in names), None)
    if time is None or polarity is None or "x" not in names or "y" not in names:
        raise TypeError(f"events of {array.dtype}: expected a structured array with the fields x, y, p, t")
    return events(array["x"], array["y"], array[polarity], array[time], time_unit)


def _engine_options(options: Options | None) -> _engine.Options:
    made = _engine.Options()
    for key, value in (options or {}).items():
        text = str(value).lower() if isinstance(value, (bool, np.bool_)) else str(value)
        made.set(key, text)
    return made


class Recording:
    """Events and poses of one recording, in any format that the program ``event-fusion`` reads. See `open`."""

    def __init__(self, files: Sequence[Path], overrides: _engine.Overrides) -> None:
        self._files = [os.fspath(file) for file in files]
        self._overrides = overrides
        #: The cameras, list of `Camera`.
        self.rig: list[Camera] = _engine.read_rig(self._files, overrides)

    def events(self, camera: int = 0, chunk: int = 1_000_000) -> Iterator[np.ndarray]:
        """Read the events of a camera in the order of time.

        Parameters
        ----------
        camera : int
            Index in `rig`.
        chunk : int
            Maximum number of events of an array. Memory does not grow with the recording.

        Yields
        ------
        numpy.ndarray, shape (n,), dtype EVENT_DTYPE

        Raises
        ------
        OSError
            At damage, after the events before it. It names file, place, value and what was expected.
        ValueError
            If there is no such camera, or `chunk` is below 1.
        """
        if not 0 <= camera < len(self.rig):
            raise ValueError(f"camera = {camera}: expected a camera of the recording: 0 to {len(self.rig) - 1}")
        if chunk < 1:
            raise ValueError(f"chunk = {chunk}: expected 1 or above")
        return self._read(camera, chunk)

    def _read(self, camera: int, chunk: int) -> Iterator[np.ndarray]:
        reader = _engine.EventReader(self._files, self._overrides)
        while True:
            part = reader.next(camera, chunk)
            if len(part) == 0:
                return
            yield part

    @cached_property
    def poses(self) -> tuple[np.ndarray, np.ndarray]:
        """Poses of the rig: times (n,), int64, nanoseconds, and T_world_rig (n, 4, 4), float64.

        Read once, at the first use: this reads the whole recording.
        """
        return _engine.read_poses(self._files, self._overrides)


def open(
    path: Path | Sequence[Path],
    *,
    poses: Path = "",
    calibration: Path = "",
    hand_eye: Path = "",
    t0: int | None = None,
    t1: int | None = None,
) -> Recording:
    """Open a recording.

    Parameters
    ----------
    path : path or sequence of paths
        Files and folders of one recording.
    poses, calibration, hand_eye : path
        Files that replace those of the recording, as ``--poses``, ``--calibration`` and ``--hand-eye`` do.
    t0, t1 : int
        Nanoseconds on the clock of the poses: only the events of [t0, t1) are read.

    Raises
    ------
    OSError
        If a file cannot be read. It names file, place, value and what was expected.
    """
    files = [path] if isinstance(path, (str, os.PathLike)) else list(path)
    overrides = _engine.Overrides(os.fspath(poses), os.fspath(calibration), os.fspath(hand_eye), t0, t1)
    return Recording(files, overrides)


class Mapper:
    """Turns events and poses into keyframes and one map.

    Parameters
    ----------
    options : mapping of str to str, number or bool
        Keys of the .ini files.
    on_keyframe : callable
        Called with each `Keyframe`, in the order of their windows. Its exceptions end the call that maps.

    Raises
    ------
    ValueError
        If an option is unknown or out of range.

    Notes
    -----
    Automatic options are chosen at `finish`, or when ``live.max_queue_mb`` of events wait: nothing is mapped before.
    """

    def __init__(
        self, options: Options | None = None, on_keyframe: Callable[[Keyframe], Any] | None = None
    ) -> None:
        self._mapper = _engine.Mapper(_engine_options(options), on_keyframe)

    def add_camera(self, camera: Camera) -> int:
        """Add a camera and return its index, from 0. All cameras come before the events."""
        return self._mapper.add_camera(camera)

    def add_events(self, camera: int, array: np.ndarray, time_unit: str = "ns") -> None:
        """Add the next events of a camera: a structured array with the fields x, y, p, t (see `events`).

        Events that are up to 10 ms out of order are sorted.

        Raises
        ------
        ValueError
            If an event is outside the sensor or older than that, or if there is no such camera.
        """
        self._mapper.add_events(camera, _event_records(array, time_unit))

    def add_pose(self, t: int, T_world_rig: np.ndarray) -> None:
        """Add the next pose, on the clock of the events. Events and poses may come in any order.

        Parameters
        ----------
        t : int
            Nanoseconds.
        T_world_rig : array_like, shape (4, 4) or (7,)
            A matrix, or tx ty tz qx qy qz qw as in a TUM file. (The last digits of a map depend on it: the rotation of
            a matrix is rounded when it becomes a quaternion.)

        Raises
        ------
        ValueError
            If the pose is not finite or not rigid, or a second older than the newest one.
        """
        self._mapper.add_pose(t, T_world_rig)

    def add_recording(self, recording: Recording) -> None:
        """Add the events and poses of a recording, in the order of time; Ctrl-C ends it."""
        self._mapper.add_recording(recording._files, recording._overrides)

    def finish(self) -> None:
        """End the input, and map the rest."""
        self._mapper.finish()

    @property
    def points(self) -> np.ndarray:
        """The map: a structured array with x, y, z (metres), intensity, support, sigma (metres)."""
        return self._mapper.points()

    @property
    def trajectory(self) -> tuple[np.ndarray, np.ndarray]:
        """Times (n,) of the keyframes, nanoseconds, and T_world_ref (n, 4, 4)."""
        return self._mapper.trajectory()

    @property
    def warnings(self) -> list[tuple[str, str]]:
        """Names and texts of the warnings so far."""
        return self._mapper.warnings()


class Map:
    """The result of `map`: a list of its keyframes, with `points`, `trajectory` and `warnings` as `Mapper` has them."""

    def __init__(self, mapper: Mapper, keyframes: list[Keyframe]) -> None:
        self.keyframes = keyframes
        self.points = mapper.points
        self.trajectory = mapper.trajectory
        self.warnings = mapper.warnings

    def __iter__(self) -> Iterator[Keyframe]:
        return iter(self.keyframes)

    def __len__(self) -> int:
        return len(self.keyframes)


def map(recording: Recording, options: Options | None = None) -> Map:
    """Map a recording in memory.

    Raises
    ------
    OSError
        If the recording cannot be read to its end.
    ValueError
        If an option is unknown or out of range.
    """
    keyframes: list[Keyframe] = []
    mapper = Mapper(options, keyframes.append)
    mapper.add_recording(recording)
    mapper.finish()
    return Map(mapper, keyframes)
