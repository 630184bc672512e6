# SPDX-License-Identifier: BSD-3-Clause
"""Depth maps and point clouds from event cameras with known poses.

Times are integer nanoseconds, lengths metres. `T_a_b` maps coordinates of frame b to frame a. Frames: `world`; `rig`, the
common frame of the cameras; `cam` and a keyframe's view: x right, y down, z forward. Options have the names of the .ini
files: ``{"dsi.max_depth_m": 8}``. Errors of data and files are OSError, wrong arguments ValueError.

>>> import event_fusion as ef
>>> ef.EVENT_DTYPE.names
('x', 'y', 'p', 't')
"""

try:
    import numpy as _numpy  # noqa: F401
except ImportError as error:
    raise ImportError("event_fusion needs NumPy (Debian: python3-numpy)") from error

from . import _engine, evaluate
from ._engine import EVENT_DTYPE, Camera, Keyframe, simulation_presets
from ._events import EventFusionWarning, events
from ._mapping import Candidates, Dsi, Map, Mapper, candidates, dsi, keyframes, map
from ._recording import Recording, open, read_cameras, read_poses, write_cameras, write_poses
from ._session import Session
from ._simulation import Simulation, perturb, simulate

__version__ = _engine.VERSION

__all__ = [
    "EVENT_DTYPE",
    "Camera",
    "Candidates",
    "Dsi",
    "EventFusionWarning",
    "Keyframe",
    "Map",
    "Mapper",
    "Recording",
    "Session",
    "Simulation",
    "candidates",
    "dsi",
    "evaluate",
    "events",
    "keyframes",
    "map",
    "open",
    "perturb",
    "read_cameras",
    "read_poses",
    "simulate",
    "simulation_presets",
    "write_cameras",
    "write_poses",
]
