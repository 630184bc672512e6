// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/checks/health_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "mapping/depth/peak_fit.h"
#include "mapping/geometry/rigid3.h"
#include "mapping/geometry/timestamp.h"

namespace efm {

Eigen::Vector2d fieldOfView(const CameraModel& model) {
  const Eigen::Vector2d half{0.5 * model.width / model.fx, 0.5 * model.height / model.fy};
  if (model.distortion == DistortionModel::kEquidistant) return 2 * half;
  return {2 * std::atan(half.x()), 2 * std::atan(half.y())};
}

double baselineOf(const RigCamera& a, const RigCamera& b) {
  return (a.T_rig_cam.translation - b.T_rig_cam.translation).norm();
}

namespace {

using Warnings = std::vector<Warning>;

/// Returns whether the poses would cover the events if the events' times were `factor` times
/// larger. If the events span only a small part of the poses, the fit is chance.
bool fitsWith(double factor, const TimeSpan& events, const TimeSpan& poses) {
  const double first = factor * static_cast<double>(events.first_ns);
  const double last = factor * static_cast<double>(events.last_ns);
  const double begin = std::max(first, static_cast<double>(poses.first_ns));
  const double end = std::min(last, static_cast<double>(poses.last_ns));
  const auto poses_ns = static_cast<double>(poses.last_ns - poses.first_ns);
  return end - begin > 0.5 * (last - first) && last - first > 0.1 * poses_ns;
}

/// Returns the unit of events or poses with which both fit; otherwise a question.
std::string clockGuess(const TimeSpan& events, const TimeSpan& poses) {
  double factor = 1;
  for (const char* unit : {"ms", "us", "ns"}) {
    factor /= 1000;
    if (fitsWith(factor, events, poses)) {
      return fmt::format("they fit if the events' times are in {}: --time-unit {}", unit, unit);
    }
    if (fitsWith(1 / factor, events, poses)) {
      return fmt::format(
          "they fit if the poses' times are in {0}: --pose-time-unit {0}; or the events' times are "
          "in a larger unit (--time-unit)",
          unit);
    }
  }
  return "have they one clock and one unit, are they of one recording, and are the poses complete?";
}

void checkClocks(const Findings& findings, Warnings& warnings) {
  // Trackers start late, which is a large fraction of a recording of a second. With another clock
  // or another unit, nothing overlaps.
  constexpr double kMinOverlap = 0.9;
  constexpr double kStartS = 0.1;
  const auto events = findings.events();
  const PoseStatistics* const used = findings.recording.usedPoses();
  if (!events || !used) return;
  const TimeSpan poses = {*used->poses.first_ns, *used->poses.last_ns};
  const double overlap = overlapOf(*events, poses);
  if (overlap >= kMinOverlap) return;
  const double uncovered_s = (1 - overlap) * secondsBetween(events->first_ns, events->last_ns);
  if (overlap > 0 && uncovered_s < kStartS) return;
  addWarning(warnings, "clock-overlap",
             "the poses cover {:.1f} % of the events' time: events from {}, poses from {}; {} "
             "(--poses, --time-unit, [rig] time_offsets_s)",
             100 * overlap, timeText(events->first_ns, events->last_ns, events->first_ns),
             timeText(poses.first_ns, poses.last_ns, events->first_ns), clockGuess(*events, poses));
}

void checkPoseGap(const Findings& findings, Warnings& warnings) {
  const auto events = findings.events();
  const PoseStatistics* const used = findings.recording.usedPoses();
  if (!events || !used) return;
  const std::int64_t start_ns = used->poses.max_gap_start_ns;
  const std::int64_t end_ns = start_ns + used->poses.max_gap_ns;
  const bool matters = start_ns < events->last_ns && end_ns > events->first_ns;
  if (!matters || secondsBetween(start_ns, end_ns) <= findings.max_pose_gap_s) return;
  addWarning(warnings, "pose-gap",
             "the largest gap between two poses is {:g} s, after {}: events in gaps of more than "
             "{:g} s are not used ([rig] max_pose_gap_s)",
             secondsBetween(start_ns, end_ns), timeText(start_ns, events->first_ns),
             findings.max_pose_gap_s);
}

void checkShift(const Findings& findings, Warnings& warnings) {
  // Depth comes from parallax: at 1 % of the depth, a typical camera sees a point move by 2 to 5
  // pixels.
  constexpr double kMinShift = 0.01;
  // A slower rotation is the sway of a still camera.
  constexpr double kMinRotation = 1 * kRadiansPerDegree;
  const PoseStatistics* const used = findings.recording.usedPoses();
  const double min_shift_m = kMinShift * findings.near_depth_m;
  if (!used || used->poses.count < 2 || used->max_shift_m >= min_shift_m) return;
  addWarning(warnings, used->max_rotation_rad >= kMinRotation ? "rotation-only" : "no-motion",
             "the poses move by at most {:g} m and {:.3g} degrees within a window: depth needs a "
             "shift of {:g} m or more for points at {:g} m; are the positions in metres, and the "
             "columns in order? Or the window is too short, or the rig rests (--poses, "
             "[keyframes] window_s, [dsi] min_depth_m)",
             used->max_shift_m, used->max_rotation_rad / kRadiansPerDegree, min_shift_m,
             findings.near_depth_m);
}

void checkSpeeds(const Findings& findings, Warnings& warnings) {
  constexpr double kMaxSpeed = 50;     // m/s: 180 km/h
  constexpr double kMaxLeverM = 3;     // a car's; a camera's lever of 3 cm is 3 in centimetres
  constexpr double kMaxRotation = 20;  // rad/s: three turns a second; gyroscopes end at 35
  const PoseStatistics* const used = findings.recording.usedPoses();
  if (!used) return;
  if (used->max_speed > kMaxSpeed) {
    addWarning(warnings, "speed",
               "the poses move at up to {:.3g} m/s: expected at most {:g}; are "
               "positions in metres, times in seconds and the columns in order? Or "
               "the tracker jumps (--poses)",
               used->max_speed, kMaxSpeed);
  }
  if (used->lever_m > kMaxLeverM) {
    addWarning(warnings, "long-lever",
               "the rig is {:.4g} m from the tracked body: expected at most {:g}; is the "
               "translation of T_body_rig in metres (--hand-eye)?",
               used->lever_m, kMaxLeverM);
  }
  if (used->max_rotation_rate > kMaxRotation) {
    addWarning(warnings, "rotation-rate",
               "the poses rotate at up to {:.3g} rad/s: expected at most {:g}; is the order "
               "of the quaternion qx qy qz qw, and are times in seconds? Or the tracker jumps "
               "(--poses)",
               used->max_rotation_rate, kMaxRotation);
  }
}

/// Warns of missing parts before a map. With a map, missing parts are an error.
void checkParts(const Findings& findings, Warnings& warnings) {
  if (findings.session) return;
  Rig rig;
  for (const auto& [index, camera] : findings.recording.cameras()) {
    rig.cameras.push_back(camera.camera);
  }
  warnings =
      missingParts(rig, findings.events().has_value(), findings.recording.usedPoses() != nullptr);
}

void checkDepths(const Findings& findings, Warnings& warnings) {
  const bool wrong_pixels =
      std::any_of(warnings.begin(), warnings.end(),
                  [](const Warning& warning) { return warning.name == "focal-length"; });
  const auto voxel_m = wrong_pixels ? std::nullopt : std::optional(findings.voxel_size_m);
  if (findings.depths) append(warnings, findings.depths->warnings(voxel_m));
  if (!findings.pixels || !voxel_m) return;
  if (auto warning = findings.pixels->warning(*voxel_m)) warnings.push_back(std::move(*warning));
}

void checkReading(const Findings& findings, Warnings& warnings) {
  append(warnings, lossWarnings(findings.read));
}

using Check = void (*)(const Findings&, Warnings&);

constexpr Check kChecks[] = {checkParts,  checkCameras, checkClocks, checkPoseGap, checkShift,
                             checkSpeeds, checkMotion,  checkDepths, checkSession, checkReading};
constexpr Check kLossChecks[] = {checkParts, checkSession, checkReading};

}  // namespace

void Findings::use(const DepthPlanesOptions& planes, const std::vector<ChosenOption>& chosen) {
  const bool is_chosen = std::any_of(chosen.begin(), chosen.end(), [](const ChosenOption& option) {
    return option.key == "min_depth_m";
  });
  // An automatic limit may be too near because of wrong poses.
  near_depth_m = is_chosen ? std::max(planes.min_depth_m, near_depth_m) : planes.min_depth_m;
  far_depth_m = planes.max_depth_m;
}

std::optional<TimeSpan> Findings::events() const {
  std::optional<TimeSpan> events = recording.eventSpan();
  if (!events && session) events = session->events;
  if (events) events->last_ns = std::min(events->last_ns, until_ns);
  return events;
}

std::vector<Warning> warningsOf(const Findings& findings) {
  Warnings warnings;
  if (findings.checks) {
    for (const Check check : kChecks) check(findings, warnings);
  } else {
    for (const Check check : kLossChecks) check(findings, warnings);
  }
  dropExplainedBlur(warnings);
  return warnings;
}

std::vector<Warning> missingParts(const Rig& rig, bool has_events, bool has_poses) {
  Warnings warnings;
  if (!has_events) warnings.push_back({"no-events", "there are no events"});
  for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
    if (isCalibrated(rig.cameras[i].model)) continue;
    addWarning(warnings, "no-calibration",
               "camera {} has no calibration: a map needs --calibration", i);
  }
  if (!has_poses) warnings.push_back({"no-poses", "there are no poses: a map needs --poses"});
  return warnings;
}

std::vector<Warning> lossWarnings(const RecordingCounts& counts) {
  Warnings warnings = counts.warnings;
  if (counts.lost_packets > 0) {
    addWarning(warnings, "lost-packets",
               "the recording lacks {} packets of events: their numbers have gaps",
               counts.lost_packets);
  }
  if (counts.undated_events > 0) {
    addWarning(warnings, "undated-events",
               "{} events were left out: the recording does not say their time or row, at its "
               "beginning or after a gap",
               counts.undated_events);
  }
  if (counts.skipped_events > 0) {
    addWarning(warnings, "skipped-events", "{} bad events were left out, the first one found: {}",
               counts.skipped_events, counts.first_skipped);
  }
  return warnings;
}

void DepthStatistics::add(const KeyframeDepthMap& keyframe) {
  // Fraction of the range of inverse depth in which a depth counts as near a limit.
  constexpr double kNear = 0.02;
  const double nearest = 1 / planes_.min_depth_m;
  const double farthest = 1 / planes_.max_depth_m;
  const double margin = kNear * (nearest - farthest);
  const auto near_m = static_cast<float>(1 / (nearest - margin));
  const auto far_m = static_cast<float>(1 / (farthest + margin));
  std::vector<float> depths_m;
  for (const float depth_m : keyframe.map.depth) {
    if (!(depth_m > 0)) continue;
    depths_m.push_back(depth_m);
    nearest_ += depth_m <= near_m ? 1 : 0;
    farthest_ += depth_m >= far_m ? 1 : 0;
  }
  pixels_ += keyframe.map.pixels;
  sizes_.add(std::move(depths_m), keyframe.view.fx);
}

namespace {
constexpr std::uint64_t kMinDepths = 100;  // fewer tell nothing about the scene
}

void PixelSizes::add(std::vector<float> depths_m, double fx) {
  depths += depths_m.size();
  if (!depths_m.empty()) at_median_m.push_back(upperMedian(depths_m) / fx);
}

std::optional<Warning> PixelSizes::warning(double voxel_m) const {
  // HD at 1 m: 0.11. A car with 346 x 260 pixels at 20 m: 9.
  constexpr double kMin = 0.1;  // of a voxel
  constexpr double kMax = 20;
  if (depths < kMinDepths) return std::nullopt;
  std::vector<double> sizes_m = at_median_m;
  const double pixel_m = upperMedian(sizes_m);
  if (pixel_m >= kMin * voxel_m && pixel_m <= kMax * voxel_m) return std::nullopt;
  return Warning{
      "voxel-size",
      fmt::format("a pixel at the median depth is {:.1g} m wide, a voxel of the map {:g} m: {}; "
                  "--set map.voxel_size_m={:.1g} fits the scene (are the positions in metres?)",
                  pixel_m, voxel_m,
                  pixel_m < voxel_m ? "details are lost" : "points of one place are not merged",
                  pixel_m)};
}

std::vector<Warning> DepthStatistics::warnings(std::optional<double> voxel_size_m) const {
  // Evenly spread depths: 2 %. Measured on six simulated scenes and a real one: at most 2.4 % with
  // limits around the scene; 7 to 74 % in eight of ten cases with much of the scene beyond a limit.
  // The fraction is not larger because most pixels without a peak inside the limits are rejected.
  constexpr double kMaxFraction = 0.06;
  constexpr int kMinPlanes = 50;  // with fewer, the limit's own plane has many depths
  Warnings warnings;
  if (voxel_size_m) {
    if (auto warning = sizes_.warning(*voxel_size_m)) warnings.push_back(std::move(*warning));
  }
  if (sizes_.depths < kMinDepths || planes_.num_planes < kMinPlanes) return warnings;
  const auto check = [&](std::uint64_t count, const char* which, double limit_m, const char* key) {
    const double fraction = static_cast<double>(count) / static_cast<double>(sizes_.depths);
    if (fraction <= kMaxFraction) return;
    const auto chosen = std::find_if(chosen_.begin(), chosen_.end(),
                                     [&](const ChosenOption& option) { return option.key == key; });
    const std::string why = chosen == chosen_.end()
                                ? fmt::format("the scene goes on beyond it ([dsi] {})", key)
                                : fmt::format(
                                      "auto chose it, because {}; where the scene goes on "
                                      "beyond it, [dsi] {} sets another one",
                                      chosen->reason, key);
    addWarning(warnings, "depths-at-limit",
               "{:.0f} % of the depths lie at the {} plane, {:g} m: {}, or "
               "calibration and poses do not explain the events",
               100 * fraction, which, limit_m, why);
  };
  check(nearest_, "nearest", planes_.min_depth_m, "min_depth_m");
  check(farthest_, "farthest", planes_.max_depth_m, "max_depth_m");
  return warnings;
}

}  // namespace efm
