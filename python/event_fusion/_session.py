# SPDX-License-Identifier: BSD-3-Clause
"""Session files: the keyframes that a map is made from."""

from __future__ import annotations

import json
import os
from typing import Any, Iterator

from . import _engine
from ._engine import Keyframe
from ._events import Array, Path


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
