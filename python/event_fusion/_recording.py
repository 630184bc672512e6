# SPDX-License-Identifier: BSD-3-Clause
"""Recordings, and poses and calibrations in files."""

from __future__ import annotations

import builtins
import json
import os
import tempfile
from functools import cached_property
from typing import Any, Iterator, Sequence

import numpy as np
import numpy.typing as npt

from . import _engine
from ._engine import Camera
from ._events import Array, Path, in_unit, ns_per, times_in, times_in_ns, whole


class Recording:
    """Events and poses of one recording, in any format that the program ``event-fusion`` reads. See `open`.

    Attributes
    ----------
    rig : list of Camera
        The cameras. The focal lengths of `Camera.K` are 0 where no calibration is known.
    files : list of str
        The files and folders.
    """

    def __init__(self, files: Sequence[str], source: _engine.Source) -> None:
        self.files = list(files)
        self._source = source
        self._temporary: tempfile.TemporaryDirectory[str] | None = None
        self.rig: list[Camera] = _engine.read_rig(source)

    def __repr__(self) -> str:
        return f"<Recording {', '.join(self.files)}: {len(self.rig)} cameras>"

    def events(self, camera: int = 0, chunk: int = 1_000_000, time_unit: str = "ns") -> Iterator[Array]:
        """Read the events of a camera in the order of time.

        Parameters
        ----------
        camera : int
            Index in `rig`.
        chunk : int
            Maximum number of events of an array. Memory does not grow with the recording.
        time_unit : {'ns', 'us', 'ms', 's'}
            Unit of the times: integers, rounded down; floats for 's'.

        Yields
        ------
        numpy.ndarray, shape (n,), dtype EVENT_DTYPE
            Fields x, y, p (0 or 1) and t.

        Raises
        ------
        OSError
            At damage, after the events before it. It names file, place, value and what was expected.
        ValueError
            If there is no such camera, `chunk` is below 1, or the unit is unknown.
        """
        if not 0 <= camera < len(self.rig):
            raise ValueError(f"camera = {camera}: expected a camera of the recording: 0 to {len(self.rig) - 1}")
        if whole("chunk", chunk) < 1:
            raise ValueError(f"chunk = {chunk}: expected 1 or above")
        ns_per(time_unit)
        return self._read(camera, chunk, time_unit)

    def _read(self, camera: int, chunk: int, time_unit: str) -> Iterator[Array]:
        reader = _engine.EventReader(self._source)
        while len(part := reader.next(camera, chunk)) > 0:
            yield in_unit(part, time_unit)

    @cached_property
    def poses(self) -> tuple[Array, Array]:
        """Poses of the rig: times (n,), int64, nanoseconds, and T_world_rig (n, 4, 4), float64.

        Times are rounded to 100 ns, as the maps use them. Read once, at the first use: this reads the whole recording.
        Without poses both are empty.
        """
        return _engine.read_poses(self._source)

    @cached_property
    def _info(self) -> dict[str, Any]:
        info: dict[str, Any] = json.loads(_engine.read_info(self._source))
        return info

    def info(self) -> dict[str, Any]:
        """Read the whole recording, once, and return what ``event-fusion info`` says of it.

        Returns
        -------
        dict
            observations; cameras (name, width, height, calibrated, events, first_ns, last_ns, per_second, positive);
            poses, by source (source, used, poses, first_ns, last_ns, per_second, max_gap_s, path_m, max_speed_m_s,
            max_rotation_rad_s); events_before_poses, events_after_poses; others; sorted_events; true_depth_maps;
            chosen (key, value, reason: the options that `map` would choose); warnings, and notes on what could not
            be checked (name, text).

        Raises
        ------
        OSError
            If the recording cannot be read to its end.
        """
        return self._info

    def warnings(self) -> list[tuple[str, str]]:
        """Return names and texts of what looks wrong in the recording; reads it as `info` does."""
        return [(warning["name"], warning["text"]) for warning in self._info["warnings"]]


def write_poses(path: Path, poses: tuple[npt.ArrayLike, npt.ArrayLike], time_unit: str = "ns") -> None:
    """Write poses as a TUM file, which `open` and ``event-fusion map --poses`` read.

    Times (n,) in a unit ('ns', 'us', 'ms', 's'), and poses (n, 4, 4), or (n, 7): tx ty tz qx qy qz qw.
    """
    _engine.write_poses(os.fspath(path), times_in_ns(np.asarray(poses[0]), ns_per(time_unit)), poses[1])


def write_cameras(path: Path, cameras: Sequence[Camera]) -> None:
    """Write a calibration as a camera chain of Kalibr, which `open` and ``event-fusion map --calibration`` read."""
    with builtins.open(path, "w", encoding="ascii") as file:
        file.write(_engine.format_calibration(list(cameras)))


def read_poses(poses: Path | tuple[Array, Array], time_unit: str = "") -> tuple[Array, Array]:
    """Return times (n,) in nanoseconds and poses (n, 4, 4) of a file, in any format that `open` reads as poses."""
    if isinstance(poses, (str, os.PathLike)):
        return _engine.read_pose_file(os.fspath(poses), time_unit)
    return poses


def read_cameras(calibration: Path | Sequence[Camera]) -> list[Camera]:
    """Return the cameras of a calibration, in any format that `open` reads as one."""
    if isinstance(calibration, (str, os.PathLike)):
        return _engine.read_calibration(os.fspath(calibration))
    return list(calibration)


def open(
    path: Path | Sequence[Path],
    *,
    poses: Path | tuple[npt.ArrayLike, npt.ArrayLike] = "",
    calibration: Path | Sequence[Camera] = "",
    hand_eye: Path = "",
    t0: int | str | None = None,
    t1: int | str | None = None,
    format: str = "auto",
    topics: str | Sequence[str] = (),
    event_columns: str = "",
    time_unit: str = "",
    pose_time_unit: str = "",
    sensor_size: tuple[int, int] | None = None,
    skip_bad_events: int = 0,
    cameras: Sequence[int] = (),
) -> Recording:
    """Open a recording.

    Parameters
    ----------
    path : path or sequence of paths
        Files and folders of one recording. To read its events, neither poses nor a calibration are needed.
    poses, calibration, hand_eye : path
        Files that replace those of the recording, as ``--poses``, ``--calibration`` and ``--hand-eye`` do. Poses may be
        (times, T_world_rig), nanoseconds (n,) and matrices (n, 4, 4), and a calibration a sequence of `Camera`.
    t0, t1 : int or str
        Only the events of [t0, t1) are read. Integers: nanoseconds on the clock of the poses. Text as on the command
        line: ``"3.2"`` is seconds on that clock, ``"+3.2"`` seconds from the first event on.
    format, topics, event_columns, time_unit, pose_time_unit, sensor_size, skip_bad_events
        What cannot be found in the files: the options of the command line with these names. `sensor_size` is (width,
        height).
    cameras : sequence of int
        The cameras of the calibration that the recording has, if the calibration has more (``rig.cameras``). Poses are
        those of the calibration's camera 0.

    Raises
    ------
    OSError
        If a file cannot be read. It names file, place, value and what was expected. An option that it names, such as
        ``--sensor-size 346x260``, is the argument of that name here: ``sensor_size=(346, 260)``.
    ValueError
        If a time cannot be read, t1 is not above t0, or `cameras` has more or fewer numbers than the recording cameras.
    """
    files = [os.fspath(file) for file in ([path] if isinstance(path, (str, os.PathLike)) else path)]
    temporary = None
    if isinstance(poses, tuple) or not isinstance(calibration, (str, os.PathLike)):
        temporary = tempfile.TemporaryDirectory(prefix="event_fusion_")
        if isinstance(poses, tuple):
            file = os.path.join(temporary.name, "poses.txt")
            write_poses(file, poses)
            poses = file
        if not isinstance(calibration, (str, os.PathLike)):
            file = os.path.join(temporary.name, "camchain.yaml")
            write_cameras(file, calibration)
            calibration = file
    source = _engine.Source(
        files,
        os.fspath(poses),
        os.fspath(calibration),
        os.fspath(hand_eye),
        format,
        [topics] if isinstance(topics, str) else list(topics),
        event_columns,
        time_unit,
        pose_time_unit,
        sensor_size,
        skip_bad_events,
        list(cameras),
    )

    source.set_limits(*times_in(source, t0=t0, t1=t1))
    recording = Recording(files, source)
    recording._temporary = temporary  # its files are removed with the last user
    if cameras and len(cameras) != len(recording.rig):
        raise ValueError(f"cameras = {list(cameras)}: expected {len(recording.rig)}, as many as the recording has")
    return recording
