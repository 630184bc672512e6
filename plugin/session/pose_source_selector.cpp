// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/pose_source_selector.h"

#include <algorithm>

#include "mapping/options/quoted_text.h"

namespace efm {

std::string asText(const PoseOrigin& source) {
  switch (source.kind) {
    case PoseKind::kPose:
      return "poses " + inQuotes(source.label);
    case PoseKind::kOdometry:
      return "odometry " + inQuotes(source.label);
    case PoseKind::kActions:
      break;
  }
  return "actions";
}

std::vector<StampedPose> PoseChoice::add(const PoseOrigin& source, const StampedPose& pose) {
  const bool may_be_taken = label_.empty() || source.label == label_;
  if (!chosen_ && may_be_taken) {
    held_.push_back({source, pose});
    const bool waits = label_.empty() && source.kind != PoseKind::kPose && !settled_;
    return waits ? std::vector<StampedPose>{} : choose(source);
  }
  if (chosen_ && source == *chosen_) return {pose};
  ++unused_[source];
  return {};
}

std::vector<StampedPose> PoseChoice::settle() {
  settled_ = true;
  if (chosen_ || held_.empty()) return {};
  const auto best = std::min_element(held_.begin(), held_.end(), [](const Held& a, const Held& b) {
    return a.source.kind < b.source.kind;
  });
  return choose(PoseOrigin(best->source));
}

/// Gives what was held of a source and counts the rest.
std::vector<StampedPose> PoseChoice::choose(const PoseOrigin& source) {
  chosen_ = source;
  std::vector<StampedPose> poses;
  for (const Held& held : held_) {
    if (held.source == source) {
      poses.push_back(held.pose);
    } else {
      ++unused_[held.source];
    }
  }
  held_.clear();
  return poses;
}

}  // namespace efm
