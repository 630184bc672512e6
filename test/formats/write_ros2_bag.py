#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes a dataset folder as bags of ROS 2, with sqlite3, lz4 and struct.

    write_ros2_bag.py DATASET_FOLDER OUT

Below OUT:
    dvs/            metadata.yaml and two databases, one after the other: dvs_msgs/EventArray
    mono.db3        event_camera_msgs/EventPacket with mono
    evt3.mcap       event_camera_msgs/EventPacket with evt3: chunks in lz4, with an index
    prophesee.mcap  prophesee_event_msgs/EventArray: messages without chunks and without a summary

Each has /camN/events and /pose. Needs Debian's python3-lz4, python3-numpy and python3-yaml.
"""
import itertools
import pathlib
import sqlite3
import struct
import sys
import zlib

import lz4.frame

import ros_messages as ros

MAGIC = b"\x89MCAP0\r\n"
CHUNK_BYTES = 1 << 20


def ros2_type(kind):
    return kind.replace("/", "/msg/")


def write_db3(path, messages):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.unlink(missing_ok=True)
    database = sqlite3.connect(path)
    database.executescript("""
        PRAGMA synchronous=OFF;
        CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,
            serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);
        CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, data BLOB NOT NULL);
        CREATE INDEX timestamp_idx ON messages (timestamp ASC);""")
    topics = {}
    for t_ns, topic, kind, data in messages:
        if topic not in topics:
            topics[topic] = len(topics) + 1
            database.execute("INSERT INTO topics VALUES (?, ?, ?, 'cdr', '')", (topics[topic], topic, ros2_type(kind)))
        database.execute("INSERT INTO messages(topic_id, timestamp, data) VALUES (?, ?, ?)", (topics[topic], t_ns, data))
    database.commit()
    database.close()


def write_folder(folder, messages):
    half = len(messages) // 2
    files = ["dvs_0.db3", "dvs_1.db3"]
    write_db3(folder / files[0], messages[:half])
    write_db3(folder / files[1], messages[half:])
    with open(folder / "metadata.yaml", "w") as metadata:
        metadata.write("rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: sqlite3\n  relative_file_paths:\n")
        metadata.writelines(f"    - {name}\n" for name in files)
        metadata.write('  compression_format: ""\n  compression_mode: ""\n')


def text(value):
    raw = value if isinstance(value, bytes) else value.encode()
    return struct.pack("<I", len(raw)) + raw


def record(op, content):
    return struct.pack("<BQ", op, len(content)) + content


def channels_of(messages):
    """Records of schemas and channels, and the channel of each topic."""
    records, channels = [], {}
    for _, topic, kind, _ in messages:
        if topic in channels:
            continue
        channel = channels[topic] = len(channels) + 1
        records.append(record(3, struct.pack("<H", channel) + text(ros2_type(kind)) + text("ros2msg") + text(ros.definition(kind, 2))))
        records.append(record(4, struct.pack("<HH", channel, channel) + text(topic) + text("cdr") + text(b"")))
    return b"".join(records), channels


def message_record(channel, sequence, t_ns, data):
    return record(5, struct.pack("<HIQQ", channel, sequence, t_ns, t_ns) + data)


def write_loose_mcap(path, messages):
    records, channels = channels_of(messages)
    with open(path, "wb") as file:
        file.write(MAGIC + record(1, text("ros2") + text("test")) + records)
        for sequence, (t_ns, topic, _, data) in enumerate(messages):
            file.write(message_record(channels[topic], sequence, t_ns, data))
        file.write(record(15, struct.pack("<I", 0)) + record(2, struct.pack("<QQI", 0, 0, 0)) + MAGIC)


def write_chunked_mcap(path, messages, compression="lz4", compress=lz4.frame.compress, checksum=zlib.crc32):
    records, channels = channels_of(messages)
    sizes = itertools.accumulate(len(data) for _, _, _, data in messages)
    chunk_of = [size // CHUNK_BYTES for size in sizes]
    indexes = []
    with open(path, "wb") as file:
        file.write(MAGIC + record(1, text("ros2") + text("test")))
        numbered = zip(chunk_of, itertools.count(), messages)
        for number, members in itertools.groupby(numbered, key=lambda member: member[0]):
            content = bytearray(records if number == chunk_of[0] else b"")
            offsets, times = {}, []
            for _, sequence, (t_ns, topic, _, data) in members:
                offsets.setdefault(channels[topic], []).append((t_ns, len(content)))
                times.append(t_ns)
                content += message_record(channels[topic], sequence, t_ns, data)
            packed = compress(bytes(content))
            span = struct.pack("<QQ", min(times), max(times))
            start = file.tell()
            chunk = record(6, span + struct.pack("<QI", len(content), checksum(content)) + text(compression) + struct.pack("<Q", len(packed)) + packed)
            file.write(chunk)
            index_start = file.tell()
            positions = {}
            for channel, entries in offsets.items():
                positions[channel] = file.tell()
                file.write(record(7, struct.pack("<H", channel) + text(b"".join(struct.pack("<QQ", *entry) for entry in entries))))
            indexes.append(record(8, span + struct.pack("<QQ", start, len(chunk)) +
                                  text(b"".join(struct.pack("<HQ", *entry) for entry in positions.items())) +
                                  struct.pack("<Q", file.tell() - index_start) + text(compression) + struct.pack("<QQ", len(packed), len(content))))
        file.write(record(15, struct.pack("<I", 0)))
        summary_start = file.tell()
        summary = records + b"".join(indexes)
        footer = struct.pack("<BQQQ", 2, 20, summary_start, 0)
        file.write(summary + footer + struct.pack("<I", checksum(summary + footer)) + MAGIC)


def main(folder, out):
    out = pathlib.Path(out)
    out.mkdir(parents=True, exist_ok=True)
    packet = "event_camera_msgs/EventPacket"
    write_folder(out / "dvs", ros.recording(folder, "dvs_msgs/EventArray", None, cdr=True))
    write_db3(out / "mono.db3", ros.recording(folder, packet, "mono", cdr=True))
    write_chunked_mcap(out / "evt3.mcap", ros.recording(folder, packet, "evt3", cdr=True))
    write_loose_mcap(out / "prophesee.mcap", ros.recording(folder, "prophesee_event_msgs/EventArray", None, cdr=True))


if __name__ == "__main__":
    main(*sys.argv[1:3])
