// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "tracking_stub/faults/pose_source.h"
#include "tracking_stub/random/random_numbers.h"

namespace efm {

/// A time interval [begin, end).
struct TimeGap {
  std::int64_t begin_ns = 0;
  std::int64_t end_ns = 0;
};

struct PoseDropoutOptions {
  double drop_probability = 0;  ///< Of each pose, 0 to 1.
  std::vector<TimeGap> gaps;    ///< All poses in these are lost. In any order.
  double random_gaps_hz = 0;    ///< Random gaps per second of tracking, 0 or more.
  double random_gap_s = 0.5;    ///< Length of a random gap, above 0.
  std::uint64_t seed = 0;

  bool any() const { return drop_probability > 0 || !gaps.empty() || random_gaps_hz > 0; }
  void validate() const;
};

/// A tracker that fails at times: another source without the lost poses.
class PoseDropouts : public PoseSource {
 public:
  PoseDropouts(std::unique_ptr<PoseSource> source, const PoseDropoutOptions& options);

  std::optional<StampedPose> next() override;
  bool ended() const override { return source_->ended(); }

  /// Number of lost poses.
  std::size_t dropped() const { return dropped_; }

 private:
  bool isLost(const StampedPose& pose);
  bool isInRandomGap(std::int64_t t_ns);

  std::unique_ptr<PoseSource> source_;
  PoseDropoutOptions options_;
  RandomNumbers single_;  // each kind has its own stream: one option does not change the other
  RandomNumbers gap_;
  std::optional<TimeGap> next_gap_;  // the current or the next random gap
  std::size_t dropped_ = 0;
};

}  // namespace efm
