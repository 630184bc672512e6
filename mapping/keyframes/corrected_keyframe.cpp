// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/keyframes/corrected_keyframe.h"

#include <optional>
#include <utility>

namespace efm {
namespace {

/// The contrast of the fused DSI along its peaks: large where the events of all cameras meet.
double sharpnessOf(const KeyframeDepthMap& keyframe) {
  return keyframe.map.confidence.dot(keyframe.map.confidence);
}

}  // namespace

KeyframeDepthMap mapCorrected(const CorrectedWindow& window, const MapAlong& map_along) {
  const MotionCorrectionOptions& options = window.options;
  KeyframeDepthMap keyframe = map_along(window.tracked, nullptr);
  Trajectory motion = window.tracked;
  for (int round = 0; round < options.motion_rounds; ++round) {
    const VelocityCorrection current = keyframe.motion_correction.value_or(VelocityCorrection{});
    VelocityCorrection correction;
    {
      const StageScope scope(window.stages, Stage::kSweep);
      correction = findCorrection(window.input, motion, keyframe.map.depth, current, options);
    }
    Trajectory corrected = correctedTrajectory(window.tracked, window.input.window, correction);
    KeyframeDepthMap sharper = map_along(corrected, nullptr);
    const double min_gain = keyframe.motion_correction ? 0 : options.min_gain;
    if (!(sharpnessOf(sharper) > (1 + min_gain) * sharpnessOf(keyframe))) break;
    motion = std::move(corrected);
    keyframe = std::move(sharper);
    keyframe.motion_correction = correction;
  }
  if (window.sink == nullptr) return keyframe;
  const std::optional<VelocityCorrection> correction = keyframe.motion_correction;
  keyframe = map_along(motion, window.sink);
  keyframe.motion_correction = correction;
  return keyframe;
}

}  // namespace efm
