// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "mapping/geometry/timestamp.h"
#include "mapping/keyframes/keyframe_policy.h"

namespace efm {

/// A window starts with the first event after the previous window and grows, stride by stride,
/// until one of two conditions holds:
/// - the reference camera has moved by a fraction of the scene's mean depth since the window's
///   start;
/// - too few points of the last keyframe are in view. Without such points, a grid of points at the
///   mean depth replaces them.
/// So a keyframe has enough parallax at any speed (Rebecq et al., IJCV 2018, Sec. 7).
///
/// If the longest window is not enough, its start moves on by a stride: the events of a camera at
/// rest are in no window.
class BaselinePolicy : public KeyframePolicy {
 public:
  BaselinePolicy(const KeyframePolicyOptions& options, double depth_guess_m);

  std::optional<Window> current(const RecordingProgress& recording) override;
  /// Grows from the end back, stride by stride.
  std::optional<Window> last(const RecordingProgress& recording,
                             std::int64_t end_ns) const override;
  std::int64_t earliestLast(const RecordingProgress& recording) const override {
    return earliestStart(recording) - window_ns_;
  }
  std::int64_t earliestStart(const RecordingProgress& recording) const override;
  void advance(const Window& window, const KeyframeDepthMap* keyframe) override;
  /// Every window has events: none is skipped.
  std::uint64_t advancePast(const RecordingProgress&, std::int64_t) override { return 0; }
  std::uint64_t giveUpBefore(const RecordingProgress& recording, std::int64_t t_ns) override;

 private:
  bool isEnough(const Rigid3& T_world_ref0, const Rigid3& T_world_ref1,
                const ReferenceView& view) const;
  void startAt(std::int64_t t_ns);

  KeyframePolicyOptions options_;
  std::int64_t window_ns_;
  std::int64_t stride_ns_;
  double mean_depth_m_;
  std::vector<Eigen::Vector3d> seen_world_;     // points of the last keyframe
  std::optional<std::int64_t> next_ns_;         // earliest start of the next window
  std::int64_t duration_ns_;                    // the next candidate
  std::int64_t counted_until_ns_ = kMinTimeNs;  // by the windows that were given up
};

}  // namespace efm
