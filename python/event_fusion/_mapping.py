# SPDX-License-Identifier: BSD-3-Clause
"""Maps of recordings and of arrays."""

from __future__ import annotations

import atexit
import json
import os
import queue
import sys
import threading
import warnings as python_warnings
import weakref
from functools import cached_property
from typing import Any, Callable, Iterable, Iterator, NamedTuple, Sequence

import numpy as np
import numpy.typing as npt

from . import _engine
from ._engine import Camera, Keyframe
from ._events import (
    Array,
    EventFusionWarning,
    Options,
    Path,
    Progress,
    ProgressBar,
    column_of,
    engine_options,
    event_records,
    ns_per,
    times_in,
    times_in_ns,
    whole,
)
from ._recording import Recording, open


def _warn(found: list[tuple[str, str]]) -> None:
    """Give Python's warnings, at the line outside of the package that waits for the result."""
    depth, frame = 1, sys._getframe()
    while frame.f_back is not None and frame.f_globals.get("__package__") == __package__:
        depth, frame = depth + 1, frame.f_back
    for name, text in found:
        python_warnings.warn(f"{name}: {text}", EventFusionWarning, stacklevel=depth)


_endings: set[Any] = set()  # of mappers and maps


def _end_with(owner: object, end: Callable[..., Any], *arguments: Any) -> None:
    """Call a function when the owner is gone, or when Python exits."""
    _endings.difference_update([ending for ending in _endings if not ending.alive])
    _endings.add(weakref.finalize(owner, end, *arguments))


@atexit.register
def _end_all() -> None:
    """Stop what maps: at its exit, Python kills threads, which the engine does not survive."""
    for ending in list(_endings):
        ending()
    _engine.wait_for_calls()


def _opened(recording: Recording | Path) -> Recording:
    return recording if isinstance(recording, Recording) else open(recording)


class Mapper:
    """Turns events and poses into keyframes and one map, in memory: from own arrays, beside a sensor or later.

    Parameters
    ----------
    options : mapping of str to str, number or bool; or path
        Keys of the .ini files, or such a file, or the name of an installed one: "davis346_mvsec".
    on_keyframe : callable
        Called with each `Keyframe`, in the order of their windows. Its exceptions end the call that maps; with
        ``live.enabled``, where a thread of the mapper calls it, they are counted and given to `on_warning`.
    on_warning : callable
        Called with the text of losses and errors of live operation, and of poses that do not explain the events.

    Raises
    ------
    ValueError
        If an option is unknown or out of range.

    Notes
    -----
    Automatic options are chosen at `finish`, or when ``live.max_queue_mb`` of events wait: nothing is mapped before.
    With ``{"live.enabled": True}`` adding never waits, and `points` is the newest map.

    Examples
    --------
    >>> import numpy as np
    >>> import event_fusion as ef
    >>> mapper = ef.Mapper({"dsi.min_depth_m": 1, "dsi.max_depth_m": 5})
    >>> mapper.add_camera(ef.Camera(346, 260, np.array([[226, 0, 173], [0, 226, 130], [0, 0, 1]])))
    0
    """

    def __init__(
        self,
        options: Options | None = None,
        on_keyframe: Callable[[Keyframe], Any] | None = None,
        on_warning: Callable[[str], Any] | None = None,
    ) -> None:
        self._mapper = _engine.Mapper(engine_options(options), on_keyframe, on_warning)
        _end_with(self, self._mapper.stop)

    def add_camera(self, camera: Camera) -> int:
        """Add a camera and return its index, from 0. All cameras come before the events."""
        if not isinstance(camera, Camera):
            raise TypeError(f"camera = {camera!r}: expected an event_fusion.Camera")
        return self._mapper.add_camera(camera)

    def add_events(self, camera: int, array: npt.ArrayLike, time_unit: str = "ns") -> None:
        """Add the next events of a camera, on the camera's clock.

        Parameters
        ----------
        camera : int
            Index that `add_camera` returned.
        array : structured array
            Fields x, y, p (or polarity) and t (or ts, timestamp). Events that are up to 10 ms out of order are sorted.
            Bursts of events with a time far ahead are left out, and `warnings` tells their number (without
            ``live.enabled``).
        time_unit : {'ns', 'us', 'ms', 's'}
            Unit of the times.

        Raises
        ------
        ValueError
            If an event is outside the sensor or older than that, or if there is no such camera. No event of the call
            is added then.
        TypeError
            If the array has not these fields.
        """
        self._mapper.add_events(whole("camera", camera), event_records(array, time_unit))

    def add_pose(self, t: float, T_world_rig: npt.ArrayLike, time_unit: str = "ns") -> None:
        """Add the next pose, on the clock of the events. Events and poses may come in any order.

        A burst of poses that are over a second ahead is left out, with a warning.

        Parameters
        ----------
        t : int or float
            Time.
        T_world_rig : array_like, shape (4, 4) or (7,)
            A matrix, or tx ty tz qx qy qz qw as in a TUM file. Both make the same map, bit for bit: rotations are
            rounded to 1e-12 rad.
        time_unit : {'ns', 'us', 'ms', 's'}
            Unit of the time. Seconds as floats are exact to 0.2 µs today.

        Raises
        ------
        ValueError
            If the pose is not finite or not rigid, or a second older than the newest one.
        """
        if time_unit == "ns":
            whole("t", t, "nanoseconds")
        self.add_poses([t], column_of("T_world_rig", T_world_rig)[None], time_unit)

    def add_poses(self, t: npt.ArrayLike, T_world_rig: npt.ArrayLike, time_unit: str = "ns") -> None:
        """Add poses in the order of time: times (n,) in a unit, and matrices (n, 4, 4) or rows (n, 7)."""
        times, poses = column_of("t", t), np.asarray(column_of("T_world_rig", T_world_rig), float)
        factor = ns_per(time_unit)
        if times.ndim == 1 and len(times) == 0 and len(poses) == 0:
            return
        if times.dtype.kind not in "iuf" or times.ndim != 1 or (time_unit == "ns" and times.dtype.kind == "f"):
            raise TypeError(f"t: {times.dtype} of shape {times.shape}: expected nanoseconds, as ints, or time_unit=")
        times = times_in_ns(times, factor)
        if poses.shape not in ((len(times), 4, 4), (len(times), 7)):
            shape = poses.shape[1:]
            raise ValueError(
                f"T_world_rig of shape {shape if len(times) == len(poses) else poses.shape}: expected (4, 4), or (7,): "
                "tx ty tz qx qy qz qw; of each time"
            )
        finite = np.isfinite(poses.reshape(len(poses), -1)).all(axis=1)
        if not finite.all():
            wrong = int(np.argmin(finite))
            raise ValueError(f"T_world_rig at {times[wrong]} ns: expected finite numbers: {poses[wrong].tolist()}")
        self._mapper.add_poses(times, poses)

    def add_recording(self, recording: Recording | Path) -> None:
        """Add the events and poses of a recording, in the order of time."""
        self._mapper.add_recording(_opened(recording)._source)

    def finish(self) -> None:
        """End the input, and map the rest. The warnings are Python's `EventFusionWarning`, too."""
        self._mapper.finish()
        _warn(self.warnings)

    def stop(self) -> None:
        """End without mapping the rest."""
        self._mapper.stop()

    def save(self, path: Path) -> None:
        """Write the points as .ply or .pcd."""
        self._mapper.save(os.fspath(path))

    def __repr__(self) -> str:
        return f"<Mapper: {self.status['keyframes']} keyframes>"

    @property
    def points(self) -> Array:
        """The map so far, a copy: a structured array with x, y, z (metres, world, float64), intensity, support, sigma (metres), probability."""
        return self._mapper.points()

    @property
    def hash(self) -> str:
        """SHA-256 of the points in any order: equal maps have equal hashes (docs/session.md)."""
        return self._mapper.hash()

    @property
    def trajectory(self) -> tuple[Array, Array]:
        """Times (n,) of the keyframes, nanoseconds, and T_world_ref (n, 4, 4)."""
        return self._mapper.trajectory()

    @property
    def warnings(self) -> list[tuple[str, str]]:
        """Names and texts of the warnings so far."""
        return self._mapper.warnings()

    @property
    def status(self) -> dict[str, Any]:
        """Number of keyframes, and the fraction of the events that live operation dropped."""
        keyframes, dropped = self._mapper.status()
        return {"keyframes": keyframes, "drop_ratio": dropped}


def _run(items: queue.Queue[Any], job: Callable[[Callable[[Keyframe], None]], _engine.MapResult]) -> None:
    """Map in a thread: keyframes go into the queue, then the result or the exception."""
    try:
        items.put(job(items.put))
    except BaseException as error:  # the caller's thread raises it
        items.put(error)


def _end(stop: _engine.StopFlag, items: queue.Queue[Any], thread: threading.Thread, has_folder: bool) -> None:
    """End a mapping whose result nobody waits for. One with a folder goes on to its end; its errors are warnings."""
    if not has_folder:
        stop.set()
    while thread is not threading.current_thread() and (thread.is_alive() or not items.empty()):
        try:
            item = items.get(timeout=0.02)
            if isinstance(item, BaseException):
                raise item
            if isinstance(item, _engine.MapResult):
                item.reject_error()
        except queue.Empty:
            pass
        except Exception as error:
            if has_folder:
                python_warnings.warn(f"a map that nobody looked at failed: {error}", EventFusionWarning, stacklevel=2)


class Map:
    """The map of a recording: see `map`. Keyframes come while the recording is mapped.

    A loop over the map, or `keyframes`, gives them in the order of time; `points`, `trajectory`, `report` and
    `warnings` wait for the end. After Ctrl-C or `close`, they are those of the recording so far.
    """

    def __init__(
        self,
        recording: Recording | Path,
        options: Options | None,
        out: Path | None,
        force: bool,
        resume: bool,
        keep: bool,
        progress: Progress,
    ) -> None:
        if resume and out is None:
            raise ValueError("resume=True: expected out=, the folder of the earlier run")
        checked = engine_options(options)
        recording = _opened(recording)
        self._keep = keep
        self._count = 0
        self._looped = False
        self._made: list[Keyframe] = []
        self._result: _engine.MapResult | None = None
        self._error: BaseException | None = None
        self._bar = ProgressBar(progress)
        stop = self._stop = _engine.StopFlag()
        # With `keep`, the mapping need not wait for the loop.
        items: queue.Queue[Any] = queue.Queue(0 if keep else 2)
        on_progress = self._bar.callback
        folder = "" if out is None else os.fspath(out)
        source = recording._source

        def job(on_keyframe: Callable[[Keyframe], None]) -> _engine.MapResult:
            return _engine.run_map(source, checked, folder, force, resume, stop, on_keyframe, on_progress)

        self._recording = recording  # a simulated one is removed with its last user
        self._items = items
        self._lock = threading.RLock()  # the threads that use the map take turns
        self._thread = threading.Thread(target=_run, args=(items, job), daemon=True, name="event_fusion.map")
        _end_with(self, _end, stop, items, self._thread, out is not None)
        self._thread.start()

    def _next(self) -> Keyframe | None:
        """Wait for the next keyframe; None at the end. The caller holds the lock."""
        if self._result is not None:
            return None
        if threading.current_thread() is self._thread:
            raise RuntimeError("a callback of the mapping waits for the mapping: use the map in another thread")
        if self._error is not None:
            raise self._error
        try:
            item = self._items.get()
        except BaseException:  # Ctrl-C
            self.close()
            raise
        if isinstance(item, Keyframe):
            self._count += 1
            if self._keep:
                self._made.append(item)
            return item
        self._bar.close()
        if isinstance(item, BaseException):
            self._error = item
            raise item
        self._result = item
        try:
            _warn(self.warnings)
        finally:
            item.reject_error()
        return None

    def _finished(self) -> _engine.MapResult:
        with self._lock:
            while self._next() is not None:
                pass
            assert self._result is not None
            return self._result

    def __iter__(self) -> Iterator[Keyframe]:
        with self._lock:
            if not self._keep and self._looped:
                raise RuntimeError("keep=False: a loop over the map gives each keyframe once")
            self._looped = True
        at = 0
        while True:
            with self._lock:
                known = self._keep and at < len(self._made)
                keyframe = self._made[at] if known else self._next()
            if keyframe is None:
                return
            yield keyframe
            at += 1

    def __repr__(self) -> str:
        state = "made" if self._result is not None else "failed" if self._error is not None else "being made"
        return f"<Map of {', '.join(self._recording.files)}: {state}, {self._count} keyframes so far>"

    def close(self) -> None:
        """End the mapping, if it goes on, after the current keyframe: the map is that of the recording so far."""
        self._stop.set()
        try:
            self._finished()
        except (OSError, ValueError) as error:
            self._error = error

    @property
    def keyframes(self) -> list[Keyframe]:
        """All keyframes."""
        if not self._keep:
            raise RuntimeError("keep=False: a loop over the map gives each keyframe once")
        self._finished()
        return self._made

    @cached_property
    def points(self) -> Array:
        """The map: a structured array with x, y, z (metres, world, float64), intensity, support, sigma (metres), probability."""
        return self._finished().points

    @property
    def trajectory(self) -> tuple[Array, Array]:
        """Times (n,) of the keyframes, nanoseconds, and T_world_ref (n, 4, 4)."""
        return self._finished().trajectory

    @property
    def tracker_trajectory(self) -> tuple[Array, Array]:
        """The same by the tracker: it differs if ``refinement.enabled`` corrects keyframes."""
        return self._finished().tracker_trajectory

    @cached_property
    def report(self) -> dict[str, Any]:
        """The content of report.json: counts, times, options, what was chosen and why."""
        report: dict[str, Any] = json.loads(self._finished().report)
        return report

    @property
    def hash(self) -> str:
        """SHA-256 of the points in any order: equal maps have equal hashes (docs/session.md)."""
        return self._finished().hash()

    @property
    def warnings(self) -> list[tuple[str, str]]:
        """Names and texts of the warnings."""
        return [(warning["name"], _engine.python_text(warning["text"])) for warning in self.report["warnings"]]

    @property
    def quality(self) -> dict[str, Any]:
        """How good the map is, by its own evidence.

        ``word`` ("good", "doubtful", "wrong" or "unknown"), ``wrong_share`` (predicted fraction of depths that are
        off by more than 10 %), ``depth_error`` (predicted median, relative), ``support`` and ``agreement`` (the
        fraction of depths that a neighbouring keyframe has, too, and the fraction of these that agree within 10 %),
        ``sharpness`` (of the events, relative to that with other clocks or axes of the poses), ``reasons`` (texts),
        ``keyframes`` (the predicted fraction of right depths of each), ``much_worse`` (keyframes, from 0),
        ``left_out`` (keyframes without points).
        """
        quality: dict[str, Any] = self.report["quality"]
        return quality

    def save(self, path: Path) -> None:
        """Write the points as .ply or .pcd."""
        self._finished().save(os.fspath(path))


def map(
    recording: Recording | Path,
    options: Options | None = None,
    out: Path | None = None,
    *,
    force: bool = False,
    resume: bool = False,
    keep: bool = True,
    progress: Progress = False,
) -> Map:
    """Map a recording, as ``event-fusion map`` does.

    Parameters
    ----------
    recording : Recording or path
        See `open`.
    options : mapping of str to str, number or bool; or path
        Keys of the .ini files, or such a file, or the name of an installed one. What is not given has its default.
    out : path
        A folder for all that the program writes: map.pcd, map.html, pictures, report.json. By default no file. The
        folder is made also if nothing uses the result.
    force : bool
        Allow a folder that holds other files.
    resume : bool
        Go on with the keyframes that an earlier run for this folder stored before it ended: the result is that of one
        undisturbed run. They come again, without the confidences of pixels that have no depth. A complete result is
        not changed.
    keep : bool
        False: a keyframe lives as long as the loop uses it, so that memory does not grow with the recording.
    progress : bool or callable
        True: a bar of tqdm, or a line where it is not installed. A function gets the activity and the fraction that is done, ten times a
        second, in another thread; its exceptions end the mapping.

    Returns
    -------
    Map
        Keyframes as they come. Wrong input is found while mapping: what uses the map raises the error, once; after
        that, the map of what came before the damage can be used.

    Raises
    ------
    ValueError
        If an option is unknown or out of range.
    OSError
        If the recording cannot be read to its end, has no keyframe, or a file cannot be written.
    """
    return Map(recording, options, out, force, resume, keep, progress)


class Dsi(tuple):  # type: ignore[type-arg]
    """A disparity space image: ``values, depths = dsi``.

    Attributes
    ----------
    values : numpy.ndarray, float32, shape (planes, rows, columns)
        Fused ray densities; read-only.
    depths : numpy.ndarray, float64, shape (planes,)
        Metres along z of the view, nearest first.
    keyframe : Keyframe
        The view, as `Keyframe.pose` and `Keyframe.K`, and the depth map of the DSI. A depth is not at the largest value
        of its own pixel: the values of neighbouring pixels are summed first (``depth.extraction``: aggregated).
    contrast : numpy.ndarray, float32, shape (rows, columns)
        Local contrast of the largest values: above ``depth.min_local_contrast`` a pixel is a candidate for a depth.
        Exactly so with ``performance.coarse_to_fine = False``: otherwise the depths do not use all planes.
    """

    keyframe: Keyframe
    contrast: Array

    def __repr__(self) -> str:
        return f"<Dsi of shape {self.values.shape}, {self.depths[0]:.3g} to {self.depths[-1]:.3g} m>"

    @property
    def values(self) -> Array:
        values: Array = self[0]
        return values

    @property
    def depths(self) -> Array:
        depths: Array = self[1]
        return depths


def _span(recording: Recording) -> tuple[int, int]:
    """Return the times of the first and the last event with poses."""
    info = recording.info()
    of_poses = [(of["first_ns"], of["last_ns"]) for of in info["poses"] if of["used"]]
    of_events = [
        (of["first_ns"] + camera.time_offset_ns, of["last_ns"] + camera.time_offset_ns)
        for of, camera in zip(info["cameras"], recording.rig)
        if of["events"] > 0
    ]
    if not of_poses or not of_events:
        raise OSError(f"{', '.join(recording.files)}: expected events and poses")
    return max(min(of_events)[0], of_poses[0][0]), min(max(last for _, last in of_events), of_poses[0][1])


def _window(
    recording: Recording | Path, t0: int | str | None, t1: int | str | None, t_ref: int | str | None
) -> tuple[_engine.Source, tuple[int, int, int | None]]:
    """Return a recording's source, and the times of a window of it."""
    opened = _opened(recording)
    t0_ns, t1_ns, t_ref_ns = times_in(opened._source, t0=t0, t1=t1, t_ref=t_ref)
    if t0_ns is None or t1_ns is None:
        first_ns, last_ns = _span(opened)
        t0_ns, t1_ns = first_ns if t0_ns is None else t0_ns, last_ns + 1 if t1_ns is None else t1_ns
    return opened._source, (t0_ns, t1_ns, t_ref_ns)


def dsi(
    recording: Recording | Path,
    t0: int | str | None = None,
    t1: int | str | None = None,
    options: Options | None = None,
    *,
    t_ref: int | str | None = None,
    progress: Progress = False,
) -> Dsi:
    """Map one window and return its whole DSI, as ``event-fusion depth --save-dsi`` does.

    Parameters
    ----------
    recording : Recording or path
        See `open`.
    t0, t1 : int or str
        The window [t0, t1): nanoseconds, or text as in `open`. By default the first and the last event with poses, by
        the time offsets of the recording's calibration.
    options : mapping or path
        See `map`.
    t_ref : int or str
        Time of the view; by default the middle of the window.
    progress : bool or callable
        See `map`; in the caller's thread.

    Raises
    ------
    ValueError
        If an option is out of range, or t1 is not above t0.
    OSError
        If the recording cannot be read, or the window has no keyframe.
    """
    source, times = _window(recording, t0, t1, t_ref)
    checked = engine_options(options)
    with ProgressBar(progress) as on_progress:
        values, depths, keyframe, contrast = _engine.run_dsi(source, checked, *times, on_progress)
    made = Dsi((values, depths))
    made.keyframe, made.contrast = keyframe, contrast
    return made


def keyframes(
    cameras: Sequence[Camera],
    events: Sequence[npt.ArrayLike],
    poses: tuple[npt.ArrayLike, npt.ArrayLike],
    windows: Iterable[Sequence[int]],
    options: Options,
) -> list[Keyframe]:
    """Map windows of arrays, each alone: the method of the paper, for experiments.

    Parameters
    ----------
    cameras : sequence of Camera
        The rig. ``rig.cameras`` of the options selects those that are mapped.
    events : sequence of structured array
        The events of each camera, in the order of time: see `Mapper.add_events`.
    poses : (times, T_world_rig)
        Nanoseconds (n,) and matrices (n, 4, 4).
    windows : iterable of (t0, t1) or (t0, t1, t_ref)
        Events of [t0, t1), and the time of the view, by default the middle. Windows may overlap.
    options : mapping or path
        See `map`. Windows alone do not tell the depths: ``dsi.min_depth_m`` and ``dsi.max_depth_m`` are required.
        ``depth.max_confidence`` = sequence: that of all windows.

    Raises
    ------
    ValueError
        If an option is out of range or missing, events are not in the order of time, or a view has no pose.

    Notes
    -----
    Ghosh and Gallego 2022, Algorithms 1 and 2. No filter of events, map or refinement: see `map` for these.
    """
    arrays = _engine.RigArrays(list(cameras), [event_records(of_camera) for of_camera in events], *poses)
    times = [tuple(window) if len(window) == 3 else (*window, (window[0] + window[1]) // 2) for window in windows]
    return _engine.keyframes(arrays, times, engine_options(options))


class Candidates(NamedTuple):
    """What decides on the depths of a window: structured arrays, one record for each pixel that could have a depth.

    Their fields: x, y; depth and sigma (metres); probability (0: the pixel is never kept); inputs, of the network that
    gives the probability: see mapping/depth/depth_probability.h.

    Attributes
    ----------
    candidates : numpy.ndarray
        Pixels whose local contrast is above ``depth.min_local_contrast``; 7 inputs.
    neighbours : numpy.ndarray
        Pixels beside them, and candidates without a depth of their own (``depth.neighbours``); 6 inputs.
    keyframe : Keyframe
        The depth map of the window, with the depths of neighbours.
    """

    candidates: Array
    neighbours: Array
    keyframe: Keyframe


def candidates(
    recording: Recording | Path,
    t0: int | str | None = None,
    t1: int | str | None = None,
    options: Options | None = None,
    *,
    t_ref: int | str | None = None,
    progress: Progress = False,
) -> Candidates:
    """Map one window and return all pixels that could have a depth, kept or not: for experiments with probabilities.

    scripts/fit_probability.py of the source fits the probabilities with it. Arguments and errors are those of `dsi`.
    """
    source, times = _window(recording, t0, t1, t_ref)
    checked = engine_options(options)
    with ProgressBar(progress) as on_progress:
        return Candidates(*_engine.run_candidates(source, checked, *times, on_progress))
