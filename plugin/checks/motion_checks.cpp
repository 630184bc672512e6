// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/checks/health_checks.h"

#include <fmt/format.h>

#include <algorithm>

#include "mapping/geometry/rigid3.h"
#include "mapping/geometry/timestamp.h"

namespace efm {
namespace {

class MotionChecks {
 public:
  MotionChecks(const Findings& findings, std::vector<Warning>& warnings)
      : recording_(findings.recording),
        depth_m_(2 / (1 / findings.near_depth_m + 1 / findings.far_depth_m)),
        max_gap_s_(findings.max_pose_gap_s),
        warnings_(warnings) {
    for (const auto& [index, camera] : recording_.cameras()) {
      if (isCalibrated(camera.camera.model))
        focal_px_ = std::max(focal_px_, camera.camera.model.fx);
    }
    if (const auto events = findings.events()) events_ = {events->first_ns, events->last_ns};
    if (const PoseStatistics* poses = recording_.usedPoses()) motion_ = poses->motion.completed();
  }

  void run() {
    if (focal_px_ <= 0 || events_.t1_ns <= events_.t0_ns) return;
    checkHolds();
    checkGaps();
    checkSteps();
  }

 private:
  double pixels(const MotionAmount& amount) const {
    return focal_px_ * (amount.m / depth_m_ + amount.rad);
  }
  bool matters(const PoseSpan& span) const {
    return span.t0_ns < events_.t1_ns && span.t1_ns > events_.t0_ns;
  }
  std::string startOf(const PoseSpan& span) const { return timeText(span.t0_ns, events_.t0_ns); }
  static std::string timesText(int count, const char* which) {
    return count > 1 ? fmt::format(", {} times, the {}", count, which) : std::string();
  }

  /// Returns the part of a span with events.
  PoseSpan withEvents(const PoseSpan& span) const {
    return {std::max(span.t0_ns, events_.t0_ns), std::min(span.t1_ns, events_.t1_ns)};
  }
  /// Returns the event rate of all cameras, per second.
  double eventRate(const PoseSpan& span) const {
    const PoseSpan part = withEvents(span);
    if (part.t1_ns <= part.t0_ns) return 0;
    double count = 0;
    for (const auto& [index, camera] : recording_.cameras()) {
      count += camera.rate.countIn(part.t0_ns, part.t1_ns);
    }
    return count / secondsBetween(part.t0_ns, part.t1_ns);
  }

  /// Returns the event rate without the rests of the poses.
  double movingRate() const {
    double moving_s = secondsBetween(events_.t0_ns, events_.t1_ns);
    double count = eventRate(events_) * moving_s;
    for (const PoseMotion::Bin& bin : motion_.bins()) {
      if (!isRest(bin.hold) || !matters(bin.hold)) continue;
      const PoseSpan part = withEvents(bin.hold);
      const double rest_s = secondsBetween(part.t0_ns, part.t1_ns);
      moving_s -= rest_s;
      count -= eventRate(part) * rest_s;
    }
    return moving_s > 0 ? count / moving_s : 0;
  }

  /// Returns whether the events show motion of the rig while its poses repeat.
  bool isFrozen(const PoseHold& hold) const {
    constexpr double kMinHoldS = 0.02;
    // Depth planes are about a pixel apart.
    constexpr double kMinPixels = 3;
    // Before a rest, a rig is slow. During a rest, it has only noise events.
    constexpr double kMinSpeed = 0.25;  // fraction of the mean speed
    constexpr double kMinRate = 0.5;    // fraction of the rate beside the hold, or of the mean rate
    constexpr std::int64_t kBesideNs = 200'000'000;
    if (!matters(hold)) return false;
    const PoseSpan part = withEvents(hold);
    const double hold_s = secondsBetween(part.t0_ns, part.t1_ns);
    const double speed = pixels(hold.speed);  // per second
    if (hold_s < kMinHoldS || speed * hold_s < kMinPixels) return false;
    if (speed < kMinSpeed * pixels(motion_.meanSpeed())) return false;
    const PoseSpan beside = hold.speed_after ? PoseSpan{hold.t1_ns, hold.t1_ns + kBesideNs}
                                             : PoseSpan{hold.t0_ns - kBesideNs, hold.t0_ns};
    const double rate = eventRate(part);
    return rate > 0 && rate >= kMinRate * std::min(eventRate(beside), movingRate());
  }

  void checkHolds() {
    int count = 0;
    PoseHold longest;
    for (const PoseMotion::Bin& bin : motion_.bins()) {
      if (!isFrozen(bin.hold)) continue;
      ++count;
      const auto length_ns = [](const PoseHold& hold) { return hold.t1_ns - hold.t0_ns; };
      if (length_ns(bin.hold) > length_ns(longest)) longest = bin.hold;
    }
    if (count == 0) return;
    const double hold_s = secondsBetween(longest.t0_ns, longest.t1_ns);
    addWarning(warnings_, "poses-frozen",
               "the poses repeat{} for {:.3g} s, after {}, while events come at {:.0f} % of their "
               "mean rate: at the speed {} it the image moves by {:.3g} pixels in this time; does "
               "the tracker hang? Take the repeated poses out (--poses): events in gaps over "
               "max_pose_gap_s are not used",
               timesText(count, "longest"), hold_s, startOf(longest),
               100 * eventRate(longest) / eventRate(events_),
               longest.speed_after ? "after" : "before", pixels(longest.speed) * hold_s);
  }

  void checkGaps() {
    // The motion is visible, and interpolation misses half of the distance of two planes. Measured
    // on hand-held and helmet trajectories with left-out poses: the estimate is within 40 % of the
    // true miss, 1 to 2 pixels at 0.1 s, 2 to 7 at 0.2 s.
    constexpr double kMinMoved = 3;
    constexpr double kMinMissed = 0.5;
    int count = 0;
    PoseGap worst;
    for (const PoseMotion::Bin& bin : motion_.bins()) {
      const PoseGap& gap = bin.gap;
      if (!matters(gap) || secondsBetween(gap.t0_ns, gap.t1_ns) > max_gap_s_) continue;
      if (pixels(gap.moved) < kMinMoved || pixels(gap.missed) < kMinMissed) continue;
      ++count;
      if (pixels(gap.missed) > pixels(worst.missed)) worst = gap;
    }
    if (count == 0) return;
    addWarning(warnings_, "pose-interpolation",
               "poses are {:.3g} s apart{}, after {}: the image moves by {:.3g} pixels meanwhile, "
               "and "
               "straight interpolation misses some {:.2g} of them; a pose at least every 0.1 s is "
               "needed (--poses), or --set rig.max_pose_gap_s=0.1 leaves these events out",
               secondsBetween(worst.t0_ns, worst.t1_ns), timesText(count, "worst"), startOf(worst),
               pixels(worst.moved), pixels(worst.missed));
  }

  /// Returns the deviation that most steps stay below, without possible jumps; std::nullopt if
  /// there are too few steps.
  std::optional<double> usualDeviation(PoseStep PoseMotion::Bin::*kind) const {
    constexpr std::size_t kMinBins = 10;
    constexpr std::size_t kMaxJumps = 3;  // largest steps that are left out
    constexpr double kMost = 0.9;
    std::vector<double> deviations;
    for (const PoseMotion::Bin& bin : motion_.bins()) {
      if ((bin.*kind).deviation >= 0) deviations.push_back((bin.*kind).deviation);
    }
    if (deviations.size() < kMinBins) return std::nullopt;
    std::sort(deviations.begin(), deviations.end());
    deviations.resize(deviations.size() - kMaxJumps);
    return deviations[static_cast<std::size_t>(kMost * static_cast<double>(deviations.size()))];
  }

  /// Jumps in translation or rotation.
  struct Jumps {
    int count = 0;
    PoseStep largest;
    double usual = 0;   // usual deviation, m/s or rad/s
    double pixels = 0;  // of the largest jump
  };

  static double sizeOf(const PoseStep& step) {
    return step.deviation * secondsBetween(step.t0_ns, step.t1_ns);
  }

  /// @param weight factor from the deviation to the unit image plane.
  Jumps jumpsOf(PoseStep PoseMotion::Bin::*kind, double weight) const {
    // Four measured trajectories have steps of up to 8 times the usual deviation.
    constexpr double kMinRatio = 12;
    constexpr double kMinPixels = 2;
    Jumps jumps;
    const std::optional<double> usual = usualDeviation(kind);
    if (!usual) return jumps;
    jumps.usual = *usual;
    for (const PoseMotion::Bin& bin : motion_.bins()) {
      const PoseStep& step = bin.*kind;
      const double pixels = focal_px_ * weight * sizeOf(step);
      if (!matters(step) || step.deviation <= kMinRatio * *usual || pixels < kMinPixels) continue;
      ++jumps.count;
      if (pixels <= jumps.pixels) continue;
      jumps.pixels = pixels;
      jumps.largest = step;
    }
    return jumps;
  }

  void checkSteps() {
    const Jumps shifts = jumpsOf(&PoseMotion::Bin::step_m, 1 / depth_m_);
    const Jumps turns = jumpsOf(&PoseMotion::Bin::step_rad, 1);
    const bool turned = turns.pixels > shifts.pixels;
    const Jumps& jumps = turned ? turns : shifts;
    if (jumps.count == 0) return;
    const double per_unit = turned ? 1 / kRadiansPerDegree : 1;
    const char* const unit = turned ? "degrees" : "m";
    addWarning(warnings_, "pose-jump",
               "the poses jump by {:.3g} {} after {}{}: {:.3g} pixels, at {:.3g} {}/s beside "
               "the motion before and after, where {:.2g} are usual; a loop closure or a "
               "lost tracker? What is mapped before and after does not fit together: give a "
               "trajectory that was optimised as a whole (--poses), or map both parts apart "
               "(--t0, --t1)",
               per_unit * sizeOf(jumps.largest), unit, startOf(jumps.largest),
               jumps.count > 1 ? fmt::format(", the largest of {}", jumps.count) : std::string(),
               jumps.pixels, per_unit * jumps.largest.deviation, unit, per_unit * jumps.usual);
  }

  const RecordingStatistics& recording_;
  double depth_m_;  // middle depth of the scene, for the motion in pixels
  double max_gap_s_;
  double focal_px_ = 0;
  PoseSpan events_;  // time of the events
  PoseMotion motion_;
  std::vector<Warning>& warnings_;
};

}  // namespace

void checkMotion(const Findings& findings, std::vector<Warning>& warnings) {
  const PoseStatistics* const poses = findings.recording.usedPoses();
  if (const auto conflict = poses != nullptr ? poses->check.conflict() : std::nullopt) {
    addWarning(
        warnings, "two-trajectories",
        "{} of {} {}, first {:.3g} m and {:.3g} degrees apart: the poses of two bodies? Give "
        "those of one",
        conflict->count, conflict->of,
        conflict->equal_times ? "times have poses that differ" : "poses change between two places",
        conflict->distance_m, conflict->angle_rad / kRadiansPerDegree);
  }
  MotionChecks(findings, warnings).run();
}

}  // namespace efm
