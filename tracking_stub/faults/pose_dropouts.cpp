// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/faults/pose_dropouts.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "mapping/base/named_choice.h"
#include "mapping/geometry/timestamp.h"

namespace efm {

void PoseDropoutOptions::validate() const {
  requireOption(drop_probability >= 0 && drop_probability <= 1, "drop_probability",
                drop_probability, "0 to 1");
  requireOption(random_gaps_hz >= 0 && std::isfinite(random_gaps_hz), "random_gaps_hz",
                random_gaps_hz, "0 or more");
  requireOption(random_gap_s > 0 && random_gap_s <= 1e6, "random_gap_s", random_gap_s,
                "above 0, at most 1e6");
  for (const TimeGap& gap : gaps) {
    requireOption(gap.begin_ns < gap.end_ns, "end of a gap", gap.end_ns, "after its begin");
  }
}

PoseDropouts::PoseDropouts(std::unique_ptr<PoseSource> source, const PoseDropoutOptions& options)
    : source_(std::move(source)),
      options_(options),
      single_(options.seed, 0),
      gap_(options.seed, 1) {
  requireOption(source_ != nullptr, "source", "none", "given");
  options_.validate();
}

std::optional<StampedPose> PoseDropouts::next() {
  while (std::optional<StampedPose> pose = source_->next()) {
    if (!isLost(*pose)) return pose;
    ++dropped_;
  }
  return std::nullopt;
}

bool PoseDropouts::isLost(const StampedPose& pose) {
  // Drawn for every pose, lost or not: a further gap does not change the loss of other poses.
  const bool alone = single_.uniform() < options_.drop_probability;
  const bool in_gap = std::any_of(
      options_.gaps.begin(), options_.gaps.end(),
      [&pose](const TimeGap& gap) { return pose.t_ns >= gap.begin_ns && pose.t_ns < gap.end_ns; });
  return isInRandomGap(pose.t_ns) || in_gap || alone;
}

bool PoseDropouts::isInRandomGap(std::int64_t t_ns) {
  if (options_.random_gaps_hz == 0) return false;
  const auto gap_after = [this](std::int64_t from_ns) {
    constexpr double kMaxWaitS = 1e9;  // longer than any recording; sums fit 64 bits
    const double wait_s = -std::log(1 - gap_.uniform()) / options_.random_gaps_hz;
    const std::int64_t begin_ns = from_ns + durationFromSeconds(std::min(wait_s, kMaxWaitS));
    return TimeGap{begin_ns, begin_ns + durationFromSeconds(options_.random_gap_s)};
  };
  if (!next_gap_) next_gap_ = gap_after(t_ns);
  while (t_ns >= next_gap_->end_ns) next_gap_ = gap_after(next_gap_->end_ns);
  return t_ns >= next_gap_->begin_ns;
}

}  // namespace efm
