// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/pose_source_selector.h"

#include <algorithm>
#include <cstdlib>

namespace efm {

std::vector<StampedPose> PoseSourceSelector::add(const PoseSourceId& source,
                                                 const StampedPose& pose) {
  const bool may_be_selected = label_.empty() || source.label == label_;
  if (!selected_ && may_be_selected) {
    waiting_.push_back({source, pose});
    const bool better_may_come = label_.empty() && source.kind != PoseKind::kPose && waits_;
    return better_may_come ? std::vector<StampedPose>{} : select(source);
  }
  if (selected_ && source == *selected_) return {pose};
  ++unused_[source];
  return {};
}

std::vector<StampedPose> PoseSourceSelector::select() {
  waits_ = false;
  if (selected_ || waiting_.empty()) return {};
  const auto best = std::min_element(
      waiting_.begin(), waiting_.end(),
      [](const WaitingPose& a, const WaitingPose& b) { return a.source.kind < b.source.kind; });
  return select(PoseSourceId(best->source));
}

void PoseSourceSelector::limitWaiting(std::int64_t max_age_ns) {
  // A pose with a wrong time must not keep the poses after it.
  while (!waiting_.empty() && std::abs(waiting_.back().pose.t_ns / 2 -
                                       waiting_.front().pose.t_ns / 2) > max_age_ns / 2) {
    waiting_.pop_front();
  }
}

std::optional<std::int64_t> PoseSourceSelector::waitingNs() const {
  return waiting_.empty() ? std::nullopt : std::optional(waiting_.back().pose.t_ns);
}

/// Returns the waiting poses of a source and counts the other poses.
std::vector<StampedPose> PoseSourceSelector::select(const PoseSourceId& source) {
  selected_ = source;
  std::vector<StampedPose> poses;
  for (const WaitingPose& waiting : waiting_) {
    if (waiting.source == source) {
      poses.push_back(waiting.pose);
    } else {
      ++unused_[waiting.source];
    }
  }
  waiting_.clear();
  return poses;
}

}  // namespace efm
