#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes 8-bit PNG files again, smaller: each row as its difference from the row above, packed tightly.

  shrink_png.py FILE...
"""
import pathlib
import struct
import sys
import zlib


def chunks(data):
    position = 8
    while position < len(data):
        length, kind = struct.unpack(">I4s", data[position : position + 8])
        yield kind, data[position + 8 : position + 8 + length]
        position += 12 + length


def paeth(left, up, corner):
    estimate = left + up - corner
    return min((left, up, corner), key=lambda value: abs(estimate - value))


def rows_of(packed, stride, pixel):
    """The rows without their filters (PNG specification, section 9)."""
    above = bytearray(stride)
    for begin in range(0, len(packed), stride + 1):
        kind, row = packed[begin], bytearray(packed[begin + 1 : begin + 1 + stride])
        for i in range(stride if kind else 0):
            left, corner = (row[i - pixel], above[i - pixel]) if i >= pixel else (0, 0)
            up = above[i]
            row[i] = (row[i] + (0, left, up, (left + up) // 2, paeth(left, up, corner))[kind]) & 255
        yield row
        above = row


def shrink(file):
    data = file.read_bytes()
    parts = list(chunks(data))
    width, _, depth, colour = struct.unpack(">IIBB", parts[0][1][:10])
    if depth != 8 or colour not in (0, 2):
        sys.exit(f"shrink_png.py: {file}: expected 8 bits, grey or RGB, not interlaced")
    pixel = 3 if colour == 2 else 1
    packed = zlib.decompress(b"".join(content for kind, content in parts if kind == b"IDAT"))
    above, filtered = bytes(width * pixel), bytearray()
    for row in rows_of(packed, width * pixel, pixel):
        filtered.append(2)
        filtered += bytes((a - b) & 255 for a, b in zip(row, above))
        above = row
    with file.open("wb") as out:
        out.write(data[:8])
        for kind, content in [parts[0], (b"IDAT", zlib.compress(bytes(filtered), 9)), (b"IEND", b"")]:
            out.write(struct.pack(">I", len(content)) + kind + content)
            out.write(struct.pack(">I", zlib.crc32(kind + content)))


for name in sys.argv[1:]:
    shrink(pathlib.Path(name))
