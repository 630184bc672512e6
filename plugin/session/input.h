// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <variant>

#include "mapping/keyframes/mapper_counts.h"
#include "plugin/recordings/streams/sample.h"
#include "plugin/session/choice.h"

namespace efm {

/// Events of a camera are missing until a time on its clock. They come before its next packet.
struct Missing {
  int camera = 0;
  std::int64_t until_ns = 0;
  DropReason reason = DropReason::kOverload;
};

/// The tracker jumped between two poses of a source, which are neighbours.
struct Jump {
  PoseSourceId source;
  std::int64_t before_ns = 0;
  std::int64_t after_ns = 0;
};

/// All clocks went back: what follows is of the new clock.
struct ClockReset {};

/// Options that the caller chose, from data that it has seen before or beside the session.
struct NewOptions {
  Chosen chosen;
  bool follow_depths = false;  ///< The depth limits follow the keyframes: more data will come.
};

/// Input of a session. A break is a value between the data before it and the data behind it. See
/// README.md for the rules of the breaks.
using Input = std::variant<Rig, EventPacket, PoseSample, Missing, Jump, ClockReset, NewOptions>;

}  // namespace efm
