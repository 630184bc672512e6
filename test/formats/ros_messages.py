# SPDX-License-Identifier: BSD-3-Clause
"""ROS messages of a dataset folder, as bytes, with struct and numpy: for write_ros1_bag.py and write_ros2_bag.py.

Messages are packed as ROS 1 has them, or in CDR. A message is (log time in ns, bytes).
"""
import struct

import numpy as np

from dataset_folder import cameras_of, read_events, read_poses, sensor_size

PACKET_NS = 4_000_000
HOST_DELAY_NS = 1_000_000
LOG_DELAY_NS = 200_000


def packets_of(events):
    """The events of each period."""
    period = events["t"] // PACKET_NS
    cuts = np.flatnonzero(np.diff(period)) + 1
    return np.split(events, cuts)


class Message:
    """Appends fields; in CDR at multiples of their size."""

    def __init__(self, cdr):
        self.cdr = cdr
        self.data = bytearray()

    def add(self, letter, *values):
        for value in values:
            if self.cdr:
                self.data += bytes(-len(self.data) % struct.calcsize(letter))
            self.data += struct.pack("<" + letter, value)
        return self

    def text(self, text):
        raw = text.encode() + (b"\0" if self.cdr else b"")
        self.add("I", len(raw))
        self.data += raw
        return self

    def header(self, t_ns, sequence):
        if not self.cdr:
            self.add("I", sequence)
        return self.add("I", t_ns // 10**9, t_ns % 10**9).text("camera")

    def bytes(self):
        return (b"\0\1\0\0" if self.cdr else b"") + bytes(self.data)


def event_arrays(events, size, cdr):
    """dvs_msgs/EventArray, prophesee_event_msgs/EventArray."""
    packed = np.dtype([("x", "<u2"), ("y", "<u2"), ("s", "<u4"), ("n", "<u4"), ("p", "u1")])
    # In CDR, the seconds start at a multiple of 4 bytes and each event at a multiple of 2: all events but the first
    # have a gap before the seconds.
    first = np.dtype({"names": packed.names, "formats": [f for f, _ in packed.fields.values()], "offsets": [0, 2, 4, 8, 12],
                      "itemsize": 14})
    others = np.dtype({"names": packed.names, "formats": [f for f, _ in packed.fields.values()], "offsets": [0, 2, 6, 10, 14],
                       "itemsize": 16})
    for sequence, packet in enumerate(packets_of(events)):
        message = Message(cdr).header(int(packet["t"][0]), sequence).add("I", size[1], size[0], len(packet))
        for part, layout in ((packet[:1], first), (packet[1:], others)) if cdr else ((packet, packed),):
            values = np.zeros(len(part), dtype=layout)
            values["x"], values["y"], values["p"] = part["x"], part["y"], part["p"]
            values["s"], values["n"] = part["t"] // 10**9, part["t"] % 10**9
            message.data += values.tobytes()
        if cdr:
            del message.data[-1:]  # no gap after the last event
        yield int(packet["t"][-1]) + LOG_DELAY_NS, message.bytes()


def mono_words(packet):
    delta = (packet["t"] - packet["t"][0]).astype("u8")
    return (packet["p"].astype("u8") << 63 | packet["y"].astype("u8") << 48 | packet["x"].astype("u8") << 32 | delta).astype("<u8")


def evt3_words(packet):
    """TIME_HIGH, TIME_LOW, ADDR_Y where they change and at the beginning, ADDR_X for each event."""
    t_us = packet["t"] // 1000
    words = np.stack([0x8000 | (t_us >> 12 & 0xFFF), 0x6000 | (t_us & 0xFFF), packet["y"].astype("i8"),
                      0x2000 | packet["p"].astype("i8") << 11 | packet["x"]], axis=1)
    new = np.ones(words.shape, dtype=bool)
    new[1:, :3] = words[1:, :3] != words[:-1, :3]
    new[:, 1] |= new[:, 0]
    return words[new].astype("<u2")


def libcaer_words(packet):
    """Polarity, row and column in 32 bits, and the microseconds since the first event."""
    address = packet["x"].astype("u4") << 17 | packet["y"].astype("u4") << 2 | packet["p"].astype("u4") << 1 | 1
    return np.stack([address, (packet["t"] - packet["t"][0]) // 1000], axis=1).astype("<u4")


def libcaer_cmp_words(packet):
    """TIME_HIGH, TIME_LOW, ADDR_X where they change, ADDR_Y for each event; the first event as a vector."""
    t_us = (packet["t"] - packet["t"][0]) // 1000
    words = np.stack([t_us >> 12 & 0xFFF, 0x1000 | (t_us & 0xFFF), 0x2000 | packet["x"].astype("i8"),
                      0x3000 | packet["p"].astype("i8") << 11 | packet["y"]], axis=1)
    new = np.ones(words.shape, dtype=bool)
    new[1:, :3] = words[1:, :3] != words[:-1, :3]
    vector = [0x4000 | int(words[0, 3] & 0xFFF), 0x5001]
    return np.concatenate([words[0, :3], vector, words[new][4:]]).astype("<u2")


WORDS = {"mono": mono_words, "evt3": evt3_words, "libcaer": libcaer_words, "libcaer_cmp": libcaer_cmp_words}


def event_packets(events, size, cdr, encoding):
    """event_camera_msgs/EventPacket. The host stamps packets up to 3 ms late, the first one by 3 ms."""
    for sequence, packet in enumerate(packets_of(events)):
        t_ns = int(packet["t"][0])
        stamp = t_ns + (3 - sequence) % 4 * HOST_DELAY_NS
        words = WORDS[encoding](packet)
        message = Message(cdr).header(stamp, sequence).add("I", size[1], size[0]).add("Q", sequence)
        message.add("Q", 0 if encoding == "evt3" else t_ns).text(encoding).add("B", 0).add("I", words.nbytes)
        message.data += words.tobytes()
        yield max(stamp, int(packet["t"][-1])) + LOG_DELAY_NS, message.bytes()


def pose_messages(poses, cdr):
    """geometry_msgs/PoseStamped."""
    for sequence, (t_ns, numbers) in enumerate(poses):
        yield t_ns + LOG_DELAY_NS, Message(cdr).header(t_ns, sequence).add("d", *numbers).bytes()


# The text of the message definitions, and their MD5 sums in ROS 1.
HEADER_1 = "uint32 seq\ntime stamp\nstring frame_id\n"
HEADER_2 = "builtin_interfaces/Time stamp\nstring frame_id\n"
RULE = "=" * 80 + "\n"


def definition(kind, ros):
    time, header = ("time", "MSG: std_msgs/Header\n" + HEADER_1) if ros == 1 else (
        "builtin_interfaces/Time", "MSG: std_msgs/Header\n" + HEADER_2 + RULE + "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n")
    array = "std_msgs/Header header\nuint32 height\nuint32 width\n{0}/Event[] events\n" + RULE + "MSG: {0}/Event\nuint16 x\nuint16 y\n" + \
        time + " ts\nbool polarity\n" + RULE + header
    point = "float64 x\nfloat64 y\nfloat64 z\n"
    texts = {
        "dvs_msgs/EventArray": array.format("dvs_msgs"),
        "prophesee_event_msgs/EventArray": array.format("prophesee_event_msgs"),
        "event_camera_msgs/EventPacket": "std_msgs/Header header\nuint32 height\nuint32 width\nuint64 seq\nuint64 time_base\n"
        "string encoding\nbool is_bigendian\nuint8[] events\n" + RULE + header,
        "geometry_msgs/PoseStamped": "std_msgs/Header header\ngeometry_msgs/Pose pose\n" + RULE + header + RULE +
        "MSG: geometry_msgs/Pose\ngeometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n" + RULE +
        "MSG: geometry_msgs/Point\n" + point + RULE + "MSG: geometry_msgs/Quaternion\n" + point + "float64 w\n",
    }
    return texts[kind]


MD5 = {
    "dvs_msgs/EventArray": "5e8beee5a6c107e504c2e78903c224b8",
    "prophesee_event_msgs/EventArray": "5e8beee5a6c107e504c2e78903c224b8",
    "event_camera_msgs/EventPacket": "8a6101b351a64529ac77bd8b71074e52",
    "geometry_msgs/PoseStamped": "d3812c3cbc69362b77dc0b19b345f8f5",
}


def recording(folder, kind, encoding, cdr):
    """All messages of a recording in the order of their log times: (log time, topic, type, bytes)."""
    size = sensor_size(folder)
    messages = [(t, "/pose", "geometry_msgs/PoseStamped", data) for t, data in pose_messages(read_poses(folder), cdr)]
    for file in cameras_of(folder):
        events = read_events(file)
        made = event_packets(events, size, cdr, encoding) if encoding else event_arrays(events, size, cdr)
        messages += [(t, f"/{file.parent.name}/events", kind, data) for t, data in made]
    return sorted(messages, key=lambda message: message[0])
