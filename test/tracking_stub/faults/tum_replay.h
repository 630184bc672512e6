// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <vector>

#include "tracking_stub/faults/pose_source.h"

namespace efm {

/// Replays recorded poses in order of time, like a tracker.
class TumReplay : public PoseSource {
 public:
  /// @param poses in any order. Poses of equal time keep their order.
  explicit TumReplay(std::vector<StampedPose> poses);
  /// @throws std::runtime_error as `readTumTrajectory` does.
  explicit TumReplay(const std::filesystem::path& file);

  std::optional<StampedPose> next() override;
  bool ended() const override { return next_ == poses_.size(); }

 private:
  std::vector<StampedPose> poses_;
  std::size_t next_ = 0;
};

}  // namespace efm
