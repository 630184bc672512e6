// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/faults/pose_latency.h"

#include <utility>

#include "mapping/base/named_choice.h"

namespace efm {

PoseLatency::PoseLatency(std::unique_ptr<PoseSource> source, std::int64_t latency_ns)
    : source_(std::move(source)), latency_ns_(latency_ns) {
  requireOption(source_ != nullptr, "source", "none", "given");
  requireOption(latency_ns >= 0 && latency_ns <= kMaxNs, "latency_ns", latency_ns, "0 to 1e10");
}

bool PoseLatency::isDue() const {
  return !held_.empty() && held_.back().t_ns - held_.front().t_ns >= latency_ns_;
}

std::optional<StampedPose> PoseLatency::next() {
  while (!isDue()) {
    const std::optional<StampedPose> pose = source_->next();
    if (!pose) break;
    held_.push_back(*pose);
  }
  if (!isDue() && (held_.empty() || !source_->ended())) return std::nullopt;
  const StampedPose pose = held_.front();
  held_.pop_front();
  return pose;
}

}  // namespace efm
