// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/recording_survey.h"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <stdexcept>
#include <utility>

#include "mapping/events/even_choice.h"
#include "mapping/geometry/timestamp.h"
#include "mapping/survey/depth_agreement.h"
#include "plugin/session/pose_warning.h"

namespace efm {
namespace {

/// Poses reach this far around the middle of a sample: see `window_sample.h`.
constexpr double kWindowS = 2;
constexpr double kMaxEventsPerSecond = 1e6;

void thinOut(CameraPacket& packet) {
  if (packet.events.size() < 2) return;
  const double length_s = secondsBetween(packet.events.front().t_ns, packet.events.back().t_ns);
  const auto limit = static_cast<std::size_t>(std::max(1e3, kMaxEventsPerSecond * length_s));
  std::vector<Event> chosen;
  chooseEvenly(packet.events, limit, chosen);
  if (!chosen.empty()) packet.events = std::move(chosen);
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
  PoseVerdict verdict;
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

RecordingSurveyor::RecordingSurveyor(const EventFusionOptions& options)
    : session_(surveyOptions(options)) {}

void RecordingSurveyor::addEvents(CameraPacket packet) {
  thinOut(packet);
  session_.addEvents(std::move(packet));
  takeWindows();
}

void RecordingSurveyor::addPose(const StampedPose& pose, const PoseSourceId& source) {
  session_.addPose(pose, source);
  takeWindows();
}

void RecordingSurveyor::takeWindows() {
  while (const std::optional<WindowData> data = session_.window()) {
    samples_.add(*data);
    session_.skipWindow(data->window);
  }
}

RecordingSurvey RecordingSurveyor::finish() {
  try {
    session_.finish();
    if (samples_.samples().empty()) {
      if (const std::optional<WindowData> rest = session_.window()) samples_.add(*rest);
    }
  } catch (const std::exception&) {
  }
  const SessionStatus status = session_.status();
  RecordingSurvey result{status.rig, samples_.take(), std::nullopt};
  if (status.events && status.poses) {
    result.duration_s = secondsBetween(std::max(status.events->first_ns, status.poses->first_ns),
                                       std::min(status.events->last_ns, status.poses->last_ns));
  }
  return result;
}

}  // namespace efm
