// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <string>
#include <string_view>
#include <utility>

#include "mapping/geometry/timestamp.h"
#include "plugin/checks/health_checks.h"
#include "plugin/session/session_status.h"

namespace efm {
namespace {

/// Returns the condition of a full window, by the policy.
std::string fullWindow(const KeyframePolicyOptions& options) {
  const std::string duration = formatSeconds(durationFromSeconds(options.window_s));
  if (options.policy == KeyframePolicyKind::kEvents) {
    return fmt::format("{} events (window_events)", options.window_events);
  }
  if (options.policy == KeyframePolicyKind::kPeriod) return duration + " s (window_s)";
  return fmt::format(
      "at most {} s (window_s) with motion enough (min_baseline_ratio, min_visible_fraction)",
      duration);
}

OptionHint whyNoPoses(const SessionStatus& status) {
  std::string why = "the recording has no poses";
  if (status.other_poses.empty()) return why + ": a map needs --poses FILE";
  const char* before = " of the source that [rig] pose_source says, but of ";
  for (const auto& [source, count] : status.other_poses) {
    why += std::exchange(before, ", ") + asText(source);
  }
  return {why, {{"rig", "pose_source"}}};
}

using Warnings = std::vector<Warning>;

void addUnusedEvents(const SessionStatus& status, const FusionMapperOptions& options,
                     Warnings& warnings) {
  if (status.counts.sorted_events > 0) {
    addWarning(warnings, "sorted-events", "{} events came later than newer ones and were sorted",
               status.counts.sorted_events);
  }
  for (std::size_t c = 0; c < status.counts.cameras.size(); ++c) {
    const EventCounts& events = status.counts.cameras[c];
    if (events[EventFate::kOutsideLens] == 0) continue;
    addWarning(warnings, "outside-lens",
               "{} of {} events of camera {} were not used: its lens model has no viewing ray "
               "for their pixels (outside_lens)",
               events[EventFate::kOutsideLens], events.read, c);
  }
  if (status.counts.keyframes == 0) return;  // the error says why
  const EventCounts counts = status.counts.total();
  const std::uint64_t wanted = counts.read - counts[EventFate::kUnselected];
  if (counts[EventFate::kWithoutPose] > wanted / 2) {
    addWarning(warnings, "events-without-pose",
               "{} of {} events have no pose: poses begin late, end early or have gaps "
               "(--poses, [rig] max_pose_gap_s)",
               counts[EventFate::kWithoutPose], wanted);
  }
  // With time limits, or with gaps between windows, the user asked for this.
  const bool gapless = options.policy.policy != KeyframePolicyKind::kPeriod ||
                       options.policy.stride_s <= options.policy.window_s;
  const bool whole = !options.only_window && !options.limits.t0_ns && !options.limits.t1_ns;
  if (whole && gapless && counts[EventFate::kOutsideWindow] > wanted / 2) {
    addWarning(warnings, "events-outside-windows",
               "{} of {} events lie in no window that was mapped: windows are too long for the "
               "recording, or saw too little motion ([keyframes] window_s, min_baseline_ratio)",
               counts[EventFate::kOutsideWindow], wanted);
  }
}

void addSilence(const SessionStatus& status, bool exclude_silent, Warnings& warnings) {
  for (std::size_t c = 0; c < status.silent_keyframes.size(); ++c) {
    if (status.silent_keyframes[c] == 0) continue;
    addWarning(warnings, "silent-keyframes", "camera {} had no event in {} of {} keyframes: {}", c,
               status.silent_keyframes[c], status.counts.keyframes,
               exclude_silent ? "the others were fused without it"
                              : "rules that ask all cameras (min, harmonic, geometric, pairs of "
                                "two) find nothing there "
                                "([rig] exclude_silent leaves silent cameras out)");
  }
  if (status.counts.silent_subintervals > 0) {
    addWarning(warnings, "silent-subintervals",
               "{} sub-intervals of a camera had no event: with min, harmonic and geometric fusion "
               "such a window has no depth there: lower [fusion] subintervals",
               status.counts.silent_subintervals);
  }
}

void addUnusedPoses(const SessionStatus& status, Warnings& warnings) {
  for (const auto& [source, count] : status.other_poses) {
    if (!status.pose_source) break;  // no keyframe: the error says so
    addWarning(warnings, "unused-poses",
               "{} poses were not used: {}, beside {} ([rig] pose_source)", count, asText(source),
               asText(*status.pose_source));
  }
  if (status.counts.duplicate_poses > 0) {
    addWarning(warnings, "duplicate-poses",
               "{} poses had the time of an earlier one and were left out",
               status.counts.duplicate_poses);
  }
}

void addLosses(const SessionStatus& status, Warnings& warnings) {
  if (!status.live) return;
  const DroppedWindows& dropped = status.counts.dropped_windows;
  const std::uint64_t rejected_poses = status.live->rejected_poses;
  if (status.live->dropRatio() > 0 || dropped.total() > 0 || rejected_poses > 0) {
    std::uint64_t subsampled = 0, rejected = 0;
    bool overload = dropped[DropReason::kOverload] > 0;
    for (const auto& [index, camera] : status.live->cameras) {
      overload = overload || camera.fates[QueueFate::kQueueFull] > 0;
      subsampled += camera.fates[QueueFate::kSubsampled];
      rejected += camera.fates[QueueFate::kRejected];
    }
    std::string why;
    if (rejected + rejected_poses > 0) {
      why += fmt::format("; {} events and {} poses were late, or had wrong times or places",
                         rejected, rejected_poses);
    }
    if (subsampled > 0) {
      why += fmt::format("; {} events were more than [live] max_event_rate lets pass", subsampled);
    }
    if (overload) why += "; the machine is too slow for more ([live] max_queue_events)";
    if (!status.live->too_large.empty()) why += "; " + status.live->too_large;
    addWarning(warnings, "events-lost", "{:.3g} % of the events were lost; {}{}",
               100 * status.live->dropRatio(), asText(dropped), why);
  }
  if (status.live->errors > 0) {
    addWarning(warnings, "mapping-errors", "{} errors while mapping, the last one: {}",
               status.live->errors, status.live->last_error);
  }
}

void addKeyframes(const SessionStatus& status, Warnings& warnings) {
  const MapperCounts& counts = status.counts;
  if (status.refinement && status.refinement->counts.registered + 1 < counts.keyframes) {
    addWarning(warnings, "unregistered-keyframes",
               "{} of {} keyframes found no place by their points: the tracker's motion stands "
               "there",
               counts.keyframes - 1 - status.refinement->counts.registered, counts.keyframes);
  }
  if (status.refinement && status.refinement->failures > 0) {
    addWarning(warnings, "refinement-failures",
               "the refinement failed {} times, the last time with: {}; these keyframes keep the "
               "tracker's motion",
               status.refinement->failures, status.refinement->last_error);
  }
  if (status.refinement && status.refinement->counts.failed_solves > 0) {
    addWarning(warnings, "failed-solves",
               "{} failed solves of the refinement: poses stayed as they were",
               status.refinement->counts.failed_solves);
  }
  if (counts.keyframes == 0) return;
  if (counts.keyframes_without_pose > 0) {
    addWarning(warnings, "windows-without-pose",
               "{} windows were left out: no pose at their reference time ([rig] max_pose_gap_s)",
               counts.keyframes_without_pose);
  }
  if (counts.windows_without_events > 0) {
    addWarning(warnings, "windows-without-events",
               "{} windows were left out: the selected cameras saw nothing",
               counts.windows_without_events);
  }
}

}  // namespace

OptionHint whyNoKeyframe(const SessionStatus& status, const FusionMapperOptions& options) {
  if (!status.events) return OptionHint("the recording has no events");
  if (!status.poses) return whyNoPoses(status);
  const std::int64_t start_ns = status.events->first_ns;
  const auto text = [&](const TimeSpan& span) {
    return timeText(span.first_ns, span.last_ns, start_ns);
  };
  const std::string spans =
      fmt::format("the events span {}, the poses {}", text(*status.events), text(*status.poses));
  const std::int64_t first_ns = std::max(status.events->first_ns, status.poses->first_ns);
  const std::int64_t last_ns = std::min(status.events->last_ns, status.poses->last_ns);
  if (first_ns > last_ns) {
    return fmt::format("{}: they miss each other by {} s", spans,
                       formatSeconds(first_ns - last_ns));
  }
  if (status.live && !status.live->too_large.empty()) {
    return {status.live->too_large, {{"keyframes", "window_s"}, {"live", "max_queue_events"}}};
  }
  const EventCounts counts = status.counts.total();
  if (counts[EventFate::kFiltered] > 0 && counts[EventFate::kUsed] == 0 &&
      counts[EventFate::kFiltered] + counts[EventFate::kUnselected] == counts.read) {
    return fmt::format(
        "the filters took all {} events of the selected cameras for noise: [filter] is too strict "
        "for this recording",
        counts[EventFate::kFiltered]);
  }
  if (counts[EventFate::kOutsideLens] > 0 && counts[EventFate::kUsed] == 0 &&
      counts[EventFate::kOutsideLens] + counts[EventFate::kFiltered] +
              counts[EventFate::kUnselected] ==
          counts.read) {
    return fmt::format(
        "{} of {} events lie outside the lens: its model has no viewing ray for their pixels, so "
        "the calibration is wrong",
        counts[EventFate::kOutsideLens], counts.read);
  }
  const std::uint64_t without_pose = status.counts.keyframes_without_pose;
  const bool saw_nothing = without_pose == 0 && status.counts.windows_without_events > 0;
  if (options.only_window) {
    const Window& window = *options.only_window;
    const std::string interval = "the window " + text({window.t0_ns, window.t1_ns});
    if (saw_nothing) {
      return fmt::format("the selected cameras have no event in {}; {}", interval, spans);
    }
    return fmt::format("there is no pose at the reference time {} of {}; {}",
                       timeText(window.t_ref_ns, start_ns), interval, spans);
  }
  if (saw_nothing) {
    return "the selected cameras have no event in any window that was full: " + spans;
  }
  if (without_pose > 0) {
    return fmt::format(
        "{} windows were full, but had no pose at their reference times: poses are more than "
        "max_pose_gap_s apart there",
        without_pose);
  }
  return fmt::format("no window of {} was full: {}, {} s of them together",
                     fullWindow(options.policy), spans, formatSeconds(last_ns - first_ns));
}

std::string noEventText(const TimeLimits& limits, const RecordingCounts& counts) {
  std::string nearest;
  for (const auto& t_ns : {counts.nearest_before_ns, counts.nearest_after_ns}) {
    if (t_ns) nearest += (nearest.empty() ? "" : " and ") + formatSeconds(*t_ns) + " s";
  }
  return fmt::format("no event {}: {}", limitsText(limits),
                     nearest.empty() ? "event-fusion info tells the recording's times"
                                     : "the nearest events lie at " + nearest);
}

void checkSession(const Findings& findings, Warnings& warnings) {
  if (!findings.session) return;
  const SessionStatus& status = *findings.session;
  append(warnings, status.pose_warnings);
  addUnusedEvents(status, *findings.options, warnings);
  addSilence(status, findings.options->keyframe.exclude_silent, warnings);
  addUnusedPoses(status, warnings);
  addKeyframes(status, warnings);
  addLosses(status, warnings);
  if (!findings.checks) return;
  if (const auto warning = blurWarning(status, *findings.options)) warnings.push_back(*warning);
  if (status.scene_unknown && status.events && status.poses) {
    warnings.push_back(noSceneWarning());
  }
}

std::string motionText(const SessionStatus& status, const FusionMapperOptions& options) {
  const MotionCounts& motion = status.counts.motion;
  if (motion.known == 0) return "";
  const std::string use(nameOf(options.keyframe.motion.correct_motion));
  const std::string blur =
      fmt::format("the poses blur the events by {:.1f} pixels", motion.meanBlurPx());
  if (motion.corrected == 0) {
    return fmt::format("correct_motion = {}: no motion was corrected; {} in {} of {} keyframes",
                       use, blur, motion.known, status.counts.keyframes);
  }
  return fmt::format(
      "correct_motion = {}: the motion of {} of {} keyframes was corrected, as {}; they are {:.2f} "
      "times as sharp",
      use, motion.corrected, status.counts.keyframes, blur, motion.meanGain());
}

std::optional<Warning> blurWarning(const SessionStatus& status,
                                   const FusionMapperOptions& options) {
  const MotionCounts& motion = status.counts.motion;
  // Exact poses have up to 0.35 pixels on average, good hand-held trackers 0.55, typical ones 0.8
  // or more. Several cameras: and the correction was worthwhile in most keyframes. One camera: two
  // windows say so, because wrong depths, too, blur the events.
  constexpr double kWorthSayingPx = 0.6;
  if (motion.known == 0 || motion.meanBlurPx() < kWorthSayingPx) return std::nullopt;
  if (selectedCameras(status.rig, options.cameras).size() == 1) {
    if (motion.known == 1) return std::nullopt;
    return Warning{
        "poses-blur",
        fmt::format("the poses blur the events by {:.1f} pixels within a window: with one camera "
                    "this cannot be corrected, because wrong depths explain a wrong motion, and a "
                    "quarter to half of the points may be off by more than 10 %; a second camera, "
                    "or a tracker with an IMU, helps; a wrong clock of the poses, lens or focal "
                    "length blurs them, too",
                    motion.meanBlurPx())};
  }
  if (2 * motion.corrected <= motion.known) return std::nullopt;
  return Warning{
      "poses-blur",
      fmt::format("the poses blur the events by {:.1f} pixels within a window, and the motion of "
                  "{} of {} keyframes was corrected ([refinement] correct_motion): they are {:.2f} "
                  "times as sharp{}; a wrong calibration between the cameras, a lens or pixels of "
                  "another calibration (cropped pictures), or clocks some ms apart blur them, too",
                  motion.meanBlurPx(), motion.corrected, status.counts.keyframes, motion.meanGain(),
                  status.refinement ? ""
                                    : "; their own poses have such errors, too: --set "
                                      "refinement.enabled=true corrects them")};
}

void dropExplainedBlur(std::vector<Warning>& warnings) {
  constexpr std::string_view kMistakes[] = {
      "poses-inverted", "quaternion-order",   "cameras-swapped", "axis-convention",
      "time-shift",     "poses-unexplained",  "depths-disagree", "scale",
      "camera-clocks",  "events-mirrored",    "sensor-area",     "long-lever",
      "no-motion",      "rotation-only",      "speed",           "rotation-rate",
      "pose-jump",      "two-trajectories",   "pose-frame",      "camera-frame",
      "poses-frozen",   "pose-interpolation", "extrinsics"};
  const auto isMistake = [&](const Warning& warning) {
    return std::find(std::begin(kMistakes), std::end(kMistakes), warning.name) !=
           std::end(kMistakes);
  };
  if (std::none_of(warnings.begin(), warnings.end(), isMistake)) return;
  warnings.erase(std::remove_if(warnings.begin(), warnings.end(),
                                [](const Warning& w) { return w.name == "poses-blur"; }),
                 warnings.end());
}

std::optional<Warning> farPointsWarning(const MapCloud& cloud, double voxel_size_m) {
  const auto step_m = coarseStepOf(cloud, voxel_size_m);
  if (!step_m) return std::nullopt;
  const auto& origin = cloud.sensor_origin_;
  return Warning{
      "far-coordinates",
      fmt::format(
          "a float has steps of {:.2g} m at the map's coordinates, over a tenth of a voxel: "
          "x, y and z of the PCD file and of PCL clouds are relative to their origin "
          "(VIEWPOINT, sensor_origin_), ({:.0f}, {:.0f}, {:.0f}), which viewers do not add; "
          "MRPT's maps of points are rounded; map.ply has doubles (--set output.ply=true)",
          *step_m, origin.x(), origin.y(), origin.z())};
}

Warning noSceneWarning() {
  return {
      "no-scene",
      "no scene was found to choose depth limits from, so they are a guess: the camera rests or "
      "only turns, or poses and calibration do not explain the events ([dsi] min_depth_m, "
      "max_depth_m)"};
}

}  // namespace efm
