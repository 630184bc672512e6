// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/obs/CObservation.h>

#include <cstdint>
#include <string>
#include <vector>

#include "mapping/base/text.h"

namespace efm {

/// Oddities of a recording that could be read.
struct RecordingCounts {
  std::uint64_t sorted_events = 0;  ///< Came up to 10 ms after a newer one.
  std::uint64_t lost_packets = 0;  ///< Missing in the numbers that the recording gives its packets.
  std::uint64_t undated_events = 0;  ///< Left out: see `EventStream::undatedEvents`.
  std::uint64_t skipped_events = 0;  ///< Bad ones, left out: see `BadEvents`.
  std::string first_skipped;         ///< The error of the first of them.
  std::vector<Warning> warnings;     ///< Of the readers: see `EventStream::warnings`.
};

/// A recording as a stream of observations in the order of time: CObservationEvents,
/// CObservationRobotPose and the other observations of a rawlog. A pose comes before the packets
/// that begin at its time or later. Memory does not grow with the length of the recording.
class Recording {
 public:
  virtual ~Recording() = default;

  /// @return the next observation; null at the end.
  /// @throws std::runtime_error naming the file and the position of an error.
  virtual mrpt::obs::CObservation::Ptr next() = 0;

  /// The position of the last observation that `next` returned: "entry 12 of my.rawlog".
  virtual std::string position() const = 0;

  /// The fraction of the input that was read, 0 to 1.
  virtual double progress() const = 0;

  virtual RecordingCounts counts() const { return {}; }
};

}  // namespace efm
