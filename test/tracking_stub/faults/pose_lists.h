// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <deque>
#include <memory>
#include <vector>

#include "mapping/geometry/rigid3.h"
#include "test/tracking_stub/faults/tum_replay.h"
#include "tracking_stub/faults/pose_source.h"

namespace efm {

/// A rig that moves to the right at 0.5 m/s, bobs and rotates. A pose every 10 ms.
inline std::vector<StampedPose> windingWay(int count, std::int64_t first_ns = 1'000'000'000) {
  std::vector<StampedPose> poses;
  for (std::int64_t i = 0; i < count; ++i) {
    const double t_s = 0.01 * static_cast<double>(i);
    Rigid3 T_world_rig;
    T_world_rig.translation = {0.5 * t_s, 0.1 * std::sin(3 * t_s), 0.05 * std::cos(5 * t_s)};
    T_world_rig.rotation = rotationBy({0.2 * std::sin(2 * t_s), 0.3 * t_s, 0.1 * std::cos(t_s)});
    poses.push_back({first_ns + i * 10'000'000, T_world_rig});
  }
  return poses;
}

inline std::vector<StampedPose> allOf(PoseSource& source) {
  std::vector<StampedPose> poses;
  while (const auto pose = source.next()) poses.push_back(*pose);
  EXPECT_TRUE(source.ended());
  return poses;
}

inline std::unique_ptr<PoseSource> replay(const std::vector<StampedPose>& poses) {
  return std::make_unique<TumReplay>(poses);
}

/// Bit for bit.
inline bool sameBits(const Rigid3& a, const Rigid3& b) {
  return a.translation == b.translation && a.rotation.coeffs() == b.rotation.coeffs();
}
inline bool sameBits(const std::vector<StampedPose>& a, const std::vector<StampedPose>& b) {
  if (a.size() != b.size()) return false;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (a[i].t_ns != b[i].t_ns || !sameBits(a[i].T_world_rig, b[i].T_world_rig)) return false;
  }
  return true;
}

/// A tracker without a pose at every second call. It ends a call after its last pose.
class HaltingSource : public PoseSource {
 public:
  explicit HaltingSource(const std::vector<StampedPose>& poses)
      : poses_(poses.begin(), poses.end()) {}

  std::optional<StampedPose> next() override {
    ++calls_;
    if (calls_ % 2 != 0 || poses_.empty()) {
      if (poses_.empty() && calls_ % 2 != 0) ended_ = true;
      return std::nullopt;
    }
    const StampedPose pose = poses_.front();
    poses_.pop_front();
    return pose;
  }
  bool ended() const override { return ended_; }

 private:
  std::deque<StampedPose> poses_;
  int calls_ = 0;
  bool ended_ = false;
};

/// Polls until the source ends.
inline std::vector<StampedPose> polled(PoseSource& source) {
  std::vector<StampedPose> poses;
  for (int calls = 0; !source.ended() && calls < 100'000; ++calls) {
    if (const auto pose = source.next()) poses.push_back(*pose);
  }
  EXPECT_TRUE(source.ended());
  return poses;
}

}  // namespace efm
