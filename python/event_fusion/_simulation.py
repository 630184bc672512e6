# SPDX-License-Identifier: BSD-3-Clause
"""Simulated recordings with exact truth, and poses with the errors of trackers."""

from __future__ import annotations

import os
import pathlib
import tempfile
from typing import Any, Mapping, Sequence

import numpy as np
import numpy.typing as npt

from . import _engine
from ._engine import Camera, Keyframe
from ._events import Array, Path, Progress, ProgressBar
from ._recording import Recording, open, read_cameras, read_poses



class Simulation:
    """Cameras that move through a scene: their events, and the exact truth at any time.

    Parameters
    ----------
    preset : str
        Scene, cameras and motion: one of `simulation_presets`. Or `scene`.
    scene : {'room', 'street', 'poles'}
        A scene that is built around the trajectory; upwards is the cameras' -y.
    trajectory : path or (times, poses)
        Poses of camera 0, low-pass filtered at 10 Hz; with a preset, they replace its motion.
    calibration : path or sequence of Camera
        The cameras; with a preset, they replace its own.
    start : int
        Start time on the trajectory, nanoseconds; by default the start of motion.
    duration : float
        Seconds, 0.001 to 600; by default the preset's, or 5.
    seed : int
        Seed of all random values.
    threshold : float
        Change of log intensity for an event; by default the preset's, or 0.3.
    mismatch, refractory_us, noise_hz, hot_pixels, hot_hz : float
        Errors of the pixels: the options of ``event-fusion simulate`` with these names.

    Raises
    ------
    ValueError
        If there is no such preset or scene, or a value is out of range.
    OSError
        If a file cannot be read.

    Examples
    --------
    >>> Simulation("desk_stereo", duration=0.1).cameras[0].width
    346
    """

    def __init__(
        self,
        preset: str = "",
        *,
        scene: str = "",
        trajectory: Path | tuple[Array, Array] | None = None,
        calibration: Path | Sequence[Camera] = (),
        start: int | None = None,
        duration: float | None = None,
        seed: int = 1,
        threshold: float | None = None,
        mismatch: float = 0,
        refractory_us: float = 0,
        noise_hz: float = 0,
        hot_pixels: float = 0,
        hot_hz: float = 1000,
    ) -> None:
        if bool(preset) == bool(scene):
            raise ValueError("expected preset= or scene=, and one of them alone")
        if scene and (trajectory is None or not calibration):
            raise ValueError(f"scene = {scene!r}: expected trajectory= and calibration=, too")
        none = np.empty(0, np.int64), np.empty((0, 4, 4))
        times, poses = none if trajectory is None else read_poses(trajectory)
        cameras = read_cameras(calibration)
        self._simulation = _engine.Simulation(preset, scene, cameras, times, poses, start, duration, seed,
                                              threshold, mismatch, refractory_us, noise_hz, hot_pixels, hot_hz)

    @property
    def cameras(self) -> list[Camera]:
        """The cameras of the rig."""
        return self._simulation.cameras

    @property
    def start(self) -> int:
        """Time of the start, nanoseconds."""
        return self._simulation.start_ns

    @property
    def end(self) -> int:
        """Time of the end, nanoseconds."""
        return self._simulation.end_ns

    @property
    def surfaces(self) -> Array:
        """The rectangles of the scene (n, 3, 3): a corner and the vectors of both edges, metres, world. They are seen from
        the side of the cross product of the edges."""
        return self._simulation.surfaces

    def poses(self, times: npt.ArrayLike | None = None) -> tuple[Array, Array]:
        """Return the true poses T_world_rig (n, 4, 4) at times (n,) in nanoseconds; by default at every millisecond."""
        return self._simulation.poses(np.arange(self.start, self.end + 1, 1_000_000) if times is None else times)

    def depth(self, keyframe: Keyframe, pose: npt.ArrayLike | None = None) -> Array:
        """Return the true depth map of a keyframe, in metres along z; 0: nothing is seen.

        By default at the true pose of camera 0 at the time of the keyframe. `pose`: T_world_ref (4, 4) of another view;
        ``keyframe.pose`` gives the truth at the poses that were used.
        """
        if pose is None:
            pose = self.poses([keyframe.t])[1][0] @ self.cameras[0].T_rig_cam
        rows, columns = keyframe.depth.shape
        return self._simulation.depth(pose, keyframe.K, (columns, rows))

    def events(self, progress: Progress = False) -> list[tuple[Array, Array]]:
        """Simulate. Return the events of each camera, and the points (n, 3) that they saw.

        Points are in the world, metres, float32; NaN for noise.
        """
        with ProgressBar(progress) as on_progress:
            return self._simulation.events(on_progress)

    def record(self, out: Path, progress: Progress = True) -> Recording:
        """Simulate, and write a recording with true depth maps and clouds into a new folder."""
        with ProgressBar(progress) as on_progress:
            self._simulation.record(os.fspath(out), on_progress)
        return open(out)


def simulate(
    preset: str = "desk_stereo",
    seed: int = 1,
    *,
    duration: float | None = None,
    out: Path | None = None,
    progress: Progress = True,
) -> Recording:
    """Simulate a recording with exact ground truth: this takes some ten seconds to some minutes.

    Parameters
    ----------
    preset : str
        One of `simulation_presets`.
    seed : int
        Seed of all random values.
    duration : float
        Seconds, 0.001 to 600; by default the preset's.
    out : path
        The new folder of the recording. By default a temporary one, which lives as long as the result.
    progress : bool or callable
        See `map`. By default a bar, which tells how long it takes.

    Returns
    -------
    Recording
        With true depth maps and clouds beside it, for `event_fusion.evaluate`.

    Raises
    ------
    ValueError
        If there is no such preset, or the duration is out of range.
    OSError
        If the folder exists and is not empty, or cannot be written.
    """
    temporary = tempfile.TemporaryDirectory(prefix="event_fusion_") if out is None else None
    folder = pathlib.Path(temporary.name) / preset if temporary is not None else pathlib.Path(out or "")
    recording = Simulation(preset, seed=seed, duration=duration).record(folder, progress)
    recording._temporary = temporary  # removed with the recording
    return recording


def perturb(
    poses: tuple[Array, Array], faults: Mapping[str, Any], camera: Camera | None = None
) -> tuple[Array, Array]:
    """Return the poses of a tracker with faults.

    Parameters
    ----------
    poses : (times, T_world_rig)
        Nanoseconds (n,) and matrices (n, 4, 4), in the order of time.
    faults : mapping
        Keys and values of ``event-fusion map --perturb``: ``{"noise_m": 0.01}``, ``{"tracker": "typical", "depth_m": 2}``.
    camera : Camera
        The camera whose motion the errors of ``tracker`` follow; by default the rig's frame.

    Raises
    ------
    ValueError
        If a key is unknown, or a value is out of range.
    """
    assignments = [f"{key}={value}" for key, value in faults.items()]
    return _engine.perturbed(*poses, assignments, camera or Camera(1, 1, np.eye(3)))
