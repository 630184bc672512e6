// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/obs/CObservation.h>

#include <cstddef>
#include <cstdint>
#include <exception>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "plugin/recordings/open/merged_recording.h"

namespace efm {

/// Plays a recording on the caller's clock: returns each observation once, when its time has come,
/// as a live sensor would. A packet's time is that of its last event, since a camera cannot send it
/// earlier; an empty packet's is its stamp. A pose's time is its stamp and the tracker's latency.
/// Other observations go with those around them.
///
/// It reads no further ahead than the packet that is next, so memory does not grow, however late
/// the caller is: the rest stays in the file.
class RecordingPlayer {
 public:
  /// Reads to the first packet of events.
  /// @param pose_latency_ns of CObservationRobotPose, from 0.
  /// @throws std::runtime_error where the recording has no packet, or at an error before it.
  explicit RecordingPlayer(std::unique_ptr<Recording> recording, std::int64_t pose_latency_ns = 0);

  /// The time of the first packet on the recording's clock. The play begins there: older poses
  /// are late at once.
  std::int64_t startNs() const { return start_ns_; }

  /// The observations whose time has come, in the order of these times; of equal times in the
  /// recording's order.
  /// @param now_ns on the recording's clock.
  /// @param max_count further ones wait for the next call.
  /// @throws the recording's error, once all observations before it were returned.
  std::vector<mrpt::obs::CObservation::Ptr> observationsUntil(std::int64_t now_ns,
                                                              std::size_t max_count);

  /// When the next observation comes, as far as it was read; nothing where none waits.
  std::optional<std::int64_t> nextNs() const {
    return waiting_.empty() ? std::nullopt : std::optional(waiting_.begin()->first);
  }
  /// Whether all observations were returned and the recording has no error.
  bool ended() const { return read_all_ && !error_ && waiting_.empty(); }
  /// The longest time from an observation's time to the call that returned it, on the recording's
  /// clock.
  std::int64_t maxDelayNs() const { return max_delay_ns_; }
  std::uint64_t returned() const { return returned_; }
  RecordingCounts counts() const { return recording_->counts(); }

 private:
  void readOne();
  void take(const mrpt::obs::CObservation::Ptr& observation);

  std::unique_ptr<Recording> recording_;
  std::int64_t pose_latency_ns_;
  std::int64_t start_ns_ = 0;
  std::int64_t read_until_ns_;  // nothing that was not read yet begins before it
  /// By the time at which they come.
  std::multimap<std::int64_t, mrpt::obs::CObservation::Ptr> waiting_;
  bool read_all_ = false;
  std::exception_ptr error_;  // the error that ended the recording
  std::int64_t max_delay_ns_ = 0;
  std::uint64_t returned_ = 0;
};

/// Moves all times of an observation: its stamp, and a packet's events and covered time.
/// @param shift_ns a multiple of MRPT's tick, so that poses and events keep their distance.
void shiftTimes(mrpt::obs::CObservation& observation, std::int64_t shift_ns);

}  // namespace efm
