// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "mapping/events/event.h"

namespace efm {

/// Events are encoded as bytes that compress well: a byte with the number of the encoding, then
/// columns.
///
/// Encoding 1, little-endian:
///   1 byte: the tick (0: 1 ns, 1: 1 us)
///   8 bytes: the first time in ns
///   the time steps between events in ticks (0, -1, 1, -2, ... as 0, 1, 2, 3, ...), each as a
///   variable-length integer of 7 bits a byte, the low bits first
///   the low bytes of all x, the high bytes of all x, then both for y
///   the polarities, 8 a byte
/// Encoding 2: a Zstandard frame (RFC 8878) of encoding 1 without its first byte.
/// If there are no events, there are no bytes.

enum class EventCompression { kNone, kZstd };

/// Encodes events, which may be in any order of time.
std::vector<std::uint8_t> encodeEvents(const std::vector<Event>& events,
                                       EventCompression compression = EventCompression::kNone);

/// Decodes events. @throws std::runtime_error if the bytes are not exactly `count` encoded events.
std::vector<Event> decodeEvents(const std::vector<std::uint8_t>& bytes, std::size_t count);

}  // namespace efm
