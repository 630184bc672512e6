#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes the fuzzers' first inputs, with the scripts of test/formats: a recording of two cameras with 60 events each.

    write_corpus.py [CORPUS_FOLDER]    default: corpus beside this file
"""
import io
import pathlib
import sqlite3
import struct
import subprocess
import sys
import tempfile

import h5py
import numpy as np
import zstandard

HERE = pathlib.Path(__file__).parent
FORMATS = HERE.parent / "formats"
sys.path.insert(0, str(FORMATS))

import ros_messages as ros
import write_ros2_bag as ros2
from dataset_folder import read_events

zstd = zstandard.ZstdCompressor(level=1).compress


def write_dataset(folder):
    for camera in range(2):
        lines = []
        for i in range(60):
            t_us = 1_000_000 + 700 * (i // 3) + (20_000 if i > 40 else 0)
            lines.append(f"{t_us / 1e6:.9f} {3 * i % 40 + i % 3} {i // 3 % 30 + camera} {i // 6 % 2}\n")
        (folder / f"cam{camera}").mkdir(parents=True)
        (folder / f"cam{camera}/events.txt").write_text("".join(lines))
    (folder / "camchain.yaml").write_text("cam0:\n  resolution: [64, 48]\ncam1:\n  resolution: [64, 48]\n")
    (folder / "poses.txt").write_text("1.0 0 0 0 0 0 0 1\n2.0 0 0 0 0 0 0 1\n")


def run(script, dataset, out):
    subprocess.run([FORMATS / script, dataset, out], check=True)


def write(corpus, name, file, data):
    (corpus / name).mkdir(parents=True, exist_ok=True)
    (corpus / name / file).write_bytes(data)


def write_chunks(path, corpus):
    """Chunks of 500 numbers of two bytes, in each filter of undo_filters.cpp."""
    filters = (dict(compression=32001, compression_opts=(0, 0, 0, 0, 1, 1, 5)), dict(compression="lzf"),
               dict(compression="gzip"), dict(compression="gzip", shuffle=True), dict(compression="lzf", shuffle=True))
    with h5py.File(path, "w") as file:
        for n, options in enumerate(filters):
            numbers = (np.arange(500) * 7 % 346).astype("u2")
            data = file.create_dataset(str(n), data=numbers, chunks=(500,), **options)
            header = bytes([n, 1]) + (numbers.nbytes - 1).to_bytes(2, "little")
            write(corpus, "hdf5_chunks", f"filter{n}", header + data.id.read_direct_chunk((0,))[1])


def write_messages(dataset, corpus):
    """Messages for read_messages.cpp: the type and the serialisation in a byte, then each with its length."""
    events = read_events(dataset / "cam0/events.txt")

    def header(cdr, *frames):
        message = ros.Message(cdr).header(1_500_000_000, 7)
        for frame in frames:
            message.text(frame)
        return message

    def pose(message):
        return [message.add("d", 1, 2, 3, 0, 0, 0.6, 0.8).bytes()] * 2

    for cdr in (False, True):
        packets = {encoding: [data for _, data in ros.event_packets(events, (64, 48), cdr, encoding)] for encoding in ros.WORDS}
        camera = header(cdr).add("I", 48, 64).text("plumb_bob").add("I", 5).add("d", *[0.01] * 5, 50, 0, 32, 0, 50, 24, 0, 0, 1)
        for name, kind, messages in (("array", 0, [data for _, data in ros.event_arrays(events, (64, 48), cdr)]),
                                     *((encoding, 1, packets[encoding]) for encoding in packets),
                                     ("pose", 2, pose(header(cdr))), ("covariance", 3, pose(header(cdr))),
                                     ("odometry", 4, pose(header(cdr, "base"))), ("transform", 5, pose(header(cdr, "base"))),
                                     ("camera_info", 6, [camera.bytes()])):
            data = b"".join(struct.pack("<H", len(message)) + message for message in messages)
            write(corpus, "ros_messages", f"{name}_{'cdr' if cdr else 'ros1'}", bytes([kind << 1 | cdr]) + data)


def write_bags(dataset, scratch, corpus):
    run("write_ros1_bag.py", dataset, scratch / "ros1")
    for bag in (scratch / "ros1").glob("*.bag"):
        write(corpus, "ros1_bag", bag.stem, bag.read_bytes())
    messages = ros.recording(dataset, "event_camera_msgs/EventPacket", "evt3", True)
    file = scratch / "bag"
    ros2.write_loose_mcap(file, messages)
    write(corpus, "mcap", "loose", file.read_bytes())
    # Without checksums, damage reaches the code after the checks.
    for name, compress in (("", bytes), ("lz4", ros2.lz4.frame.compress), ("zstd", zstd)):
        ros2.write_chunked_mcap(file, messages, name, compress, lambda _: 0)
        write(corpus, "mcap", name or "none", file.read_bytes())
    ros2.write_chunked_mcap(file, messages)
    write(corpus, "mcap", "checksums", file.read_bytes())
    ros2.write_db3(file, messages)
    with sqlite3.connect(file) as database:
        database.executescript("PRAGMA page_size=512; VACUUM")
    write(corpus, "db3", "evt3", file.read_bytes())


def write_encodings(events, corpus):
    """Events as plugin/mrpt/event_encoding.h says, without a program of ours."""
    def varint(value):
        return (bytes([value & 127 | 128]) + varint(value >> 7)) if value > 127 else bytes([value])

    for name, tick_ns in (("ns", 1), ("us", 1000)):
        steps = b"".join(varint(int(step) // tick_ns * 2) for step in np.diff(events["t"]))
        columns = bytes([tick_ns > 1]) + struct.pack("<q", events["t"][0]) + steps
        for side in (events["x"], events["y"]):
            columns += (side & 255).astype("u1").tobytes() + (side >> 8).astype("u1").tobytes()
        columns += np.packbits(events["p"].astype("u1"), bitorder="little").tobytes()
        count = struct.pack("<H", len(events))
        write(corpus, "event_encoding", name, count + b"\1" + columns)
        write(corpus, "event_encoding", f"{name}_zstd", count + b"\2" + zstd(columns))


def write_numpy(events, corpus):
    """Arrays as EVIMO2 has them, poses, and events in one array or several."""
    def add(name, save, *arrays, **named):
        file = io.BytesIO()
        save(file, *arrays, **named)
        write(corpus, "numpy", name, file.getvalue())

    poses = np.tile([1, 2, 3, 0, 0, 0.6, 0.8], (20, 1))
    times = np.arange(20) * 0.01
    add("t", np.save, events["t"] * 1e-9)
    add("xy", np.save, np.stack([events["x"], events["y"]], axis=1))
    add("p", np.save, events["p"])
    add("big_endian", np.save, np.arange(20).astype(">i8"))
    add("info", np.savez, K=np.eye(3), D=np.zeros(5))
    add("poses", np.save, np.column_stack([times, poses]))
    add("pose_vectors", np.savez_compressed, t=times, poses=poses.astype("f4"))
    columns = np.array([events["t"] * 1e-9, events["x"], events["y"], events["p"]])
    add("columns", np.save, columns.T)
    add("structured", np.save, events.astype(np.dtype({"names": ["p", "x", "y", "t"], "formats": ["i1", ">u2", "<f4", "<i8"],
                                                       "offsets": [1, 4, 8, 16]})))
    add("arrays", np.savez_compressed, **dict(zip("abcd", columns)))
    add("pose_matrices", np.savez, t_us=(times * 1e6).astype("i8"), T_world_body=np.tile(np.eye(4), (20, 1, 1)))


def main(corpus=HERE / "corpus"):
    corpus = pathlib.Path(corpus)
    with tempfile.TemporaryDirectory() as scratch:
        scratch = pathlib.Path(scratch)
        write_dataset(scratch / "dataset")
        run("write_raw.py", scratch / "dataset", scratch / "raw")
        for kind in ("evt2", "evt21", "evt21_legacy", "evt3"):
            data = (scratch / "raw" / kind / "cam0.raw").read_bytes()
            write(corpus, "raw", kind, data)
            words_at = 0
            while data[words_at:words_at + 2] == b"% ":
                words_at = data.index(b"\n", words_at) + 1
            if kind != "evt21_legacy":
                write(corpus, kind, "words", data[words_at:])
        words = b"".join(struct.pack("<II", 10 * i, i % 320 | i % 180 << 14 | i % 2 << 28) for i in range(50))
        write(corpus, "dat", "words", b"\x0c\x08" + words)
        run("write_aedat4.py", scratch / "dataset", scratch / "aedat4")
        for kind in ("none", "lz4", "zstd"):
            write(corpus, "aedat4", kind, (scratch / "aedat4" / f"{kind}.aedat4").read_bytes())
        write_chunks(scratch / "chunks.h5", corpus)
        write_messages(scratch / "dataset", corpus)
        write_bags(scratch / "dataset", scratch, corpus)
        events = read_events(scratch / "dataset/cam0/events.txt")
        write_encodings(events, corpus)
        write_numpy(events, corpus)


if __name__ == "__main__":
    main(*sys.argv[1:2])
