// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "mapping/geometry/timestamp.h"
#include "mapping/geometry/trajectory.h"
#include "plugin/recordings/streams/sample.h"

namespace efm {

/// Longest wait for a better source, from the begin of the first packet of events on.
inline constexpr std::int64_t kMaxSourceWaitNs = kNanosecondsPerSecond;

/// Selects the poses of one source and counts the poses of other sources. The poses of two sources
/// are never mixed: they refer to different worlds, or one source is worse.
///
/// The source of the best kind is used; of two sources of a kind, the first one. A pose of the best
/// kind selects its source at once. Poses of other kinds wait until `select`, because a better
/// source may still come.
class PoseSourceSelector {
 public:
  /// @param label the source's label; empty: the best source.
  explicit PoseSourceSelector(std::string label) : label_(std::move(label)) {}

  /// @return the poses to use from now on, in the order of arrival.
  std::vector<StampedPose> add(const PoseSourceId& source, const StampedPose& pose);
  /// Selects the best source so far and does not wait any longer. @return as `add`.
  std::vector<StampedPose> select();
  /// Forgets waiting poses that are older than the last one by more than this.
  void limitWaiting(std::int64_t max_age_ns);
  void forgetWaiting() { waiting_.clear(); }
  /// Returns the time of the last waiting pose; std::nullopt if none waits.
  std::optional<std::int64_t> waitingNs() const;

  const std::optional<PoseSourceId>& selected() const { return selected_; }
  /// Returns the number of unused poses of each other source.
  const std::map<PoseSourceId, std::uint64_t>& unused() const { return unused_; }

 private:
  struct WaitingPose {
    PoseSourceId source;
    StampedPose pose;
  };

  std::vector<StampedPose> select(const PoseSourceId& source);

  std::string label_;
  std::optional<PoseSourceId> selected_;
  bool waits_ = true;  // true while a better source may come
  std::deque<WaitingPose> waiting_;
  std::map<PoseSourceId, std::uint64_t> unused_;
};

}  // namespace efm
