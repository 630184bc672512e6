# SPDX-License-Identifier: BSD-3-Clause
"""Arrays of events, times and options."""

from __future__ import annotations

import operator
import os
import sys
from collections.abc import Mapping
from decimal import Decimal, InvalidOperation
from functools import cache
from time import monotonic
from typing import Any, Callable, Union

import numpy as np
import numpy.typing as npt

from . import _engine
from ._engine import EVENT_DTYPE

Array = npt.NDArray[Any]
Path = Union[str, "os.PathLike[str]"]
Options = Union[Mapping[str, Any], Path]
#: True shows a bar of tqdm, or a line where it is not installed. A function gets the activity and the fraction that is done.
Progress = Union[bool, Callable[[str, float], Any]]

_NS_PER = {"s": 1_000_000_000, "ms": 1_000_000, "us": 1_000, "ns": 1}
_TIMES = ("t", "ts", "timestamp")
_POLARITIES = ("p", "polarity")


class EventFusionWarning(UserWarning):
    """A warning of the engine: its name, a colon and its text. The lists ``warnings`` have them, too."""


def ns_per(time_unit: str) -> int:
    if time_unit not in _NS_PER:
        raise ValueError(f"time_unit = {time_unit!r}: expected one of {', '.join(_NS_PER)}")
    return _NS_PER[time_unit]


def whole(name: str, value: Any, what: str = "a whole number") -> int:
    """Return an argument as an int; other types are an error that names it."""
    try:
        return operator.index(value)
    except TypeError:
        raise TypeError(f"{name} = {value!r}: expected {what}, as an int") from None


def column_of(name: str, values: Any) -> Array:
    """Return an argument as an array; values that a mask hides are an error."""
    mask = np.asarray(getattr(values, "mask", False))
    hidden = np.any([mask[field] for field in mask.dtype.names], axis=0) if mask.dtype.names else mask
    if isinstance(values, np.ma.MaskedArray) and hidden.any():
        at = int(np.flatnonzero(hidden)[0])
        raise ValueError(f"{name}[{at}] is masked: expected a value; .compressed() leaves masked ones out")
    return np.asarray(values)


def _polarities(column: Array) -> Array:
    if column.dtype.kind not in "biuf":
        raise TypeError(f"p: {column.dtype}: expected polarities 0 and 1, -1 and 1, or bools")
    if column.dtype.kind != "b":
        wrong = ~np.isin(column, (-1, 0, 1))
        if wrong.any():
            at = int(np.argmax(wrong))
            raise ValueError(f"p[{at}] = {column[at]}: expected polarity 0 or 1, or -1 or 1, or a bool")
    return column > 0


def _pixels(name: str, column: Array) -> Array:
    if column.dtype.kind not in "biuf":
        raise TypeError(f"{name}: {column.dtype}: expected whole numbers")
    if column.dtype.kind in "ub" and column.dtype.itemsize <= 2:
        return column
    fits = (column >= 0) & (column <= 65535)
    if column.dtype.kind == "f":
        fits &= column == np.floor(column)
    if not fits.all():
        wrong = int(np.argmin(fits))
        raise ValueError(f"{name}[{wrong}] = {column[wrong]}: expected a whole number from 0 to 65535")
    return column


def events(x: npt.ArrayLike, y: npt.ArrayLike, p: npt.ArrayLike, t: npt.ArrayLike, time_unit: str = "ns") -> Array:
    """Make an event array of four columns.

    Parameters
    ----------
    x, y : array_like of int, shape (n,)
        Pixels, from 0.
    p : array_like, shape (n,)
        Polarity: 1 or True if the pixel became brighter; 0, -1 or False if darker.
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
        If the lengths differ, a pixel is not in 0 to 65535, a polarity is another number, a value is masked, or the
        unit is unknown.

    Examples
    --------
    >>> events([3], [4], [1], [2.5], time_unit="us")["t"]
    array([2500])
    """
    factor = ns_per(time_unit)
    columns = [column_of(name, column) for name, column in zip("xypt", (x, y, p, t))]
    if len({column.shape for column in columns}) != 1 or columns[0].ndim != 1:
        shapes = ", ".join(str(column.shape) for column in columns)
        raise ValueError(f"x, y, p, t have the shapes {shapes}: expected four columns of one length")
    made = np.empty(len(columns[0]), EVENT_DTYPE)
    made["x"] = _pixels("x", columns[0])
    made["y"] = _pixels("y", columns[1])
    made["p"] = _polarities(columns[2])
    made["t"] = times_in_ns(columns[3], factor)
    return made


def times_in_ns(times: Array, factor: int) -> Array:
    def reject(wrong: Array, expected: str) -> None:
        if wrong.any():
            at = int(np.argmax(wrong))
            raise ValueError(f"t[{at}] = {times[at]}: expected {expected}")

    if times.dtype.kind not in "iuf":
        raise TypeError(f"t: {times.dtype}: expected numbers")
    largest = (2**63 - 1) // factor
    with np.errstate(invalid="ignore"):
        reject(~(np.abs(times.astype(float)) < largest), f"a finite time below {largest:.2g} of its unit")
        if times.dtype.kind == "f" and factor == 1:
            reject(times != np.floor(times), "whole nanoseconds; of seconds: time_unit='s'")
    if times.dtype.kind == "f":
        times, factor = np.rint(times * factor), 1
    ns: Array = times.astype(np.int64, copy=False)
    return ns if factor == 1 else ns * factor


def event_records(array: npt.ArrayLike, time_unit: str = "ns") -> Array:
    """Return a structured array of events as `EVENT_DTYPE`: the same array if it has this layout.

    Other arrays are read by the names of their fields: x, y, p (or polarity) and t (or ts, timestamp).
    """
    records = column_of("events", array)
    if time_unit == "ns" and records.dtype == EVENT_DTYPE:
        return np.ascontiguousarray(records)
    names = records.dtype.names or ()
    if names and records.ndim != 1:
        raise ValueError(f"events of shape {records.shape}: expected one dimension")
    time = next((name for name in _TIMES if name in names), None)
    polarity = next((name for name in _POLARITIES if name in names), None)
    if time is None or polarity is None or "x" not in names or "y" not in names:
        raise TypeError(
            f"events of {records.dtype}: expected a structured array with the fields x, y, p, t; "
            "event_fusion.events makes one of four columns"
        )
    return events(records["x"], records["y"], records[polarity], records[time], time_unit)


def in_unit(records: Array, time_unit: str) -> Array:
    """Return events with their times in another unit: floats for 's', else integers, rounded down."""
    if time_unit == "ns":
        return records
    if time_unit == "s":
        made = np.empty(len(records), [("x", "<u2"), ("y", "<u2"), ("p", "<i2"), ("t", "<f8")])
        for name in "xyp":
            made[name] = records[name]
        made["t"] = records["t"] * 1e-9
        return made
    records["t"] //= ns_per(time_unit)
    return records


def times_in(source: _engine.Source, **times: int | str | None) -> list[int | None]:
    """Return times of a recording as nanoseconds. The argument's names are for errors.

    Integers are nanoseconds; '3.2' is seconds, '+3.2' counts from the first event.
    """
    start = cache(lambda: _engine.first_event(source))
    return [_nanoseconds(name, time, start) for name, time in times.items()]


def _nanoseconds(name: str, time: int | str | None, start: Callable[[], int | None]) -> int | None:
    if time is None:
        return None
    if isinstance(time, (int, np.integer)):
        return int(time)
    try:
        if not isinstance(time, str):
            raise ValueError
        ns = int((Decimal(time) * 10**9).to_integral_value())
    except (InvalidOperation, TypeError, ValueError, OverflowError):
        raise ValueError(f"{name} = {time!r}: expected nanoseconds (int), or seconds as a str: '3.2', '+3.2'") from None
    if not time.strip().startswith("+"):
        return ns
    first = start()
    if first is None:
        raise ValueError(f"{name} = {time!r}: the recording has no event to count from")
    return first + ns


def engine_options(options: Options | None) -> _engine.Options:
    """Return the engine's options of a mapping with keys of the .ini files, or of a file, checked."""
    made = _engine.Options()
    if isinstance(options, (str, os.PathLike)):
        made.read(os.fspath(options))
    elif options is not None and not isinstance(options, Mapping):
        raise TypeError(f"options = {options!r}: expected {{'section.key': value, …}}, or the path of an .ini file")
    else:
        for key, text in option_texts(options or {}).items():
            made.set(key, text)
    made.validate()
    return made


def option_texts(options: Mapping[str, Any]) -> dict[str, str]:
    """Return options with their values as in the .ini files."""
    texts = {}
    for key, value in options.items():
        if isinstance(value, (bool, np.bool_)):
            value = str(value).lower()
        elif isinstance(value, (list, tuple, np.ndarray)):
            value = ",".join(str(part) for part in value)
        texts[key] = str(value)
    return texts


class _Percentage:
    """The progress and the time that remains, where tqdm is not installed: a line, ten lines in a file."""

    def __init__(self, total: float, desc: str, **_: object) -> None:
        self.n, self.desc, self._total, self._begin, self._next = 0.0, desc, total, monotonic(), 0.01
        self._terminal = bool(getattr(sys.stderr, "isatty", bool)())

    def update(self, more: float) -> None:
        self.n += more
        done = self.n / self._total
        if done < (0.01 if self._terminal else self._next):
            return
        self._next = int(10 * done) / 10 + 0.1
        self._print(f"{self.desc}: {done:.0%}, {(monotonic() - self._begin) * (1 / done - 1):.0f} s left ")

    def close(self) -> None:
        if self._terminal:
            self._print(" " * 60)
            self._print("")

    def _print(self, text: str) -> None:
        if sys.stderr is not None:
            print(f"\r{text}" if self._terminal else text, end="" if self._terminal else "\n", file=sys.stderr, flush=True)


class ProgressBar:
    """Calls of the engine, as the progress that a user asked for. A context gives what to call, and closes the bar."""

    def __init__(self, progress: Progress) -> None:
        self._callback = progress if callable(progress) else None
        self._bar: Any = None
        self._make: Any = None
        if progress is True:
            try:
                from tqdm.auto import tqdm

                self._make = tqdm
            except ImportError:
                self._make = _Percentage

    def __call__(self, activity: str, fraction: float) -> None:
        if self._callback is not None:
            self._callback(activity, fraction)
        if self._make is None:
            return
        if self._bar is None or self._bar.desc != activity:
            self.close()
            shown = "{desc}: {percentage:3.0f}%|{bar}| {elapsed}<{remaining}"
            self._bar = self._make(total=100, desc=activity, leave=False, bar_format=shown)
        self._bar.update(100 * fraction - self._bar.n)

    @property
    def callback(self) -> Callable[[str, float], None] | None:
        """What the engine calls; None if nobody gets the progress."""
        return None if self._callback is None and self._make is None else self

    def __enter__(self) -> Callable[[str, float], None] | None:
        return self.callback

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Remove the bar."""
        if self._bar is not None:
            self._bar.close()
            self._bar = None
