// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/survey/depth_sensitivity.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "mapping/depth/median.h"
#include "mapping/geometry/timestamp.h"
#include "mapping/survey/scene_depths.h"

namespace efm {
namespace {

constexpr std::size_t kMaxWindows = 3;
constexpr std::size_t kMinRatios = 50;
constexpr std::int64_t kClockNs = 5'000'000;  // to either side: 10 ms between them
constexpr double kTravel = 0.05;
constexpr Coarseness kSmallSweep{160, 40'000, 1.5, kNearestSceneM, ExtractionMethod::kAggregated};

/// The median of ln(a / b) over the pixels that both maps have.
std::optional<double> medianLogRatio(const std::optional<KeyframeDepthMap>& a,
                                     const std::optional<KeyframeDepthMap>& b) {
  std::vector<double> logs;
  if (!a || !b) return std::nullopt;
  for (int y = 0; y < a->map.depth.rows; ++y) {
    for (int x = 0; x < a->map.depth.cols; ++x) {
      const double a_m = a->map.depth(y, x);
      const double b_m = b->map.depth(y, x);
      if (a_m > 0 && b_m > 0) logs.push_back(std::log(a_m / b_m));
    }
  }
  if (logs.size() < kMinRatios) return std::nullopt;
  return upperMedian(logs);
}

/// The median of the depths' standard deviations, as fractions of the depth.
double medianSigma(const DepthMap& map) {
  std::vector<double> sigmas;
  for (int y = 0; y < map.depth.rows; ++y) {
    for (int x = 0; x < map.depth.cols; ++x) {
      if (map.depth(y, x) > 0) {
        sigmas.push_back(map.depth(y, x) * std::sqrt(double{map.variance(y, x)}));
      }
    }
  }
  return sigmas.empty() ? 0 : upperMedian(sigmas);
}

}  // namespace

std::optional<DepthSensitivity> depthSensitivity(const Rig& rig,
                                                 const std::vector<WindowSample>& samples,
                                                 const FusionMapperOptions& options) {
  CoarseSweep sweep(rig, options, kSmallSweep);
  std::vector<double> by_clock, by_travel, sigmas;
  const std::size_t count = std::min(kMaxWindows, samples.size());
  for (std::size_t i = 0; i < count; ++i) {
    const WindowSample& sample = samples[(2 * i + 1) * samples.size() / (2 * count)];
    WindowData data = middleOf(sample, options.policy.window_s);
    const auto map = [&](const Trajectory& trajectory) {
      data.trajectory = &trajectory;
      return sweep.map(data);
    };
    const auto shifted = [&](std::int64_t shift_ns) {
      Trajectory moved(options.trajectory);
      for (const StampedPose& pose : sample.trajectory.poses()) {
        moved.add({pose.t_ns + shift_ns, pose.T_world_rig});
      }
      return map(moved);
    };
    const auto clock = medianLogRatio(shifted(-kClockNs), shifted(kClockNs));
    if (clock) by_clock.push_back(std::abs(*clock));
    const auto as_given = map(sample.trajectory);
    if (as_given) sigmas.push_back(medianSigma(as_given->map));
    Trajectory longer(options.trajectory);
    for (StampedPose pose : sample.trajectory.poses()) {
      pose.T_world_rig.translation *= 1 + kTravel;
      longer.add(pose);
    }
    const auto travel = medianLogRatio(map(longer), as_given);
    if (travel) by_travel.push_back(std::abs(*travel) / std::log1p(kTravel));
  }
  if (by_clock.empty() || by_travel.empty() || sigmas.empty()) return std::nullopt;
  return DepthSensitivity{upperMedian(by_clock), 0.01 * upperMedian(by_travel),
                          upperMedian(sigmas)};
}

}  // namespace efm
