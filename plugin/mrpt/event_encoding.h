// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "mapping/events/event.h"

namespace efm {

/// Events as bytes that compress well: a byte that says the encoding, then columns.
///
/// Encoding 1: a byte for the tick (0: 1 ns, 1: 1 us); the first time in ns, 8 bytes; the steps
/// from event to event, which are whole numbers of ticks (0, -1, 1, -2, ... as 0, 1, 2, 3,
/// ...), each a variable-length integer of 7 bits a byte, the low ones first; the low bytes of all
/// x, the high bytes, likewise y; the polarities, 8 a byte. Little-endian. No events are no bytes.

/// Any events, in any order of time.
std::vector<std::uint8_t> encodeEvents(const std::vector<Event>& events);

/// @throws std::runtime_error where the bytes are not `count` encoded events, all of them.
std::vector<Event> decodeEvents(const std::vector<std::uint8_t>& bytes, std::size_t count);

}  // namespace efm
