// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <deque>
#include <memory>

#include "tracking_stub/faults/pose_source.h"

namespace efm {

/// A tracker with latency. A pose of another source is returned when that source has returned a
/// pose that is newer by the latency, or has ended. Stamps do not change.
class PoseLatency : public PoseSource {
 public:
  static constexpr std::int64_t kMaxNs = 10'000'000'000;

  /// @param latency_ns 0 to 10 s.
  PoseLatency(std::unique_ptr<PoseSource> source, std::int64_t latency_ns);

  std::optional<StampedPose> next() override;
  bool ended() const override { return held_.empty() && source_->ended(); }

 private:
  bool isDue() const;

  std::unique_ptr<PoseSource> source_;
  std::int64_t latency_ns_;
  std::deque<StampedPose> held_;  // in order of time
};

}  // namespace efm
