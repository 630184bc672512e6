# SPDX-License-Identifier: BSD-3-Clause
"""Session files: the keyframes that a map is made from."""

from __future__ import annotations

import json
import os
import tempfile
from typing import Any, Iterator, Sequence

import numpy as np
import numpy.typing as npt

from . import _engine
from ._engine import Keyframe
from ._events import Array, Path, option_texts
from ._recording import write_poses


class Session:
    """The session file of a map, docs/session.md: session.mcap of a result, or the folder that has it.

    The file of a run that is at work, or was killed, has the keyframes so far.

    Parameters
    ----------
    path : path
        The file, or a folder with session.mcap.

    Raises
    ------
    OSError
        If there is no such file, or it is no session file, or of a newer version.
    """

    def __init__(self, path: Path) -> None:
        path = os.fspath(path)
        self._path = os.path.join(path, "session.mcap") if os.path.isdir(path) else path
        self._file = _engine.SessionFile(self._path)
        self.registrations: list[dict[str, Any]] = []  # see `merge`

    def __len__(self) -> int:
        """Return the number of keyframes."""
        return self._file.keyframes

    def keyframe(self, number: int) -> Keyframe:
        """Read a keyframe; the first one is 0, and the last one -1. Pixels without a depth have no confidence."""
        if not -len(self) <= number < len(self):
            raise IndexError(f"keyframe {number} of {len(self)}")
        return self._file.keyframe(number % len(self))

    @property
    def keyframes(self) -> Iterator[Keyframe]:
        """The keyframes in the order of time, read one by one."""
        return (self.keyframe(number) for number in range(len(self)))

    def poses(self, refined: bool = True) -> tuple[Array, Array]:
        """Return times (n,) of the keyframes, nanoseconds, and T_world_ref (n, 4, 4).

        Parameters
        ----------
        refined : bool
            True: the newest poses, which a refinement may have corrected. False: by the tracker.
        """
        return self._file.poses(refined)

    def cloud(
        self,
        *,
        voxel_size_m: float | None = None,
        min_keyframes: int | None = None,
        min_probability: float | None = None,
        box: npt.ArrayLike | None = None,
        options: dict[str, Any] | None = None,
        t0: int | None = None,
        t1: int | None = None,
        refined: bool = True,
    ) -> Array:
        """Make the map again: that of a new run with these options, bit for bit (docs/session.md has the exceptions).

        Parameters
        ----------
        voxel_size_m, min_keyframes, min_probability : float, int, float
            Edge of a voxel, metres; least support; least probability, which can only be raised. Default: as in the run.
        box : array (6,) or (2, 3)
            The lower and the upper corner: only the points inside, metres, world.
        options : dict
            Further options of [map], such as ``{"map.consistency": "visibility"}``.
        t0, t1 : int
            Only the keyframes with t0 <= t_ref < t1, nanoseconds.
        refined : bool
            False: the poses are the tracker's.

        Returns
        -------
        array (n,)
            Structured as `Map.points`: x, y, z (metres, world), intensity, support, sigma (metres), probability.

        Raises
        ------
        ValueError
            If an option is wrong, not one of [map], or min_probability is below that of the run.
        OSError
            If there is no point, or the file cannot be read.
        """
        values = {"voxel_size_m": voxel_size_m, "min_keyframes": min_keyframes}
        chosen: dict[str, Any] = {f"map.{key}": value for key, value in values.items() if value is not None}
        if min_probability is not None:
            chosen["depth.min_probability"] = min_probability
        return self._map({**chosen, **(options or {})}, box, t0, t1, refined).points()

    def export(
        self,
        out: Path,
        options: dict[str, Any] | None = None,
        *,
        box: npt.ArrayLike | None = None,
        t0: int | None = None,
        t1: int | None = None,
        refined: bool = True,
    ) -> None:
        """Write the map again. The ending decides: .pcd, .ply, .html, .simplemap, .mcap, or a folder …colmap.

        A .pcd is made in slabs, so its memory does not grow with the map. The parameters and errors are those of
        `cloud`; an existing file is replaced.
        """
        self._map(options or {}, box, t0, t1, refined).export(os.fspath(out))

    def correct(self, poses: Path | tuple[npt.ArrayLike, npt.ArrayLike]) -> None:
        """Add corrected poses to the file as one more generation; `poses`, `cloud` and `export` use it from now on.

        Parameters
        ----------
        poses : path or (times, matrices)
            A text of poses, a .simplemap, or times (n,), nanoseconds, and matrices (n, 4, 4): T_world_ref at the time of
            each keyframe, as `poses` gives them, or poses of the rig around these times, T_world_rig.

        Raises
        ------
        OSError
            If a keyframe has no pose, or the file cannot be written.
        """
        with tempfile.TemporaryDirectory() as folder:
            if isinstance(poses, tuple):
                file = os.path.join(folder, "poses.txt")
                write_poses(file, poses)
            else:
                file = os.fspath(poses)
                if not file:
                    raise ValueError("poses = '': expected the name of a file, or (times, matrices)")
            self._map({}, None, None, None, True, poses=file).store_poses()
        self._file = _engine.SessionFile(self._path)

    def merge(
        self,
        others: Sequence[Session],
        out: Path,
        *,
        transforms: Sequence[npt.ArrayLike] = (),
        register: bool = False,
        refined: bool = True,
    ) -> Session:
        """Write one session with the keyframes of this one and of others, without mapping.

        Parameters
        ----------
        others : sequence of Session
            Their keyframes follow; the options are those of this session.
        out : path
            The new file, .mcap.
        transforms : sequence of (4, 4)
            T_first_this of the others, in their order; none: the identity.
        register : bool
            Correct the transforms by what the keyframes see: about 5 % of the scene's depth, and 3 degrees.
        refined : bool
            False: the poses are the tracker's.

        Returns
        -------
        Session
            The new one. Its `registrations` tell for each of the others T_first_this, how far it moved (moved_m,
            moved_deg), the standard deviations (sigma_m, sigma_deg), and how many pairs of keyframes agree.

        Raises
        ------
        OSError
            If a session cannot be registered, or a file cannot be written.
        """
        if not str(os.fspath(out)).endswith(".mcap"):
            raise ValueError(f"out = {os.fspath(out)!r}: expected the name of a session, .mcap")
        made = self._map({}, None, None, None, refined, others=others, transforms=transforms, registers=register)
        made.export(os.fspath(out))
        merged = Session(out)
        merged.registrations = made.registrations
        return merged

    def _map(
        self,
        options: dict[str, Any],
        box: npt.ArrayLike | None,
        t0: int | None,
        t1: int | None,
        refined: bool,
        poses: str = "",
        others: Sequence[Session] = (),
        transforms: Sequence[npt.ArrayLike] = (),
        registers: bool = False,
    ) -> _engine.SessionMap:
        if len(transforms) > len(others):
            raise ValueError(f"{len(transforms)} transforms: expected at most one for each of the {len(others)} others")
        sets = [f"{key}={text}" for key, text in option_texts(options).items()]
        corners = None if box is None else np.asarray(box, dtype=float)
        if corners is not None and corners.shape not in ((6,), (2, 3)):
            raise ValueError(f"box of shape {corners.shape}: expected six numbers, or two corners: (6,) or (2, 3)")
        paths = [self._path, *(other._path for other in others)]
        values = None if corners is None else corners.ravel().tolist()
        return _engine.SessionMap(paths, sets, t0, t1, values, refined, poses, list(transforms), registers)

    @property
    def run(self) -> dict[str, Any]:
        """How the map was made: options as given and as used, what was chosen, cameras, files of the recording."""
        run: dict[str, Any] = json.loads(self._file.run)
        return run

    @property
    def report(self) -> dict[str, Any] | None:
        """The content of report.json; None if the run did not end."""
        report: dict[str, Any] | None = json.loads(self._file.report or "null")
        return report

    @property
    def damage(self) -> str:
        """Why the end of the file is not used; empty if the file is whole."""
        return self._file.damage

    def __repr__(self) -> str:
        return f"<Session {self._path}: {len(self)} keyframes{'' if self._file.report else ', not finished'}>"
