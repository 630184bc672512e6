// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/survey/option_choice.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "mapping/base/text.h"
#include "mapping/depth/peak_fit.h"
#include "mapping/geometry/timestamp.h"

namespace efm {
namespace {

/// Longer windows have more parallax, but also more tracker drift.
constexpr double kMaxWindowS = 1;
/// If a scene has less parallax, a longer window is tried: the depths are mostly noise.
constexpr double kProvenPx = 2;
/// If no window has this parallax, the farthest depth that the parallax can show is assumed.
constexpr double kMinProvenPx = 1;
/// If a scene has less parallax, its windows are made longer.
constexpr double kWantedPx = 2;

double parallaxBetween(const DepthPlanesOptions& limits, double parallax_px_m) {
  return parallax_px_m * (1 / limits.min_depth_m - 1 / limits.max_depth_m);
}

/// The values of a choice so far, and their reasons.
class Choice {
 public:
  Choice(const AutomaticOptions& automatic, FusionMapperOptions& options)
      : automatic_(automatic), options_(options) {}

  void window(double window_s, const std::string& reason) {
    set(automatic_.window_s, "window_s", options_.policy.window_s, window_s, reason);
    set(automatic_.stride_s, "stride_s", options_.policy.stride_s, options_.policy.window_s / 2,
        "half of the window");
  }
  void depths(double min_m, double max_m, const std::string& reason) {
    DepthPlanesOptions& planes = options_.keyframe.planes;
    // A limit that is given bounds the other limit.
    if (!automatic_.max_depth_m) min_m = std::min(min_m, planes.max_depth_m / 2);
    if (!automatic_.min_depth_m) max_m = std::max(max_m, planes.min_depth_m * 2);
    set(automatic_.min_depth_m, "min_depth_m", planes.min_depth_m, min_m, reason);
    set(automatic_.max_depth_m, "max_depth_m", planes.max_depth_m, max_m, reason);
  }
  void planes(int count, const std::string& reason) {
    set(automatic_.num_planes, "num_planes", options_.keyframe.planes.num_planes, count, reason);
  }
  /// Leaves all values but the depth limits as they are: no scene is known.
  OptionChoice withoutScene(double min_m, double max_m, const std::string& reason) {
    if (!options_.only_window) {
      const KeyframePolicyOptions& policy = options_.policy;
      set(automatic_.window_s, "window_s", options_.policy.window_s, policy.window_s, reason);
      set(automatic_.stride_s, "stride_s", options_.policy.stride_s, policy.stride_s, reason);
    }
    const DepthPlanesOptions& planes = options_.keyframe.planes;
    depths(min_m, max_m, reason);
    this->planes(planes.num_planes, reason);
    return {take(), false, (planes.num_planes - 1) / parallaxBetween(planes, 1)};
  }
  void voxel(double size_m, const std::string& reason) {
    chosen_.push_back({"voxel_size_m", size_m, reason});
  }
  std::vector<ChosenOption> take() { return std::move(chosen_); }

 private:
  template <typename Value>
  void set(bool automatic, const char* key, Value& field, Value value, const std::string& reason) {
    if (!automatic) return;
    field = value;
    chosen_.push_back({key, static_cast<double>(value), reason});
  }

  const AutomaticOptions& automatic_;
  FusionMapperOptions& options_;
  std::vector<ChosenOption> chosen_;
};

std::string number(double value) {
  NumberText text(3);
  text << value;
  return text.str();
}

/// Returns the value with `digits` significant digits, for people to read, rounded down.
double roundedDown(double value, int digits) {
  const double unit = std::pow(10.0, std::floor(std::log10(value)) - digits + 1);
  return std::floor(value / unit * (1 + 1e-9)) * unit;
}
double roundedUp(double value, int digits) {
  const double unit = std::pow(10.0, std::floor(std::log10(value)) - digits + 1);
  return std::ceil(value / unit * (1 - 1e-9)) * unit;
}

ReferenceView viewOf(const Rig& rig, const FusionMapperOptions& options) {
  const auto reference = static_cast<std::size_t>(options.keyframe.reference_camera);
  return makeReferenceView(rig.cameras.at(reference).model, options.keyframe.view);
}

/// Returns the longest window in which most of the view stays in sight, seconds.
double motionLimit(const std::vector<WindowSample>& samples, const Rig& rig,
                   const FusionMapperOptions& options, const SceneDepths& depths, double max_s) {
  // The view may move by this fraction of its width to either side.
  constexpr double kMaxMove = 0.2;
  constexpr double kMinWindowS = 0.01;
  const ReferenceView view = viewOf(rig, options);
  const auto moveOf = [&](const ViewMotion& motion) {
    return (motion.shift_m * depths.median() + motion.rotation_rad) * view.fx / view.width;
  };
  double window_s = max_s;
  for (; window_s > kMinWindowS; window_s /= 1.25) {
    std::vector<double> moves;
    for (const WindowSample& sample : samples) {
      const auto motion = motionIn(middleOf(sample, window_s), rig, options);
      if (motion) moves.push_back(moveOf(*motion));
    }
    if (moves.empty() || upperMedian(moves) <= kMaxMove) break;
  }
  return window_s < max_s ? roundedDown(window_s, 1) : max_s;
}

/// Returns the parallax of a unit of inverse depth in a typical window, pixels per 1/m.
double parallaxIn(const std::vector<WindowSample>& samples, double window_s, const Rig& rig,
                  const FusionMapperOptions& options) {
  std::vector<double> parallaxes;
  for (const WindowSample& sample : samples) {
    const auto motion = motionIn(middleOf(sample, window_s), rig, options);
    if (motion) parallaxes.push_back(motion->parallax_px_m);
  }
  return parallaxes.empty() ? 0 : upperMedian(parallaxes);
}

/// Returns the duration of the longest sample, seconds.
double longestOf(const std::vector<WindowSample>& samples) {
  double longest_s = 0;
  for (const WindowSample& sample : samples) {
    longest_s = std::max(longest_s, secondsBetween(sample.window.t0_ns, sample.window.t1_ns));
  }
  return longest_s;
}

void chooseWindow(const std::vector<WindowSample>& samples, const Rig& rig,
                  const FusionMapperOptions& options, const SceneDepths& depths,
                  std::optional<double> duration_s, Choice& choice) {
  constexpr double kShortS = 0.5;  // a recording up to this length is one window
  const double by_motion_s = motionLimit(samples, rig, options, depths, kMaxWindowS);
  const double by_length_s =
      duration_s ? std::max(*duration_s / 4, std::min(*duration_s, kShortS)) : by_motion_s;
  double window_s = by_motion_s;
  std::string reason = by_motion_s < kMaxWindowS
                           ? "the longest in which most of the view stays in sight"
                           : "the longest that is chosen: the view moves slowly";
  if (0 < by_length_s && by_length_s < by_motion_s) {
    window_s = roundedDown(by_length_s, 2);
    reason = "the recording lasts " + number(*duration_s) + " s";
  }
  const auto parallax = [&] {
    return parallaxIn(samples, window_s, rig, options) * depths.median();
  };
  if (parallax() < kWantedPx) {
    reason =
        "the parallax is small, " + number(parallax()) + " pixels in " + number(window_s) + " s";
    const double whole_s = std::min(longestOf(samples), duration_s.value_or(longestOf(samples)));
    const double longest_s = motionLimit(samples, rig, options, depths, whole_s);
    while (window_s < longest_s && parallax() < kWantedPx) {
      window_s = std::min(1.1 * window_s, longest_s);
    }
    window_s = roundedDown(window_s, 2);
  }
  choice.window(window_s, reason);
}

void chooseDepths(const SceneDepths& depths, double parallax_px_m, Choice& choice) {
  const InverseRange scene = denseRange(depths);
  const InverseRange limits = limitsAround(scene);
  double max_m = 1 / limits.far;
  std::string reason =
      "the scene lies at " + number(1 / scene.near) + " to " + number(1 / scene.far) + " m";
  // The depth at which a quarter of a pixel of parallax is a tenth of the depth. It matters for a
  // single camera that moves little.
  const double accurate_m = 0.1 / 0.25 * parallax_px_m;
  double most_m = std::max(accurate_m, 2 / depths.median());
  // A limit right before the scene's far end would collect the depths of that end.
  if (1 / scene.far < 1.1 * most_m) most_m = std::max(most_m, 1.25 / scene.far);
  if (accurate_m < max_m) {
    max_m = std::min(max_m, most_m);
    reason += ", and the parallax is too small for larger depths";
  }
  const double min_m = std::max(roundedDown(1 / limits.near, 2), kMinDepthM);
  choice.depths(min_m, std::max(roundedUp(max_m, 2), 2 * min_m), reason);
}

void addFarthest(SceneDepths& depths) {
  depths.inverse.insert(depths.inverse.end(), depths.farthest.begin(), depths.farthest.end());
  std::sort(depths.inverse.begin(), depths.inverse.end());
}

}  // namespace

void fitAutomatic(const AutomaticOptions& automatic, FusionMapperOptions& options) {
  constexpr double kDepthRatio = 10;
  DepthPlanesOptions& planes = options.keyframe.planes;
  const bool contradict = !(planes.max_depth_m > planes.min_depth_m);
  if (contradict && automatic.max_depth_m) {
    planes.max_depth_m = kDepthRatio * planes.min_depth_m;
  } else if (contradict && automatic.min_depth_m) {
    // A valid limit: an error must be about the limit that was given.
    planes.min_depth_m = std::max(planes.max_depth_m / kDepthRatio, kMinDepthM);
  }
  KeyframePolicyOptions& policy = options.policy;
  if (automatic.stride_s) policy.stride_s = std::min(policy.stride_s, policy.window_s);
  if (automatic.window_s) policy.window_s = std::max(policy.stride_s, policy.window_s);
}

int automaticPlanes(const DepthPlanesOptions& limits, double parallax_px_m) {
  constexpr double kFinestPx = 0.1;
  constexpr double kFewest = 25;
  constexpr double kUsual = 100;
  constexpr double kMost = 400;
  const double range_px = parallaxBetween(limits, parallax_px_m);
  const double at_least = std::clamp(1 + std::ceil(range_px / kFinestPx), kFewest, kUsual);
  return static_cast<int>(std::clamp(1 + std::ceil(range_px), at_least, kMost));
}

FusionMapperOptions surveyOptions(FusionMapperOptions options, double window_s) {
  options.policy = {};
  options.policy.window_s = window_s;
  options.policy.stride_s = window_s;
  options.only_window.reset();
  return options;
}

OptionChoice chooseOptions(const AutomaticOptions& automatic, const Rig& rig,
                           const std::vector<WindowSample>& samples,
                           std::optional<double> duration_s, FusionMapperOptions& options) {
  Choice choice(automatic, options);
  const DepthPlanesOptions given = options.keyframe.planes;
  if (samples.empty()) {
    return choice.withoutScene(given.min_depth_m, given.max_depth_m,
                               "the default: no event has a pose");
  }
  Coarseness coarseness;
  if (!automatic.min_depth_m) {
    coarseness.nearest_m = std::min(coarseness.nearest_m, given.min_depth_m);
  }
  CoarseSweep sweep(rig, options, coarseness);
  // Longer windows have more parallax; shorter windows keep the view.
  SceneDepths depths;
  const double longest_s = longestOf(samples);
  for (const double window_s : {0.2, 0.5, 1.0, 2.0}) {
    SceneDepths seen = sceneDepths(sweep, samples, window_s);
    const bool enough = seen.inverse.size() >= kMinScenePoints;
    if (enough && seen.parallax_px >= depths.parallax_px) depths = std::move(seen);
    if ((enough && depths.parallax_px >= kProvenPx) || window_s >= longest_s) break;
  }
  const bool is_proven = depths.parallax_px >= kMinProvenPx;
  if (!is_proven) addFarthest(depths);
  if (depths.inverse.size() < kMinScenePoints) {
    return choice.withoutScene(given.min_depth_m, given.max_depth_m,
                               "the default: a coarse sweep found no scene");
  }
  if (!options.only_window) chooseWindow(samples, rig, options, depths, duration_s, choice);
  const auto& window = options.only_window;
  const double window_s =
      window ? secondsBetween(window->t0_ns, window->t1_ns) : options.policy.window_s;
  const double parallax_px_m = parallaxIn(samples, window_s, rig, options);
  depths = sceneDepths(sweep, samples, window_s);
  if (!is_proven) addFarthest(depths);
  if (!depths.inverse.empty()) chooseDepths(depths, parallax_px_m, choice);
  const DepthPlanesOptions& planes = options.keyframe.planes;
  choice.planes(
      automaticPlanes(planes, parallax_px_m),
      number(parallaxBetween(planes, parallax_px_m)) + " pixels of parallax between the limits");
  std::optional<double> voxel_m;
  if (automatic.voxel_size_m && !depths.inverse.empty()) {
    const double median_m = 1 / depths.median();
    NumberText digit(1);
    digit << std::clamp(median_m / viewOf(rig, options).fx, 1e-6, 1000.0);
    voxel_m = std::stod(digit.str());
    choice.voxel(*voxel_m, "a pixel at the median depth, " + number(median_m) + " m");
  }
  return {choice.take(), true, parallax_px_m, is_proven, voxel_m};
}

OptionChoice chooseWideDepths(const AutomaticOptions& automatic, FusionMapperOptions& options) {
  constexpr double kNearM = 0.3;
  constexpr double kFarM = 100;
  return Choice(automatic, options)
      .withoutScene(kNearM, kFarM, "no scene was found: a wide range of depths");
}

namespace {

/// The scene must have moved away from a limit by this factor, so that noise changes nothing.
constexpr double kTolerance = 1.2;
/// Maximum change per keyframe: a single keyframe may see another scene than the next keyframe.
constexpr double kMaxChange = 1.25;

double followed(double limit_m, double wanted_m) {
  const double change = wanted_m / limit_m;
  if (change < kTolerance && change > 1 / kTolerance) return limit_m;
  return limit_m * std::clamp(change, 1 / kMaxChange, kMaxChange);
}

/// Returns whether many points lie at a limit that may change.
bool areAtLimit(const std::vector<double>& inverse, const DepthPlanesOptions& planes,
                const AutomaticOptions& automatic) {
  // Points at a limit: 2 % if evenly spread, at most 2.4 % if the limits lie around the scene, and
  // mostly 7 % or more if much of the scene lies beyond a limit.
  constexpr double kNear = 0.02;
  constexpr double kMaxFraction = 0.06;
  const double nearest = 1 / planes.min_depth_m;
  const double farthest = 1 / planes.max_depth_m;
  const double margin = kNear * (nearest - farthest);
  const auto most = static_cast<std::ptrdiff_t>(kMaxFraction * static_cast<double>(inverse.size()));
  const auto first_near = std::lower_bound(inverse.begin(), inverse.end(), nearest - margin);
  const auto first_inside = std::upper_bound(inverse.begin(), inverse.end(), farthest + margin);
  return (automatic.min_depth_m && inverse.end() - first_near > most) ||
         (automatic.max_depth_m && first_inside - inverse.begin() > most);
}

}  // namespace

bool DepthFollower::follow(const cv::Mat1f& depth) {
  SceneDepths scene;
  scene.nearest = 1 / planes_.min_depth_m;
  for (const float depth_m : depth) {
    if (depth_m > 0) scene.inverse.push_back(1 / static_cast<double>(depth_m));
  }
  std::sort(scene.inverse.begin(), scene.inverse.end());
  const bool is_empty = scene.inverse.size() < kMinScenePoints;
  misfits_ = is_empty || areAtLimit(scene.inverse, planes_, automatic_) ? misfits_ + 1 : 0;
  if (is_empty) return false;
  const InverseRange range = limitsAround(denseRange(scene));

  const DepthPlanesOptions before = planes_;
  if (automatic_.min_depth_m) {
    planes_.min_depth_m = followed(planes_.min_depth_m, 1 / range.near);
  }
  if (automatic_.max_depth_m) {
    planes_.max_depth_m = followed(planes_.max_depth_m, 1 / range.far);
  }
  if (planes_.max_depth_m < kMaxChange * planes_.min_depth_m) planes_ = before;
  if (automatic_.num_planes) planes_.num_planes = automaticPlanes(planes_, parallax_px_m_);
  return planes_.min_depth_m != before.min_depth_m || planes_.max_depth_m != before.max_depth_m;
}

}  // namespace efm
