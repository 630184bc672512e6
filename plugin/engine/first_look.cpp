// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/engine/first_look.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <stdexcept>
#include <utility>

#include "mapping/events/event.h"
#include "mapping/geometry/rigid3.h"
#include "mapping/geometry/timestamp.h"
#include "mapping/survey/camera_check.h"
#include "mapping/survey/depth_agreement.h"
#include "plugin/checks/health_checks.h"

namespace efm {
namespace {

/// Length of the sampled windows, seconds; they do not overlap. See `scene_depths.h`.
constexpr double kWindowS = 2;
constexpr double kMaxEventsPerSecond = 1e6;
/// Events are subsampled in periods of this grid, so that the choice does not depend on packets.
constexpr std::int64_t kPeriodNs = 10'000'000;

std::int64_t periodOf(std::int64_t t_ns) {
  return t_ns / kPeriodNs - (t_ns % kPeriodNs < 0 ? 1 : 0);
}

std::vector<Event> subsampled(EventSpan events) {
  const double length_s = secondsBetween(events.begin()->t_ns, (events.end() - 1)->t_ns);
  return chosenEvenly(events,
                      static_cast<std::size_t>(std::max(1e3, kMaxEventsPerSecond * length_s)));
}

/// Returns the fraction of the depths that a fault between two cameras makes wrong, beside those
/// beyond its sure depth. Measured with simulated recordings.
double wrongBy(const CameraComparison& found) {
  const double angle_deg = found.angle_rad / kRadiansPerDegree;
  switch (found.fault) {
    case CameraFault::kAcross:
      return std::min(0.6, 0.4 * angle_deg);
    case CameraFault::kRoll:
      return std::min(0.6, 0.2 * angle_deg);
    case CameraFault::kClock:
      return std::min(0.6, 0.06 * found.shift_px);
    case CameraFault::kFocalLength:
      return std::min(0.7, 0.12 * found.shift_px);
    case CameraFault::kUnknown:  // mostly a tracker's error
      return 0.04;
    default:
      return 0;
  }
}

/// Takes the comparison of two cameras into a verdict.
void use(const CameraComparison& found, const Rig& rig, PoseVerdict& verdict) {
  QualityFacts& quality = verdict.quality;
  quality.wrong_by_cameras = std::max(quality.wrong_by_cameras, wrongBy(found));
  if (found.fault == CameraFault::kUnknown) {
    quality.doubts.push_back(fmt::format(
        "the maps of cameras {} and {} alone differ, and the poses blur the events too much to "
        "tell whether the calibration between the cameras is wrong",
        found.other, found.camera));
  } else {
    quality.sure_depth_m = std::min(quality.sure_depth_m, found.sure_depth_m);
  }
  if (auto warning = cameraWarning(found, rig)) {
    verdict.warnings.push_back(std::move(*warning));
    verdict.keep_motion = true;
  }
}

/// Returns whether a comparison of the cameras explains the events better than a mistake of a clock
/// does, which a rotation, an offset of some milliseconds and a scale resemble.
/// @param gain of sharpness by what was compared.
bool explains(const CameraComparison& found, double gain, const PoseFinding& clock) {
  constexpr double kSeenS = 0.05;   // larger offsets may hide from the comparison,
  constexpr double kFit = 0.6;      // and so may all if the maps do not fit
  constexpr double kMargin = 1.05;  // a small gain of a clock proves little
  if (found.fault == CameraFault::kUnknown) return false;
  if (found.fault != CameraFault::kNone) return kMargin * gain >= clock.gain;
  return clock.camera == static_cast<std::size_t>(found.camera) && found.correlation >= kFit &&
         std::abs(clock.shift_s) < kSeenS;
}

/// Judges the poses and the cameras. What makes the events sharpest is named.
void judge(const RecordingSurvey& survey, const FusionMapperOptions& options,
           PoseVerdict& verdict) {
  const PoseJudgement judgement = checkPoses(survey.rig, survey.samples, options);
  const std::optional<PoseFinding>& finding = judgement.finding;
  QualityFacts& quality = verdict.quality;
  quality.unchecked = judgement.unchecked;
  quality.sharpness = judgement.sharpness;
  const auto warn = [&](Warning warning) {
    quality.mistake = warning.name;
    verdict.warnings.push_back(std::move(warning));
  };
  const bool is_known = finding && finding->mistake != PoseMistake::kUnknown;
  const bool is_camera_clock = finding && finding->mistake == PoseMistake::kCameraClock;
  if (is_known && !is_camera_clock && finding->mistake != PoseMistake::kTimeShift) {
    return warn(poseWarning(*finding, survey.rig));
  }
  auto compared = compareCameras(survey.rig, survey.samples, options);
  const auto agreement = depthAgreement(survey.rig, survey.samples, options);
  auto disagreement = agreement ? agreementWarning(*agreement) : std::nullopt;
  double scale = disagreement && disagreement->name == "scale" ? agreement->scale : 1;
  for (const CameraComparison& found : compared) {
    if (scale != 1 || found.scale == 1) continue;
    scale = found.scale;
    disagreement = agreementWarning({scale, 1});
  }
  const auto gainOf = [&](const CameraComparison& found, double travel) {
    return sharpnessGain(found, travel, survey.rig, survey.samples, options);
  };
  // A tracker's errors look like a fault of the cameras, but its cure sharpens nothing. Simulated
  // faults have a gain of 1.002 and more; among three cameras, where the cure of one pair moves a
  // camera against the third, 0.99; trackers 0.975 to 0.99.
  const double min_gain = compared.size() == 1 ? 0.998 : 0.988;
  constexpr double kMinGainAlong = 1.01;  // a rotation along the epipolar lines, by blurred maps
  const auto isNamed = [](const CameraComparison& found) {
    return found.fault != CameraFault::kNone && found.fault != CameraFault::kUnknown;
  };
  for (CameraComparison& found : compared) {
    const bool is_doubtful = found.fault == CameraFault::kAlong && found.blurred;
    if (isNamed(found) && gainOf(found, 1) < (is_doubtful ? kMinGainAlong : min_gain)) {
      found.fault = CameraFault::kUnknown;
    }
  }
  const double scale_gain = scale == 1 ? 0 : gainOf({}, 1 / scale);
  const auto explainsClock = [&](const CameraComparison& found) {
    return explains(found, isNamed(found) ? gainOf(found, 1) : 1, *finding);
  };
  if (is_known && scale_gain < finding->gain &&
      std::none_of(compared.begin(), compared.end(), explainsClock)) {
    verdict.keep_motion = is_camera_clock;
    return warn(poseWarning(*finding, survey.rig));
  }
  // A rotation along the epipolar lines looks like a scale, but at one depth alone.
  const auto isBetterThanScale = [&](const CameraComparison& found) {
    constexpr double kMargin = 1.1;  // a wrong scale is up to 5 % sharper than the right clock
    if (scale == 1) return true;
    if (found.fault == CameraFault::kNone) return false;  // nothing to cure
    if (kMargin * gainOf(found, 1) < scale_gain) return false;
    if (found.fault == CameraFault::kClock) return true;
    const auto fitted = depthAgreement(fittedRig(found, survey.rig), survey.samples, options);
    return fitted && fitted->agreeing > (agreement ? agreement->agreeing : 0);
  };
  for (const CameraComparison& found : compared) {
    if (isBetterThanScale(found)) use(found, survey.rig, verdict);
  }
  if (verdict.keep_motion) return;
  if (agreement) quality.motion_agreement = agreement->agreeing;
  if (disagreement) {
    if (!judgement.unchecked.empty()) disagreement->text += "; but " + judgement.unchecked;
    return warn(std::move(*disagreement));
  }
  if (finding && !is_known) return warn(poseWarning(*finding, survey.rig));
  if (!judgement.unchecked.empty()) {
    verdict.notes.push_back({"poses-unchecked", judgement.unchecked});
  }
}

PoseVerdict judgePoses(const RecordingSurvey& survey, const FusionMapperOptions& options) {
  constexpr double kMaxChange = 0.08;  // of reliable depths
  constexpr double kMaxLeverM = 20;
  PoseVerdict verdict;
  if (survey.lever_m > kMaxLeverM)
    return verdict;  // long-lever: further checks would blame the poses
  for (const RigCamera& camera : survey.rig.cameras) {
    for (const Warning& warning : calibrationWarnings(0, camera.model)) {
      if (warning.name != "principal-point") return verdict;  // no pose explains such rays
    }
  }
  try {
    judge(survey, options, verdict);
    const auto sensitivity = depthSensitivity(survey.rig, survey.samples, options);
    if (!sensitivity) return verdict;
    if (const auto warning = sensitivityWarning(*sensitivity)) verdict.warnings.push_back(*warning);
    if (sensitivity->per_10_ms > kMaxChange) {
      verdict.quality.doubts.push_back(
          fmt::format("a clock of the poses that is off by 10 ms changes the depths by {:.2g} %",
                      100 * sensitivity->per_10_ms));
    }
  } catch (const std::invalid_argument&) {
  }
  return verdict;
}

}  // namespace

Chosen chooseAndJudge(const RecordingSurvey& survey, const EventFusionOptions& options) {
  Chosen chosen = choose(survey, options);
  if (options.checks) chosen.verdict = judgePoses(survey, chosen.mapper);
  MotionCorrectionUse& use = chosen.mapper.keyframe.motion.correct_motion;
  if (chosen.verdict.keep_motion && use == MotionCorrectionUse::kAuto) {
    use = MotionCorrectionUse::kNever;
  }
  return chosen;
}

FirstLook::FirstLook(const EventFusionOptions& options)
    : options_(options),
      pose_source_(options.rig.pose_source),
      mapper_(surveyOptions(mapperOptions(options), kWindowS)) {}

bool FirstLook::take(const Rig& rig) {
  try {
    requireMappable(rig, options_);
    for (const RigCamera& camera : rig.cameras) mapper_.addCamera(camera);
  } catch (const std::invalid_argument&) {
    takes_ = false;
  }
  return takes_;
}

void FirstLook::addEvents(const EventPacket& packet) {
  const auto isEarlier = [](const Event& a, const Event& b) { return a.t_ns < b.t_ns; };
  const int camera = packet.camera;
  const RigCamera& calibration = mapper_.rig().cameras.at(static_cast<std::size_t>(camera));
  received_ += packet.events.size();
  Waiting& waiting = waiting_[camera];
  std::vector<Event>& events = waiting.events;
  events.insert(events.end(), packet.events.begin(), packet.events.end());
  if (!std::is_sorted(events.begin(), events.end(), isEarlier)) {
    std::stable_sort(events.begin(), events.end(), isEarlier);
  }
  if (!events.empty()) waiting.newest_ns = std::max(waiting.newest_ns, events.back().t_ns);
  addPeriods(camera, std::max(waiting.newest_ns - kMaxEventDelayNs,
                              packet.complete_until_ns.value_or(-kEndOfTimeNs)));
  if (packet.complete_until_ns) {
    const std::int64_t waits_ns = events.empty() ? kMaxTimeNs : events.front().t_ns;
    mapper_.setCompleteUntil(camera, std::min(*packet.complete_until_ns, waits_ns));
  }
  if (!packet.events.empty()) {
    extend(begins_, packet.events.front().t_ns + calibration.time_offset_ns);
    if (begins_->last_ns - begins_->first_ns > kMaxSourceWaitNs) usePoses(pose_source_.select());
  }
  takeWindows();
}

/// Adds the periods of a camera's waiting events that end before a time.
void FirstLook::addPeriods(int camera, std::int64_t complete_ns) {
  const auto inPeriod = [](const Event& a, const Event& b) {
    return periodOf(a.t_ns) < periodOf(b.t_ns);
  };
  std::vector<Event>& events = waiting_[camera].events;
  const auto end =
      std::partition_point(events.begin(), events.end(), [complete_ns](const Event& event) {
        return (periodOf(event.t_ns) + 1) * kPeriodNs <= complete_ns;
      });
  const std::vector<Event> complete(events.begin(), end);
  events.erase(events.begin(), end);  // also if one is rejected
  const std::int64_t offset_ns =
      mapper_.rig().cameras[static_cast<std::size_t>(camera)].time_offset_ns;
  for (auto first = complete.begin(); first != complete.end();) {
    const auto last = std::upper_bound(first, complete.end(), *first, inPeriod);
    std::vector<Event> chosen = subsampled({&*first, &*first + (last - first)});
    extend(events_, chosen.front().t_ns + offset_ns);
    extend(events_, chosen.back().t_ns + offset_ns);
    mapper_.addEvents(camera, CheckedEvents(std::move(chosen)));
    first = last;
  }
}

void FirstLook::addPose(const PoseSample& pose) {
  lever_m_ = std::max(lever_m_, pose.T_body_rig.translation.norm());
  usePoses(pose_source_.add(pose.source, {pose.t_ns, pose.T_world_rig()}));
  takeWindows();
}

void FirstLook::usePoses(const std::vector<StampedPose>& poses) {
  for (const StampedPose& pose : poses) {
    mapper_.addPose(pose);
    extend(poses_, pose.t_ns);
  }
}

void FirstLook::takeWindows() {
  if (mapper_.rig().cameras.empty()) return;
  while (const std::optional<WindowData> data = mapper_.window()) {
    keep(*data);
    mapper_.skipWindow(data->window);
  }
}

void FirstLook::keep(const WindowData& data) {
  samples_.add(data);
  most_events_per_s_ = std::max(most_events_per_s_, eventRate(data));
}

bool FirstLook::take(const Sample& sample) {
  if (!takes_) return false;
  try {
    if (const auto* packet = std::get_if<EventPacket>(&sample)) addEvents(*packet);
    if (const auto* pose = std::get_if<PoseSample>(&sample)) addPose(*pose);
  } catch (const std::exception&) {
    takes_ = false;
  }
  return takes_;
}

RecordingSurvey FirstLook::finish() {
  try {
    for (const auto& [camera, waiting] : waiting_) addPeriods(camera, kMaxTimeNs);
    usePoses(pose_source_.select());
    takeWindows();
    mapper_.finish();
    if (samples_.samples().empty()) {
      if (const std::optional<WindowData> rest = mapper_.window()) keep(*rest);
    }
  } catch (const std::exception&) {  // the pass that maps reports it
  }
  RecordingSurvey result{mapper_.rig(),      samples_.take(), std::nullopt,
                         most_events_per_s_, lever_m_,        mapper_.undistortion()};
  if (const std::uint64_t chosen = mapper_.readEvents()) {
    result.most_events_per_s *= static_cast<double>(received_) / static_cast<double>(chosen);
  }
  if (events_ && poses_) {
    result.duration_s = secondsBetween(std::max(events_->first_ns, poses_->first_ns),
                                       std::min(events_->last_ns, poses_->last_ns));
  }
  return result;
}

}  // namespace efm
