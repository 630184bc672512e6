// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/playback/recording_info.h"

#include <nlohmann/json.hpp>

#include <stdexcept>
#include <utility>

#include "plugin/engine/first_look.h"
#include "plugin/options/option_keys.h"
#include "plugin/results/output/report.h"
#include "plugin/session/session_status.h"

namespace efm {
namespace {

using Json = nlohmann::ordered_json;

/// Takes the values that `map` would choose, and the warnings: the chosen depths serve the checks.
void judge(FirstLook* look, RecordingInfo& info) {
  Findings findings{info.statistics, info.counts};
  if (look != nullptr) {
    const RecordingSurvey survey = look->finish();
    if (!survey.samples.empty()) {
      Chosen chosen = chooseAndJudge(survey, defaultOptions());
      info.chosen = std::move(chosen.choice.options);
      findings.use(chosen.mapper.keyframe.planes, info.chosen);
      info.warnings = std::move(chosen.verdict.warnings);
      info.notes = std::move(chosen.verdict.notes);
    }
  }
  append(info.warnings, warningsOf(findings));
  append(info.notes, info.counts.notes);
}

/// Adds the number of samples of a stream, and their times.
void add(Json& json, const char* what, const StreamStatistics& stream) {
  json[what] = stream.count;
  if (!stream.first_ns) return;
  json["first_ns"] = *stream.first_ns;
  json["last_ns"] = *stream.last_ns;
  json["per_second"] = stream.rate();
}

Json asJson(const CameraStatistics& statistics) {
  const CameraModel& model = statistics.camera.model;
  Json json = {{"name", statistics.label}, {"width", model.width}, {"height", model.height}};
  json["calibrated"] = isCalibrated(model);
  add(json, "events", statistics.events);
  json["positive"] = statistics.positive;
  return json;
}

Json asJson(const PoseSourceId& source, const PoseStatistics& statistics, bool used) {
  const StreamStatistics& poses = statistics.poses;
  Json json = {{"source", asText(source)}, {"used", used}};
  add(json, "poses", poses);
  if (poses.count < 2) return json;
  json["max_gap_s"] = 1e-9 * static_cast<double>(poses.max_gap_ns);
  json["path_m"] = statistics.path_m;
  json["max_speed_m_s"] = statistics.max_speed;
  json["max_rotation_rad_s"] = statistics.max_rotation_rate;
  return json;
}

}  // namespace

RecordingInfo readInfo(RecordingSource source, const std::function<void(double)>& progress) {
  source.faults.latency_ns = 0;  // latency changes no time stamp
  source.complete = false;
  source.reader.lists_topics = true;
  const std::unique_ptr<Recording> recording = openRecording(source);
  RecordingInfo info;
  info.statistics.setCameras(recording->rig(), recording->cameras());
  FirstLook look(defaultOptions());
  bool takes = look.take(recording->rig());  // a recording may lack parts of a map
  while (const std::optional<Sample> sample = recording->read()) {
    ++info.observations;
    if (!info.statistics.add(*sample)) ++info.others[std::get<OtherSample>(*sample).type];
    takes = look.take(*sample);
    if (progress) progress(recording->progress());
  }
  info.error = recording->damage();
  info.counts = recording->counts();
  if (info.error.empty() && !info.statistics.eventSpan()) {
    info.error = limitsWithoutEvents(source.limits, *recording);
  }
  info.true_depth_maps = openTruth(source).size();
  if (info.error.empty()) judge(takes ? &look : nullptr, info);
  return info;
}

std::string infoJson(const RecordingInfo& info) {
  Json json = {{"observations", info.observations}};
  json["cameras"] = Json::array();
  for (const auto& [index, camera] : info.statistics.cameras()) {
    json["cameras"].push_back(asJson(camera));
  }
  json["poses"] = Json::array();
  for (const auto& [source, poses] : info.statistics.poseSources()) {
    json["poses"].push_back(asJson(source, poses, &poses == info.statistics.usedPoses()));
  }
  json["events_before_poses"] = info.statistics.eventsBeforePoses();
  json["events_after_poses"] = info.statistics.eventsAfterPoses();
  json["topics"] = Json::array();
  for (const RecordedTopic& topic : info.counts.topics) {
    Json& added = json["topics"].emplace_back(Json{{"name", topic.name}, {"type", topic.type}});
    added["messages"] = topic.messages;
    if (topic.from_ns > topic.until_ns) continue;
    added["from_ns"] = topic.from_ns;
    added["until_ns"] = topic.until_ns;
  }
  json["transforms"] = Json::array();
  for (const RecordedTransform& transform : info.counts.transforms) {
    json["transforms"].push_back({{"parent", transform.parent},
                                  {"child", transform.child},
                                  {"moves", transform.moves},
                                  {"messages", transform.count}});
  }
  json["others"] = info.others;
  json["sorted_events"] = info.counts.sorted_events;
  json["true_depth_maps"] = info.true_depth_maps;
  json["chosen"] = asJson(info.chosen);
  json["warnings"] = asJson(info.warnings);
  json["notes"] = asJson(info.notes);
  return json.dump(2, ' ', false, Json::error_handler_t::replace);
}

std::string limitsWithoutEvents(const TimeLimits& limits, const Recording& recording) {
  if ((!limits.t0_ns && !limits.t1_ns) || recording.rig().cameras.empty()) return {};
  return noEventText(limits, recording.counts());
}

void rejectLimitsWithoutEvents(const TimeLimits& limits, const Recording& recording) {
  const std::string error = limitsWithoutEvents(limits, recording);
  if (!error.empty()) throw std::runtime_error(error);
}

}  // namespace efm
