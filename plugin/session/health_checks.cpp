// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/health_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

#include "mapping/geometry/angle.h"
#include "mapping/geometry/lens_inverse.h"
#include "mapping/geometry/timestamp.h"
#include "plugin/session/camera_view.h"

namespace efm {
namespace {

using Warnings = std::vector<Warning>;

void checkBaselines(const RecordingStatistics& recording, Warnings& warnings) {
  // From a stereo microscope to a train; metres that are really millimetres, and the other way
  // round, are a factor of 1000 off.
  constexpr double kMinBaselineM = 0.005;
  constexpr double kMaxBaselineM = 20;
  const auto& cameras = recording.cameras();
  for (auto a = cameras.begin(); a != cameras.end(); ++a) {
    for (auto b = std::next(a); b != cameras.end(); ++b) {
      const double baseline_m = baselineOf(a->second.camera, b->second.camera);
      if (baseline_m >= kMinBaselineM && baseline_m <= kMaxBaselineM) continue;
      if (!isCalibrated(a->second.camera.model)) continue;  // nothing is known of its pose either
      warnings.push_back(
          {"baseline",
           fmt::format("cameras {} and {} are {:g} m apart: expected {:g} to {:g} m; "
                       "are the translations of the calibration in metres? "
                       "(--calibration)",
                       a->first.first, b->first.first, baseline_m, kMinBaselineM, kMaxBaselineM)});
    }
  }
}

void checkFieldOfView(int camera, const CameraModel& model, Warnings& warnings) {
  // A telescope, and the limit of a pinhole image. A fisheye lens sees up to 220 degrees.
  constexpr double kMinDeg = 5;
  const double max_deg = model.distortion == DistortionModel::kEquidistant ? 220 : 170;
  const double view_deg = fieldOfView(model).x() / kRadiansPerDegree;
  if (view_deg >= kMinDeg && view_deg <= max_deg) return;
  warnings.push_back(
      {"focal-length",
       fmt::format("camera {}: a focal length of {:g} px and {} columns are a field of view of "
                   "{:.3g} degrees: expected {:g} to {:g}; is the calibration in pixels, and of "
                   "this resolution? (--calibration)",
                   camera, model.fx, model.width, view_deg, kMinDeg, max_deg)});
}

void checkPrincipalPoint(int camera, const CameraModel& model, Warnings& warnings) {
  // Lenses are mounted within a few per cent of the centre; a cut-out of a sensor reaches further.
  const auto in_middle = [](double center, int size) {
    return center >= 0.25 * size && center <= 0.75 * size;
  };
  if (in_middle(model.cx, model.width) && in_middle(model.cy, model.height)) return;
  warnings.push_back(
      {"principal-point",
       fmt::format("camera {}: the principal point ({:g}, {:g}) lies outside the middle half of "
                   "the {}x{} pixels; is the calibration of this resolution, and in the order fx "
                   "fy cx cy? (--calibration)",
                   camera, model.cx, model.cy, model.width, model.height)});
}

/// The fraction of a grid's pixels without a viewing ray.
double fractionWithoutRay(const CameraModel& model) {
  constexpr int kGrid = 64;  // enough for a fraction of 5 %, and quick
  const LensInverse lens(model);
  int without = 0;
  for (int row = 0; row < kGrid; ++row) {
    for (int column = 0; column < kGrid; ++column) {
      const double x = (model.width - 1) * (column / (kGrid - 1.0));
      const double y = (model.height - 1) * (row / (kGrid - 1.0));
      without += std::isnan(lens.rayThrough(x, y).x()) ? 1 : 0;
    }
  }
  return static_cast<double>(without) / (kGrid * kGrid);
}

void checkLens(int camera, const CameraModel& model, Warnings& warnings) {
  constexpr double kMaxFraction = 0.05;  // the corners of a wide lens may have no ray
  const double fraction = fractionWithoutRay(model);
  if (fraction <= kMaxFraction) return;
  warnings.push_back(
      {"lens",
       fmt::format("camera {}: the lens model has no viewing ray for {:.0f} % of the pixels; are "
                   "the coefficients in the order of the model '{}'? (--calibration)",
                   camera, 100 * fraction, nameOf(model.distortion))});
}

using ClockSpan = std::pair<std::int64_t, std::int64_t>;

/// Whether the poses would cover the events if the events' times were `factor` times larger. Almost
/// nothing among the poses is no fit, but chance.
bool fitsWith(double factor, const ClockSpan& events, const ClockSpan& poses) {
  const double first = factor * static_cast<double>(events.first);
  const double last = factor * static_cast<double>(events.second);
  const double begin = std::max(first, static_cast<double>(poses.first));
  const double end = std::min(last, static_cast<double>(poses.second));
  const auto poses_ns = static_cast<double>(poses.second - poses.first);
  return end - begin > 0.5 * (last - first) && last - first > 0.1 * poses_ns;
}

/// The unit of either that would let both fit; else a question.
std::string clockGuess(const ClockSpan& events, const ClockSpan& poses) {
  double factor = 1;
  for (const char* unit : {"ms", "us", "ns"}) {
    factor /= 1000;
    if (fitsWith(factor, events, poses)) {
      return fmt::format("they fit if the events' times are in {}: --time-unit {}", unit, unit);
    }
    if (fitsWith(1 / factor, events, poses)) {
      return fmt::format("they fit if the poses' times are in {}: a header names it, t_{} tx …",
                         unit, unit);
    }
  }
  return "have they one clock and one unit?";
}

void checkClocks(const RecordingStatistics& recording, Warnings& warnings) {
  // Trackers start late; in a recording of a second that is a large fraction. Another clock or
  // another unit leaves nothing.
  constexpr double kMinOverlap = 0.9;
  constexpr double kStartS = 0.1;
  const double overlap = recording.overlap();
  if (overlap >= kMinOverlap) return;
  const auto span = *recording.eventSpan();
  const double uncovered_s = (1 - overlap) * secondsBetween(span.first, span.second);
  if (overlap > 0 && uncovered_s < kStartS) return;
  const StreamStatistics& poses = recording.usedPoses()->poses;
  warnings.push_back(
      {"clock-overlap",
       fmt::format("the poses cover {:.1f} % of the events' time: events from {} to {} s, poses "
                   "from {} to {} s; {} (--poses, --time-unit, [rig] time_offsets_s)",
                   100 * overlap, formatSeconds(span.first), formatSeconds(span.second),
                   formatSeconds(*poses.first_ns), formatSeconds(*poses.last_ns),
                   clockGuess(span, {*poses.first_ns, *poses.last_ns}))});
}

void checkPoseGap(const RecordingStatistics& recording, double max_gap_s, Warnings& warnings) {
  const auto span = recording.eventSpan();
  const PoseStatistics* const used = recording.usedPoses();
  if (!span || !used) return;
  const std::int64_t start_ns = used->poses.max_gap_start_ns;
  const std::int64_t end_ns = start_ns + used->poses.max_gap_ns;
  const bool matters = start_ns < span->second && end_ns > span->first;
  if (!matters || secondsBetween(start_ns, end_ns) <= max_gap_s) return;
  warnings.push_back(
      {"pose-gap",
       fmt::format("the largest gap between two poses is {:g} s, after {} s: events in gaps of "
                   "more than {:g} s are not used ([rig] max_pose_gap_s)",
                   secondsBetween(start_ns, end_ns), formatSeconds(start_ns), max_gap_s)});
}

void checkMotion(const PoseStatistics& poses, double near_depth_m, Warnings& warnings) {
  // Depth comes from parallax: at 1 % of the depth, a typical camera sees a point move by 2 to 5
  // pixels.
  constexpr double kMinShift = 0.01;
  // A slower rotation is the sway of a still camera.
  constexpr double kMinRotation = 1 * kRadiansPerDegree;
  if (poses.poses.count < 2 || poses.max_shift_m >= kMinShift * near_depth_m) return;
  const bool rotates = poses.max_rotation_rad >= kMinRotation;
  warnings.push_back(
      {rotates ? "rotation-only" : "no-motion",
       fmt::format("the poses move by at most {:g} m and {:.3g} degrees within a window: depth "
                   "needs a shift of {:g} m or more for points at {:g} m; are the positions in "
                   "metres? (--poses, [keyframes] window_s, [dsi] min_depth_m)",
                   poses.max_shift_m, poses.max_rotation_rad / kRadiansPerDegree,
                   kMinShift * near_depth_m, near_depth_m)});
}

void checkSpeeds(const PoseStatistics& poses, Warnings& warnings) {
  constexpr double kMaxSpeed = 50;     // m/s: 180 km/h
  constexpr double kMaxRotation = 20;  // rad/s: three turns a second; gyroscopes end at 35
  if (poses.max_speed > kMaxSpeed) {
    warnings.push_back(
        {"speed", fmt::format("the poses move at up to {:.3g} m/s: expected at most {:g}; are "
                              "positions in metres, times in seconds and the columns in order? Or "
                              "the tracker jumps (--poses)",
                              poses.max_speed, kMaxSpeed)});
  }
  if (poses.max_rotation_rate > kMaxRotation) {
    warnings.push_back(
        {"rotation-rate",
         fmt::format("the poses rotate at up to {:.3g} rad/s: expected at most {:g}; is the order "
                     "of the quaternion qx qy qz qw, and are times in seconds? (--poses)",
                     poses.max_rotation_rate, kMaxRotation)});
  }
}

void checkActivity(const RecordingStatistics& recording, Warnings& warnings) {
  constexpr std::uint64_t kEnough = 1000;  // fewer say nothing
  std::uint64_t most = 0;
  for (const auto& [key, camera] : recording.cameras()) most = std::max(most, camera.events.count);
  for (const auto& [key, camera] : recording.cameras()) {
    const std::uint64_t count = camera.events.count;
    if (count == 0 && most > 0) {
      warnings.push_back({"silent-camera", fmt::format("camera {} has no event; [rig] cameras "
                                                       "leaves it out",
                                                       key.first)});
    } else if (most >= kEnough && count < most / 10) {  // equal cameras differ by a factor of 2
      warnings.push_back(
          {"few-events", fmt::format("camera {} has {} events, another one {}: is its lens covered "
                                     "or its sensitivity lower? ([rig] cameras leaves it out)",
                                     key.first, count, most)});
    }
    if (count >= kEnough && (camera.positive == 0 || camera.positive == count)) {
      warnings.push_back(
          {"polarity", fmt::format("all {} events of camera {} have the polarity {}: is it the "
                                   "right column? (--event-columns; [fusion] split_polarity = "
                                   "false does without)",
                                   count, key.first, camera.positive == 0 ? 0 : 1)});
    }
  }
}

/// The fraction of a camera's events that its busiest 1 % of pixels have.
double fractionOfBusiest(const CameraStatistics& camera) {
  std::vector<std::uint32_t> pixels = camera.pixels;
  const auto busiest = static_cast<std::ptrdiff_t>(pixels.size() / 100);
  std::nth_element(pixels.begin(), pixels.begin() + busiest, pixels.end(), std::greater<>());
  const auto events = std::accumulate(pixels.begin(), pixels.begin() + busiest, std::uint64_t{0});
  return static_cast<double>(events) / static_cast<double>(camera.events.count);
}

void checkHotPixels(const RecordingStatistics& recording, Warnings& warnings) {
  // Edges sweep over most of the image. One hot pixel among the others' events is for the filter.
  constexpr double kMaxFraction = 0.9;
  for (const auto& [key, camera] : recording.cameras()) {
    // With fewer events, 1 % of the pixels may have them all by chance.
    if (camera.pixels.empty() || camera.events.count < camera.pixels.size() / 10) continue;
    const double fraction = fractionOfBusiest(camera);
    if (fraction <= kMaxFraction) continue;
    warnings.push_back(
        {"hot-pixels",
         fmt::format("{:.0f} % of the events of camera {} come from 1 % of its pixels: hot pixels, "
                     "a blinking light or a wrong column ([filter] hot_pixel_ratio, "
                     "--event-columns)",
                     100 * fraction, key.first)});
  }
}

}  // namespace

std::vector<Warning> healthWarnings(const RecordingStatistics& recording,
                                    const HealthLimits& limits) {
  Warnings warnings;
  checkBaselines(recording, warnings);
  for (const auto& [key, camera] : recording.cameras()) {
    const CameraModel& model = camera.camera.model;
    if (!isCalibrated(model)) continue;
    checkFieldOfView(key.first, model, warnings);
    checkPrincipalPoint(key.first, model, warnings);
    checkLens(key.first, model, warnings);
  }
  checkClocks(recording, warnings);
  checkPoseGap(recording, limits.max_pose_gap_s, warnings);
  if (const PoseStatistics* const poses = recording.usedPoses()) {
    checkMotion(*poses, limits.near_depth_m, warnings);
    checkSpeeds(*poses, warnings);
  }
  checkActivity(recording, warnings);
  checkHotPixels(recording, warnings);
  return warnings;
}

std::vector<Warning> missingParts(const RecordingStatistics& recording) {
  Warnings warnings;
  if (!recording.eventSpan()) warnings.push_back({"no-events", "there are no events"});
  for (const auto& [key, camera] : recording.cameras()) {
    if (isCalibrated(camera.camera.model)) continue;
    warnings.push_back(
        {"no-calibration",
         fmt::format("camera {} has no calibration: a map needs --calibration", key.first)});
  }
  if (!recording.usedPoses()) {
    warnings.push_back({"no-poses", "there are no poses: a map needs --poses"});
  }
  return warnings;
}

void DepthStatistics::add(const cv::Mat_<float>& depth) {
  // A depth counts as near a limit within this fraction of the range of inverse depth.
  constexpr double kNear = 0.02;
  const double nearest = 1 / planes_.min_depth_m;
  const double farthest = 1 / planes_.max_depth_m;
  const double margin = kNear * (nearest - farthest);
  const auto near_m = static_cast<float>(1 / (nearest - margin));
  const auto far_m = static_cast<float>(1 / (farthest + margin));
  for (const float depth_m : depth) {
    if (!(depth_m > 0)) continue;
    ++depths_;
    nearest_ += depth_m <= near_m ? 1 : 0;
    farthest_ += depth_m >= far_m ? 1 : 0;
  }
}

std::vector<Warning> DepthStatistics::warnings() const {
  // Evenly spread depths: 2 %. Measured on six simulated scenes and a real one: with limits around
  // the scene at most 2.4 %; with much of the scene beyond a limit 7 to 74 % in eight of ten cases.
  // It is not more, because most pixels without a peak inside the limits are rejected.
  constexpr double kMaxFraction = 0.06;
  constexpr std::uint64_t kMinDepths = 100;  // fewer may lie there by chance
  constexpr int kMinPlanes = 50;             // with fewer, the limit's plane alone has many depths
  Warnings warnings;
  if (depths_ < kMinDepths || planes_.num_planes < kMinPlanes) return warnings;
  const auto check = [&](std::uint64_t count, const char* which, double limit_m, const char* key) {
    const double fraction = static_cast<double>(count) / static_cast<double>(depths_);
    if (fraction <= kMaxFraction) return;
    warnings.push_back(
        {"depths-at-limit",
         fmt::format("{:.0f} % of the depths lie at the {} plane, {:g} m: the scene goes on beyond "
                     "it ([dsi] {}), or calibration and poses do not explain the events",
                     100 * fraction, which, limit_m, key)});
  };
  check(nearest_, "nearest", planes_.min_depth_m, "min_depth_m");
  check(farthest_, "farthest", planes_.max_depth_m, "max_depth_m");
  return warnings;
}

}  // namespace efm
