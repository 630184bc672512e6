// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "mapping/events/event_checker.h"
#include "mapping/geometry/timestamp.h"
#include "plugin/recordings/streams/sample.h"

namespace efm {

/// Finds the poses of a host whose times are wrong. Each source has a stream of its own.
///
/// The rule is that of `EventChecker`: a pose that is over 1 s newer than its stream begins a
/// pause, and it waits, as all poses behind it do, until 1 s of them follow in order, or until
/// events of its time have come. If poses come meanwhile that continue the stream before the pause,
/// those that wait are wrong. The session rejects older poses.
class PoseIntake {
 public:
  PoseIntake() = default;
  /// Returns whether the session can use a pose of any time: it is finite, its time is in range.
  static bool isPossible(const PoseSample& pose);
  /// @param pose is possible.
  /// @return the poses that are right, of this call and of earlier ones.
  std::vector<PoseSample> add(PoseSample pose);
  /// Tells the time of a camera's newest event, on the clock of the poses.
  /// @return the poses that it confirms.
  std::vector<PoseSample> noteEvents(std::int64_t t_ns);
  /// Ends the waiting.
  std::vector<PoseSample> finish();

  /// Begins anew, but for the counts: the clock went back.
  void forget() { *this = PoseIntake(wrong_poses_, std::move(first_wrong_)); }

  /// Returns the number of poses with a wrong time, and what is wrong with the first.
  std::uint64_t wrongPoses() const { return wrong_poses_; }
  const std::string& firstWrong() const { return first_wrong_; }

 private:
  PoseIntake(std::uint64_t wrong_poses, std::string first_wrong)
      : wrong_poses_(wrong_poses), first_wrong_(std::move(first_wrong)) {}

  struct Stream {
    EventChecker checker = EventChecker({kFarAheadNs, kFarAheadNs, 10'000});
    std::deque<PoseSample> waiting;
  };
  void confirm(Stream& stream, std::vector<PoseSample>& right);
  void takeSettled(Stream& stream, std::vector<PoseSample>& right);

  std::map<PoseSourceId, Stream> streams_;
  std::int64_t first_event_ns_ = kMaxTimeNs;
  std::int64_t newest_event_ns_ = kMinTimeNs;
  std::uint64_t wrong_poses_ = 0;
  std::string first_wrong_;
};

}  // namespace efm
