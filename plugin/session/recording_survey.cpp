// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/recording_survey.h"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <stdexcept>
#include <utility>

#include "mapping/events/event.h"
#include "mapping/geometry/timestamp.h"
#include "mapping/survey/depth_agreement.h"
#include "plugin/session/health_checks.h"

namespace efm {
namespace {

/// Poses reach this far around the middle of a sample: see `scene_depths.h`.
constexpr double kWindowS = 2;
constexpr double kMaxEventsPerSecond = 1e6;

EventPacket thinnedOut(const EventPacket& packet) {
  double length_s = 0;
  if (!packet.events.empty()) {
    length_s = secondsBetween(packet.events.front().t_ns, packet.events.back().t_ns);
  }
  const auto limit = static_cast<std::size_t>(std::max(1e3, kMaxEventsPerSecond * length_s));
  return {packet.camera,           packet.calibration, chosenEvenly(packet.events, limit),
          packet.covered_until_ns, packet.t_ns,        packet.checked};
}

/// Not in live operation, which maps windows and forgets them.
EventFusionOptions surveyOptions(EventFusionOptions options) {
  options.live.enabled = false;
  options.automatic = {};
  options.refinement.enabled = false;
  options.mapper = surveyOptions(options.mapper, kWindowS);
  return options;
}

/// A mistake that is named says more than that depths disagree.
std::optional<Warning> mistakeIn(const RecordingSurvey& survey,
                                 const FusionMapperOptions& options) {
  const auto finding = checkPoses(survey.rig, survey.samples, options);
  if (finding && finding->mistake != PoseMistake::kUnknown) {
    return poseWarning(*finding, survey.rig);
  }
  if (const auto agreement = depthAgreement(survey.rig, survey.samples, options)) {
    if (const auto warning = agreementWarning(*agreement)) return warning;
  }
  if (finding) return poseWarning(*finding, survey.rig);
  return std::nullopt;
}

}  // namespace

PoseVerdict RecordingSurvey::judgePoses(const FusionMapperOptions& options) const {
  constexpr double kMaxChange = 0.08;  // of depths that are believed
  constexpr double kMaxLeverM = 20;
  PoseVerdict verdict;
  if (lever_m > kMaxLeverM) {  // what follows from it would blame the poses
    verdict.warnings.push_back(
        {"long-lever",
         fmt::format("the rig is {:.4g} m from the tracked body: expected at most {:g}; is the "
                     "translation of T_body_rig in metres (--hand-eye)?",
                     lever_m, kMaxLeverM)});
    return verdict;
  }
  try {
    if (const auto warning = mistakeIn(*this, options)) verdict.warnings.push_back(*warning);
    const auto sensitivity = depthSensitivity(rig, samples, options);
    if (!sensitivity) return verdict;
    if (const auto warning = sensitivityWarning(*sensitivity)) verdict.warnings.push_back(*warning);
    if (sensitivity->per_10_ms > kMaxChange) {
      verdict.doubts.push_back(
          fmt::format("a clock of the poses that is off by 10 ms changes the depths by {:.2g} %",
                      100 * sensitivity->per_10_ms));
    }
  } catch (const std::invalid_argument&) {
  }
  return verdict;
}

double eventRate(const WindowData& data) {
  std::size_t events = 0;
  for (const EventSpan& span : data.events) events += span.size();
  return static_cast<double>(events) / secondsBetween(data.window.t0_ns, data.window.t1_ns);
}

RecordingSurveyor::RecordingSurveyor(const EventFusionOptions& options)
    : session_(surveyOptions(options)) {}

void RecordingSurveyor::add(const Sample& sample) {
  if (const auto* packet = std::get_if<EventPacket>(&sample)) {
    addEvents(*packet);
  } else if (const auto* pose = std::get_if<PoseSample>(&sample)) {
    const std::optional<Rigid3>& given = session_.setup().T_body_rig;
    addPose({pose->t_ns, rigPose(*pose, given)}, pose->source, given.value_or(pose->T_body_rig));
  }
}

void RecordingSurveyor::addEvents(const EventPacket& packet) {
  received_ += packet.events.size();
  session_.addEvents(thinnedOut(packet));
  takeWindows();
}

void RecordingSurveyor::addPose(const StampedPose& pose, const PoseSourceId& source,
                                const Rigid3& T_body_rig) {
  lever_m_ = std::max(lever_m_, T_body_rig.translation.norm());
  session_.addPose(pose, source);
  takeWindows();
}

void RecordingSurveyor::takeWindows() {
  while (const std::optional<WindowData> data = session_.window()) {
    take(*data);
    session_.skipWindow(data->window);
  }
}

void RecordingSurveyor::take(const WindowData& data) {
  samples_.add(data);
  most_events_per_s_ = std::max(most_events_per_s_, eventRate(data));
}

RecordingSurvey RecordingSurveyor::finish() {
  try {
    session_.finish();
    if (samples_.samples().empty()) {
      if (const std::optional<WindowData> rest = session_.window()) take(*rest);
    }
  } catch (const std::exception&) {
  }
  const SessionStatus status = session_.status();
  RecordingSurvey result{status.rig, samples_.take(), std::nullopt, most_events_per_s_, lever_m_};
  if (const std::uint64_t chosen = status.counts.total().read) {
    result.most_events_per_s *= static_cast<double>(received_) / static_cast<double>(chosen);
  }
  if (status.events && status.poses) {
    result.duration_s = secondsBetween(std::max(status.events->first_ns, status.poses->first_ns),
                                       std::min(status.events->last_ns, status.poses->last_ns));
  }
  return result;
}

}  // namespace efm
