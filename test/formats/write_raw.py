#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes a dataset folder as RAW files of Prophesee's cameras, with numpy.

    write_raw.py DATASET_FOLDER OUT

Below OUT: KIND/camN.raw, where KIND is evt2, evt21, evt21_legacy and evt3. EVT 2.1 and 3.0 have vectors where the
recording has consecutive events of a row. The order of the events stays.

The clock of EVT 3.0 wraps after 16.8 s and the file does not say how often it has: a recording must begin earlier.
Needs Debian's python3-numpy and python3-yaml.
"""
import pathlib
import sys

import numpy as np

from dataset_folder import cameras_of, read_events, sensor_size

HEADERS = {
    "evt2": "% evt 2.0\n% geometry {0}x{1}\n",
    "evt21": "% evt 2.1\n% format EVT21;endianness=little;height={1};width={0}\n% end\n",
    "evt21_legacy": "% evt 2.1\n% format EVT21;endianness=legacy;height={1};width={0}\n% geometry {0}x{1}\n% end\n",
    "evt3": "% date 2023-03-29 16:37:46\n% evt 3.0\n% format EVT3;height={1};width={0}\n% geometry {0}x{1}\n% end\n",
}
VECTOR = 32


def high_words(high):
    """Each step of the upper bits of the time, and the index of the event before which it stands."""
    steps = np.arange(high[0], high[-1] + 1)
    return steps, np.searchsorted(high, steps)


def merged(parts):
    """Words in the order of (event, place); parts are (events, place, words)."""
    events = np.concatenate([part[0] for part in parts])
    places = np.concatenate([np.full(len(part[0]), part[1]) for part in parts])
    words = np.concatenate([part[2] for part in parts])
    return words[np.lexsort((places, events))]


def vectors(events):
    """The first event of each vector, the number of its events, and its pixels as bits from a multiple of 32 on."""
    new = np.ones(len(events), dtype=bool)
    same = np.ones(len(events) - 1, dtype=bool)
    for values in (events["t"], events["y"], events["p"], events["x"] // VECTOR):
        same &= values[1:] == values[:-1]
    new[1:] = ~(same & (events["x"][1:] > events["x"][:-1]))
    first = np.flatnonzero(new)
    bits = np.add.reduceat(np.uint64(1) << (events["x"] % VECTOR).astype("u8"), first)
    return first, np.diff(np.append(first, len(events))), bits


def evt2(events):
    t = events["t"] // 1000
    steps, before = high_words(t >> 6)
    words = events["p"].astype("i8") << 28 | (t & 63) << 22 | events["x"].astype("i8") << 11 | events["y"]
    return merged([(before, 0, 8 << 28 | steps & 0xFFFFFFF), (np.arange(len(t)), 1, words)]).astype("<u4").tobytes()


def evt21(events, legacy):
    first, _, bits = vectors(events)
    of = events[first]
    t = of["t"] // 1000
    steps, before = high_words(t >> 6)
    upper = of["p"].astype("u8") << np.uint64(28) | (t & 63).astype("u8") << np.uint64(22) \
        | (of["x"] // VECTOR * VECTOR).astype("u8") << np.uint64(11) | of["y"]
    high = np.uint64(8 << 28) | (steps & 0xFFFFFFF).astype("u8")
    words = merged([(before, 0, high << np.uint64(32)), (np.arange(len(t)), 1, upper << np.uint64(32) | bits)])
    halves = words.astype("<u8").view("<u4").reshape(-1, 2)
    return (halves[:, ::-1] if legacy else halves).tobytes()


def evt3(events):
    first, count, bits = vectors(events)
    of = events[first]
    t = of["t"] // 1000
    if t[0] >= 1 << 24:
        raise SystemExit("the recording begins after 16.8 s: its time does not fit EVT 3.0")
    steps, before = high_words(t >> 12)
    index = np.arange(len(t))
    changed = {}
    for name, values in (("t", t), ("y", of["y"])):
        changed[name] = np.ones(len(t), dtype=bool)
        changed[name][1:] = values[1:] != values[:-1]
    single = count == 1
    polarity = of["p"].astype("i8") << 11
    parts = [
        (before, 0, 0x8000 | steps & 0xFFF),
        (index[changed["t"]], 1, (0x6000 | t & 0xFFF)[changed["t"]]),
        (index[changed["y"]], 2, of["y"][changed["y"]].astype("i8")),
        (index[single], 3, (0x2000 | polarity | of["x"])[single]),
        (index[~single], 3, (0x3000 | polarity | of["x"] // VECTOR * VECTOR)[~single]),
    ]
    bits = bits.astype("i8")
    for place, (kind, at, mask) in enumerate(((0x4000, 0, 0xFFF), (0x4000, 12, 0xFFF), (0x5000, 24, 0xFF)), 4):
        parts.append((index[~single], place, (kind | bits >> at & mask)[~single]))
    return merged(parts).astype("<u2").tobytes()


def main(folder, out):
    size = sensor_size(folder)
    writers = {"evt2": evt2, "evt21": lambda events: evt21(events, False),
               "evt21_legacy": lambda events: evt21(events, True), "evt3": evt3}
    for camera, file in enumerate(cameras_of(folder)):
        events = read_events(file)
        for kind, write in writers.items():
            target = pathlib.Path(out) / kind / f"cam{camera}.raw"
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(HEADERS[kind].format(*size).encode() + (write(events) if len(events) else b""))


if __name__ == "__main__":
    main(*sys.argv[1:3])
