// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/survey/depth_agreement.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "mapping/depth/peak_fit.h"

namespace efm {
namespace {

constexpr double kRigS = 0.05;    // seconds in which the rig hardly moves
constexpr double kMotionS = 0.5;  // seconds in which the camera sees parallax
constexpr std::size_t kMinPixels = 200;
/// In coarser sweeps a tracker's errors look like a scale.
constexpr Coarseness kFineSweep{240, 100'000};
constexpr double kWithin = 1.15;

/// Appends the ratios of the depths of two maps at the pixels where both have a depth. No ratio if
/// the first map is empty.
void appendRatios(const cv::Mat1f& depth_m, const cv::Mat1f& other_m, std::vector<double>& ratios) {
  for (int y = 0; y < depth_m.rows; ++y) {
    for (int x = 0; x < depth_m.cols; ++x) {
      const double depth = depth_m(y, x);
      const double other = other_m(y, x);
      if (depth > 0 && other > 0) ratios.push_back(depth / other);
    }
  }
}

// Constants of the sensitivity.
constexpr std::size_t kMaxWindows = 3;
constexpr std::size_t kMinDepths = 50;
constexpr std::int64_t kClockNs = 5'000'000;  // shift to either side: 10 ms between the two
constexpr double kTravel = 0.05;
constexpr Coarseness kSmallSweep{160, 20'000, 1.5, kNearestSceneM, ExtractionMethod::kAggregated};

}  // namespace

std::optional<DepthAgreement> depthAgreement(const Rig& rig,
                                             const std::vector<WindowSample>& samples,
                                             const FusionMapperOptions& options) {
  if (selectedCameras(rig, options.cameras).size() < 2) return std::nullopt;
  CoarseSweep rig_sweep(rig, options, kFineSweep);
  FusionMapperOptions reference = options;
  reference.cameras = {options.keyframe.reference_camera};
  CoarseSweep motion_sweep(rig, reference, kFineSweep);
  std::vector<double> ratios;
  for (const WindowSample& sample : samples) {
    const auto by_rig = rig_sweep.map(middleOf(sample, kRigS));
    if (!by_rig) continue;
    const auto by_motion = motion_sweep.map(middleOf(sample, kMotionS));
    // Most peaks lie on the farthest plane: the camera sees too little parallax.
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

std::optional<DepthSensitivity> depthSensitivity(const Rig& rig,
                                                 const std::vector<WindowSample>& samples,
                                                 const FusionMapperOptions& options) {
  CoarseSweep sweep(rig, options, kSmallSweep);
  std::vector<double> by_clock, by_travel, sigmas;  // of the windows
  const std::size_t count = std::min(kMaxWindows, samples.size());
  for (std::size_t i = 0; i < count; ++i) {
    const WindowSample& sample = samples[(2 * i + 1) * samples.size() / (2 * count)];
    WindowData data = middleOf(sample, options.policy.window_s);
    const auto depthsWith = [&](std::int64_t shift_ns, double travel, cv::Mat1f* variance) {
      Trajectory moved(options.trajectory);
      for (const auto& [t_ns, pose] : sample.trajectory.poses()) {
        moved.add({t_ns + shift_ns, {pose.rotation, travel * pose.translation}});
      }
      data.trajectory = &moved;
      const auto keyframe = sweep.map(data);
      if (keyframe && variance) *variance = keyframe->map.variance;
      return keyframe ? keyframe->map.depth : cv::Mat1f();
    };
    cv::Mat1f variance;
    const cv::Mat1f given = depthsWith(0, 1, &variance);
    const cv::Mat1f early = depthsWith(-kClockNs, 1, nullptr);
    const cv::Mat1f late = depthsWith(kClockNs, 1, nullptr);
    if (given.empty() || early.empty() || late.empty()) continue;
    std::vector<double> clock, travel, sigma;  // of the pixels
    appendRatios(early, late, clock);
    for (int y = 0; y < given.rows; ++y) {
      for (int x = 0; x < given.cols; ++x) {
        if (given(y, x) > 0) sigma.push_back(given(y, x) * std::sqrt(double{variance(y, x)}));
      }
    }
    if (std::min(clock.size(), sigma.size()) < kMinDepths) continue;
    by_clock.push_back(std::abs(std::log(upperMedian(clock))));
    sigmas.push_back(upperMedian(sigma));
    if (by_clock.back() < kMinDepthChange) continue;
    appendRatios(depthsWith(0, 1 + kTravel, nullptr), given, travel);
    if (travel.size() < kMinDepths) continue;
    by_travel.push_back(std::abs(std::log(upperMedian(travel))) / std::log1p(kTravel));
  }
  if (sigmas.empty()) return std::nullopt;
  DepthSensitivity sensitivity;
  sensitivity.per_10_ms = upperMedian(by_clock);
  if (!by_travel.empty()) sensitivity.per_percent_travel = 0.01 * upperMedian(by_travel);
  sensitivity.sigma = upperMedian(sigmas);
  return sensitivity;
}

namespace {

// Wider views, more events and finer planes change the result little. The paper's extraction is
// cheaper, and depths are not needed here.
constexpr Coarseness kCoarseness{128, kMaxPieceEvents, 2, kNearestSceneM, ExtractionMethod::kPaper};

/// Returns default options with the cameras, threads and kernel of the map.
FusionMapperOptions sharpnessOptions(const FusionMapperOptions& options) {
  FusionMapperOptions result;
  result.cameras = options.cameras;
  result.keyframe.reference_camera = options.keyframe.reference_camera;
  result.keyframe.sweep.threads = options.keyframe.sweep.threads;
  result.keyframe.sweep.kernel = options.keyframe.sweep.kernel;
  result.keyframe.packets.packet_error_px = 0.1;
  return result;
}

}  // namespace

EventSharpness::EventSharpness(const Rig& rig, const FusionMapperOptions& options)
    : rig_(rig), options_(sharpnessOptions(options)), sweep_(rig, options_, kCoarseness) {}

double EventSharpness::shiftIn(const SamplePiece& piece) const {
  const auto motion = motionIn(piece.along(piece.trajectory), rig_, options_);
  return motion ? motion->shift_m : 0;
}

double EventSharpness::of(const SamplePiece& piece, const Trajectory& trajectory) {
  const auto keyframe = sweep_.map(piece.along(trajectory));
  if (!keyframe) return 0;
  double events = 0;
  for (const std::uint64_t count : keyframe->events) events += static_cast<double>(count);
  if (events == 0) return 0;
  const cv::Mat1f& confidence = keyframe->map.confidence;
  return confidence.dot(confidence) / (events * events);
}

}  // namespace efm
