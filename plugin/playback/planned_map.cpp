// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/playback/planned_map.h"

namespace efm {
namespace {

using Json = nlohmann::ordered_json;

/// Visits the counts of a pass, but for those of single cameras.
template <typename Counts, typename Read, typename Visit>
void visitCounts(Counts& counts, Read& read, const Visit& visit) {
  visit("windows_without_events", counts.windows_without_events);
  visit("keyframes_without_pose", counts.keyframes_without_pose);
  visit("sorted_by_mapping", counts.sorted_events);
  visit("sorted", read.sorted_events);
  visit("lost_packets", read.lost_packets);
  visit("undated", read.undated_events);
  visit("skipped", read.skipped_events);
  visit("first_skipped", read.first_skipped);
}

}  // namespace

void EventPass::addTo(SessionStatus& status, RecordingCounts& of_recording) const {
  status.counts += counts;
  status.events = events;
  of_recording.sorted_events = read.sorted_events;
  of_recording.lost_packets = read.lost_packets;
  of_recording.undated_events = read.undated_events;
  of_recording.skipped_events = read.skipped_events;
  of_recording.first_skipped = read.first_skipped;
  of_recording.warnings = read.warnings;
}

std::vector<Window> PlannedMap::windowsOf(const KeyframeRange& range) const {
  std::vector<Window> windows;
  for (std::uint64_t i = range.begin; i < range.end; ++i) windows.push_back(keyframes[i].window);
  return windows;
}

void PlannedMap::addTo(Json& json) const {
  json["run"] = run;
  if (!from_begin.empty()) json["from_begin"] = from_begin;
  json["read_s"] = read_s;
  json["reach_s"] = reach_s;
  Json& events = json["events"];
  if (pass.events) events["times_ns"] = {pass.events->first_ns, pass.events->last_ns};
  visitCounts(pass.counts, pass.read,
              [&](const char* key, const auto& value) { events[key] = value; });
  for (const Warning& warning : pass.read.warnings) {
    events["warnings"].push_back({warning.name, warning.text});
  }
  if (!pass.error.empty()) events["error"] = pass.error;
  for (const EventCounts& camera : pass.counts.cameras) {
    Json& of_camera = events["cameras"].emplace_back(Json{{"read", camera.read}});
    for (const auto& row : kEventFates) of_camera[row.key] = camera.fates[row.fate];
  }
  Json& windows = json["windows_ns"] = Json::array();  // t0, t1, t_ref, and the number of events
  for (const auto& [window, count] : keyframes) {
    windows.push_back({window.t0_ns, window.t1_ns, window.t_ref_ns, count});
  }
}

PlannedMap PlannedMap::of(const Json& json) {
  PlannedMap plan;
  plan.run = json.at("run");
  plan.from_begin = json.value("from_begin", "");
  json.at("read_s").get_to(plan.read_s);
  json.at("reach_s").get_to(plan.reach_s);
  const Json& events = json.at("events");
  if (const auto times = events.find("times_ns"); times != events.end()) {
    plan.pass.events = TimeSpan{times->at(0), times->at(1)};
  }
  visitCounts(plan.pass.counts, plan.pass.read,
              [&](const char* key, auto& value) { events.at(key).get_to(value); });
  for (const Json& warning : events.value("warnings", Json::array())) {
    plan.pass.read.warnings.push_back({warning.at(0), warning.at(1)});
  }
  plan.pass.error = events.value("error", "");
  for (const Json& camera : events.value("cameras", Json::array())) {
    EventCounts& counts = plan.pass.counts.cameras.emplace_back();
    camera.at("read").get_to(counts.read);
    for (const auto& row : kEventFates) camera.at(row.key).get_to(counts.fates[row.fate]);
  }
  for (const Json& window : json.at("windows_ns")) {
    plan.keyframes.push_back({{window.at(0), window.at(1), window.at(2)}, window.at(3)});
  }
  return plan;
}

}  // namespace efm
