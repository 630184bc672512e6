// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/survey/depth_agreement.h"

#include <algorithm>
#include <utility>

#include "mapping/survey/scene_depths.h"

namespace efm {
namespace {

constexpr double kRigS = 0.05;    // the rig hardly moves
constexpr double kMotionS = 0.5;  // the camera sees parallax
constexpr std::size_t kMinPixels = 200;
constexpr double kWithin = 1.15;

FusionMapperOptions withCamera(FusionMapperOptions options, int camera) {
  options.cameras = {camera};
  return options;
}

/// Appends the ratios of the pixels that both maps have.
void appendRatios(const cv::Mat1f& by_motion_m, const cv::Mat1f& by_rig_m,
                  std::vector<double>& ratios) {
  for (int y = 0; y < by_rig_m.rows; ++y) {
    for (int x = 0; x < by_rig_m.cols; ++x) {
      const double motion_m = by_motion_m(y, x);
      const double rig_m = by_rig_m(y, x);
      if (motion_m > 0 && rig_m > 0) ratios.push_back(motion_m / rig_m);
    }
  }
}

}  // namespace

std::optional<DepthAgreement> depthAgreement(const Rig& rig,
                                             const std::vector<WindowSample>& samples,
                                             const FusionMapperOptions& options) {
  if (selectedCameras(rig, options.cameras).size() < 2) return std::nullopt;
  CoarseSweep rig_sweep(rig, options);
  CoarseSweep motion_sweep(rig, withCamera(options, options.keyframe.reference_camera));
  std::vector<double> ratios;
  for (const WindowSample& sample : samples) {
    const auto by_rig = rig_sweep.map(middleOf(sample, kRigS));
    if (!by_rig) continue;
    const auto by_motion = motion_sweep.map(middleOf(sample, kMotionS));
    // Most peaks at the farthest plane: the camera sees too little parallax.
    if (!by_motion || 2 * by_motion->map.pixels.at_farthest > by_motion->map.pixels.candidates) {
      continue;
    }
    appendRatios(by_motion->map.depth, by_rig->map.depth, ratios);
  }
  if (ratios.size() < kMinPixels) return std::nullopt;
  std::sort(ratios.begin(), ratios.end());
  DepthAgreement agreement;
  agreement.scale = ratios[ratios.size() / 2];
  const auto within = std::count_if(ratios.begin(), ratios.end(), [&](double ratio) {
    return ratio < kWithin * agreement.scale && kWithin * ratio > agreement.scale;
  });
  agreement.agreeing = static_cast<double>(within) / static_cast<double>(ratios.size());
  return agreement;
}

}  // namespace efm
