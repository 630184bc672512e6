#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes a dataset folder as bags of ROS 1, with rosbag.

    write_ros1_bag.py DATASET_FOLDER OUT

Below OUT:
    dvs.bag            dvs_msgs/EventArray, not compressed
    prophesee_lz4.bag  prophesee_event_msgs/EventArray, lz4
    evt3_bz2.bag       event_camera_msgs/EventPacket with evt3, bz2
    mono.bag           event_camera_msgs/EventPacket with mono, not compressed

Each has /camN/events and /pose. Needs Debian's python3-rosbag, python3-numpy and python3-yaml.
"""
import pathlib
import sys

import genpy
import rosbag
from rosbag import Compression

import ros_messages as ros

BAGS = (
    ("dvs.bag", "dvs_msgs/EventArray", None, Compression.NONE),
    ("prophesee_lz4.bag", "prophesee_event_msgs/EventArray", None, Compression.LZ4),
    ("evt3_bz2.bag", "event_camera_msgs/EventPacket", "evt3", Compression.BZ2),
    ("mono.bag", "event_camera_msgs/EventPacket", "mono", Compression.NONE),
)


def main(folder, out):
    out = pathlib.Path(out)
    out.mkdir(parents=True, exist_ok=True)
    for name, kind, encoding, compression in BAGS:
        types = {k: type("Type", (), {"_type": k, "_md5sum": md5, "_full_text": ros.definition(k, 1)}) for k, md5 in ros.MD5.items()}
        with rosbag.Bag(str(out / name), "w", compression=compression) as bag:
            for t_ns, topic, message_type, data in ros.recording(folder, kind, encoding, cdr=False):
                message = (message_type, data, ros.MD5[message_type], types[message_type])
                bag.write(topic, message, genpy.Time(t_ns // 10**9, t_ns % 10**9), raw=True)


if __name__ == "__main__":
    main(*sys.argv[1:3])
