#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes a dataset folder as AEDAT4 files, with struct and numpy.

    write_aedat4.py DATASET_FOLDER OUT

Below OUT: none.aedat4 (without an index), lz4.aedat4 and zstd.aedat4. Each has all cameras as streams; a stream of
another type stands between them. Needs Debian's python3-numpy, python3-yaml, python3-lz4 and python3-zstandard.
"""
import pathlib
import struct
import sys

import lz4.frame
import numpy as np
import zstandard

from dataset_folder import cameras_of, read_events, sensor_size

PACKET_US = 10_000
VERSION = b"#!AER-DAT4.0\r\n"
EVENT = np.dtype({"names": ["t", "x", "y", "p"], "formats": ["<i8", "<i2", "<i2", "u1"], "offsets": [0, 8, 10, 12],
                  "itemsize": 16})
# An entry of the index as a FlatBuffers table: the distance to its layout, the packet's stream and size, then the
# other fields.
ENTRY = np.dtype([("layout", "<i4"), ("stream", "<i4"), ("size", "<i4"), ("gap", "<i4"), ("byte", "<i8"), ("count", "<i8"),
                  ("first", "<i8"), ("last", "<i8")])
COMPRESSIONS = {
    "none": (0, bytes),
    "lz4": (1, lz4.frame.compress),
    "zstd": (3, zstandard.ZstdCompressor(level=1).compress),
}


def sized(body):
    return struct.pack("<I", len(body)) + body


def root_with_vector(identifier, count, elements):
    """A FlatBuffer whose root table has one field, a vector. The elements begin at byte 32."""
    return sized(struct.pack("<I4s3H2xiII", 16, identifier, 6, 8, 4, 8, 4, count) + elements)


def event_packet(events):
    return root_with_vector(b"EVTS", len(events), events.tobytes())


def header(compression, index, xml):
    text = xml.encode()
    body = struct.pack("<I4s5H2xiiqII", 20, b"IOHE", 10, 20, 4, 8, 16, 12, compression, index, 4, len(text)) + text
    return sized(body + bytes(4 - len(body) % 4))


def index_table(entries):
    layout_at = 32 + 4 * len(entries)
    layout_at += -layout_at % 8
    first_at = layout_at + 16
    table = np.array(entries, dtype=ENTRY)
    at = first_at + ENTRY.itemsize * np.arange(len(entries))
    table["layout"] = at - layout_at
    offsets = (at - (32 + 4 * np.arange(len(entries)))).astype("<u4").tobytes()
    layout = struct.pack("<7H2x", 14, ENTRY.itemsize, 16, 4, 24, 32, 40)
    return root_with_vector(b"FTAB", len(entries), offsets.ljust(layout_at - 32, b"\0") + layout + table.tobytes())


def stream_xml(number, kind, source, size):
    return (f'<node name="{number}" path="/mainloop/Recorder/outInfo/{number}/">'
            f'<attr key="compression" type="string">LZ4</attr><attr key="originalModuleName" type="string">capture</attr>'
            f'<attr key="originalOutputName" type="string">events</attr><attr key="typeIdentifier" type="string">{kind}</attr>'
            f'<node name="info" path="/mainloop/Recorder/outInfo/{number}/info/">'
            f'<attr key="sizeX" type="int">{size[0]}</attr><attr key="sizeY" type="int">{size[1]}</attr>'
            f'<attr key="source" type="string">{source}</attr></node></node>')


def main(folder, out):
    out = pathlib.Path(out)
    out.mkdir(parents=True, exist_ok=True)
    size = sensor_size(folder)
    streams = ""
    packets = []
    for camera, file in enumerate(cameras_of(folder)):
        events = read_events(file)
        values = np.zeros(len(events), dtype=EVENT)
        values["t"] = events["t"] // 1000
        for name in "xyp":
            values[name] = events[name]
        cuts = np.flatnonzero(np.diff(values["t"] // PACKET_US)) + 1
        packets += [(int(part["t"][0]), 2 * camera, part) for part in np.split(values, cuts) if len(part)]
        streams += stream_xml(2 * camera, "EVTS", f"camera{camera}", size)
        streams += stream_xml(2 * camera + 1, "IMUS", f"camera{camera}", size)
    packets.sort(key=lambda packet: packet[:2])
    xml = f'<dv version="2.0"><node name="outInfo" path="/mainloop/Recorder/outInfo/">{streams}</node></dv>'
    for name, (number, compress) in COMPRESSIONS.items():
        data = bytearray(VERSION + header(number, -1, xml))
        entries = []
        for first, stream, events in packets:
            packed = compress(event_packet(events))
            data += struct.pack("<ii", stream, len(packed))
            entries.append((0, stream, len(packed), 0, len(data), len(events), first, int(events["t"][-1])))
            data += packed
            data += struct.pack("<ii", stream + 1, 3) + b"IMU"
        if name != "none":
            begin = VERSION + header(number, len(data), xml)
            data[:len(begin)] = begin
            data += compress(index_table(entries))
        (out / f"{name}.aedat4").write_bytes(data)


if __name__ == "__main__":
    main(*sys.argv[1:3])
