// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "mapping/keyframes/keyframe_policy.h"

namespace efm {

/// A window starts with the first event after the one before it and grows, stride by stride, until
/// the reference camera has moved far enough from where it was at the window's start, compared with
/// the scene's mean depth, or has turned away from what it saw: the last keyframe's points, and
/// where there are none a view full of points at the mean depth, at first a guess. So a keyframe
/// has the parallax that depth needs, however fast or slow the motion (Rebecq et al., IJCV 2018,
/// Sec. 7).
///
/// Where the longest window is not enough the start moves on by a stride: events of standing still
/// are in no window.
class BaselinePolicy : public KeyframePolicy {
 public:
  BaselinePolicy(const KeyframePolicyOptions& options, double depth_guess_m);

  std::optional<Window> current(const RecordingProgress& recording) override;
  std::int64_t earliestStart(const RecordingProgress& recording) const override;
  void advance(const Window& window, const KeyframeDepthMap* keyframe) override;
  /// No window is without events.
  std::uint64_t advancePast(const RecordingProgress&, std::int64_t) override { return 0; }

 private:
  bool isEnough(const Rigid3& T_world_ref0, const Rigid3& T_world_ref1,
                const ReferenceView& view) const;
  void startAt(std::int64_t t_ns);

  KeyframePolicyOptions options_;
  std::int64_t window_ns_;
  std::int64_t stride_ns_;
  double mean_depth_m_;
  std::vector<Eigen::Vector3d> seen_world_;  // points of the last keyframe
  std::optional<std::int64_t> next_ns_;      // no window begins before
  std::int64_t grown_ns_;                    // the duration to try next
};

}  // namespace efm
