// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/obs/CObservation.h>

#include <cstdint>
#include <string>

namespace efm {

struct Calibration;

/// What was odd about a recording, though it could be read.
struct RecordingCounts {
  std::uint64_t sorted_events = 0;  ///< Came later than a newer one, by up to 10 ms.
};

/// A recording as a stream of observations in the order of time: CObservationEvents and
/// CObservationRobotPose, and whatever else a rawlog holds. A pose comes before the packets that
/// begin at its time or later. Memory does not grow with the length of the recording.
class Recording {
 public:
  virtual ~Recording() = default;

  /// @return nothing at the end.
  /// @throws std::runtime_error naming file and place where it cannot be read on.
  virtual mrpt::obs::CObservation::Ptr next() = 0;

  /// Where the observation that `next` gave last stands, for messages: "entry 12 of my.rawlog".
  virtual std::string place() const = 0;

  /// The share of the input that was read, 0 to 1.
  virtual double progress() const = 0;

  virtual RecordingCounts counts() const { return {}; }
};

/// What is given in place of a recording's own: a folder of text files need not hold it then.
struct RecordingOverrides {
  const Calibration* calibration = nullptr;  ///< Used where the folder has none; may be null.
  bool poses = false;                        ///< They are put in later.
};

}  // namespace efm
