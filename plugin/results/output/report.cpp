// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/results/output/report.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <variant>

#include "event_fusion/engine.h"
#include "mapping/geometry/rigid3.h"
#include "maps/metrics/sample_statistics.h"
#include "plugin/options/option_keys.h"
#include "plugin/options/tracker_fault_keys.h"

namespace efm {

std::optional<MapExtent> extentOf(const MapCloud& cloud, double outside) {
  if (cloud.empty()) return std::nullopt;
  MapExtent extent;
  const auto last = static_cast<std::ptrdiff_t>(cloud.size() - 1);
  const auto cut = static_cast<std::ptrdiff_t>(outside * static_cast<double>(last));
  std::vector<float> values(cloud.size());
  for (int axis = 0; axis < 3; ++axis) {
    const auto valueAt = [&](std::ptrdiff_t index) {
      std::nth_element(values.begin(), values.begin() + index, values.end());
      return static_cast<double>(cloud.sensor_origin_[axis]) +
             static_cast<double>(values[static_cast<std::size_t>(index)]);
    };
    std::transform(cloud.begin(), cloud.end(), values.begin(),
                   [&](const MapPoint& point) { return point.data[axis]; });
    extent.min_m[axis] = valueAt(cut);
    extent.max_m[axis] = valueAt(last - cut);
  }
  return extent;
}

PoseShift shiftBetween(const std::vector<StampedPose>& before,
                       const std::vector<StampedPose>& after) {
  std::vector<double> distances_m;
  std::vector<double> angles_rad;
  for (std::size_t i = 0; i < std::min(before.size(), after.size()); ++i) {
    const Rigid3& a = before[i].T_world_rig;
    const Rigid3& b = after[i].T_world_rig;
    distances_m.push_back((b.translation - a.translation).norm());
    angles_rad.push_back(a.rotation.angularDistance(b.rotation));
  }
  const SampleStatistics distance = statisticsOf(distances_m);
  const SampleStatistics angle = statisticsOf(angles_rad);
  return {distance.median, distance.max, angle.median, angle.max};
}

namespace {

using Json = nlohmann::ordered_json;

Json asJson(const EventCounts& counts) {
  Json json = {{"read", counts.read}};
  for (const auto& row : kEventFates) json[row.key] = counts[row.fate];
  return json;
}

Json asJson(const StageSeconds& seconds) {
  return {{"total", seconds.total},   {"read", seconds.read},
          {"look", seconds.look},     {"sweep", seconds.rays + seconds.sweep},
          {"depth", seconds.depth},   {"motion", seconds.motion},
          {"refine", seconds.refine}, {"map", seconds.map}};
}

/// Returns processor time: the fixed cost of a run, and costs that grow with events and keyframes.
Json byGrowth(const StageSeconds& cpu) {
  const double measured = cpu.start + cpu.look + cpu.tables + cpu.output + cpu.read + cpu.filter +
                          cpu.rays + cpu.sweep + cpu.depth + cpu.motion + cpu.refine + cpu.map +
                          cpu.images;
  return {
      {"total", cpu.total},
      {"once",
       {{"start", cpu.start}, {"look", cpu.look}, {"tables", cpu.tables}, {"output", cpu.output}}},
      {"events", {{"read", cpu.read}, {"filter", cpu.filter}}},
      {"keyframes",
       {{"sweep", cpu.rays + cpu.sweep},
        {"depth", cpu.depth},
        {"motion", cpu.motion},
        {"refine", cpu.refine},
        {"map", cpu.map},
        {"images", cpu.images}}},
      {"other", std::max(0.0, cpu.total - measured)}};
}

Json asJson(const MapExtent& extent) {
  const auto list = [](const Eigen::Vector3d& p) { return Json::array({p.x(), p.y(), p.z()}); };
  return {{"min", list(extent.min_m)}, {"max", list(extent.max_m)}};
}

Json asJson(const PoseShift& shift) {
  return {{"median_m", shift.median_m},
          {"max_m", shift.max_m},
          {"median_deg", shift.median_rad / kRadiansPerDegree},
          {"max_deg", shift.max_rad / kRadiansPerDegree}};
}

Json asJson(const RefinementState& refinement) {
  const RefinementCounts& counts = refinement.counts;
  const TrackerErrors& tracker = refinement.tracker;
  return {{"registered", counts.registered},
          {"loop_checks", counts.loop_checks},
          {"loops", counts.loops},
          {"loops_dropped", counts.loops_dropped},
          {"failed_solves", counts.failed_solves},
          {"failures", refinement.failures},
          {"last_error", refinement.last_error},
          {"tracker",
           {{"noise_m", tracker.noise_m},
            {"noise_deg", tracker.noise_rad / kRadiansPerDegree},
            {"drift", tracker.drift_m},
            {"drift_deg_per_m", tracker.drift_rad / kRadiansPerDegree}}}};
}

Json asJson(const DroppedWindows& windows) {
  Json json = Json::object();
  for (const DropReasonRow& row : kDropReasons) json[row.key] = windows[row.reason];
  return json;
}

Json asJson(const LiveStatus& live, const MapperCounts& counts) {
  Json cameras = Json::array();
  for (const auto& [index, camera] : live.cameras) {
    Json& of_camera = cameras.emplace_back(Json{{"camera", index}, {"received", camera.received}});
    for (const auto& row : kQueueFates) of_camera[row.key] = camera.fates[row.fate];
    of_camera["taken"] = camera.taken;
    of_camera["lost"] = camera.lost;
  }
  return {{"drop_ratio", live.dropRatio()},
          {"cameras", cameras},
          {"windows_dropped", counts.dropped_windows.total()},
          {"windows_dropped_for", asJson(counts.dropped_windows)},
          {"late_events", live.late_events},
          {"pose_jumps", live.pose_jumps},
          {"clock_resets", live.clock_resets},
          {"rejected_poses", live.rejected_poses},
          {"errors", live.errors},
          {"last_error", live.last_error}};
}

Json asJson(const MapQuality& quality) {
  Json json = {{"word", std::string(nameOf(quality.word))}};
  if (quality.word != QualityWord::kUnknown) {
    json["wrong_share"] = quality.wrong_share;
    json["depth_error"] = quality.depth_error;
    json["support"] = quality.support;
    if (quality.agreement) json["agreement"] = *quality.agreement;
    if (quality.sharpness) json["sharpness"] = *quality.sharpness;
  }
  json["left_out"] = quality.left_out;
  json["reasons"] = quality.reasons;
  json["keyframes"] = Json::array();
  for (const float right : quality.keyframes) {
    json["keyframes"].push_back(std::round(1000 * double{right}) / 1000);
  }
  json["much_worse"] = quality.much_worse;
  return json;
}

Json asJson(const ReferenceView& view) {
  return {{"width", view.width}, {"height", view.height}, {"fx", view.fx},
          {"fy", view.fy},       {"cx", view.cx},         {"cy", view.cy}};
}

}  // namespace

Json asJson(const std::vector<Warning>& warnings) {
  Json json = Json::array();
  for (const Warning& warning : warnings) {
    json.push_back({{"name", warning.name}, {"text", warning.text}});
  }
  return json;
}

std::uint64_t peakMemoryBytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;  // Linux counts in kibibytes
}

void describePoints(const MapCloud& cloud, RunReport& report) {
  constexpr double kFar = 0.001;
  report.points = cloud.size();
  report.map_hash = mapHash(cloud);
  report.extent = extentOf(cloud);
  report.most_extent = extentOf(cloud, kFar);
}

std::string reportJson(const RunReport& report) {
  const MapperCounts& counts = report.counts;
  const SpaceSweepOptions& sweep = report.options.mapper.keyframe.sweep;

  Json events = asJson(counts.total());
  events["cameras"] = Json::array();
  for (const EventCounts& camera : counts.cameras) events["cameras"].push_back(asJson(camera));

  Json json;
  json["schema"] = 1;  // grows when a key changes its name or its meaning
  json["version"] = EFM_VERSION;
  if (!report.recording.empty()) json["recording"] = report.recording;
  json["events"] = events;
  json["event_uses"] = counts.event_uses;
  json["votes"] = {{"cast", counts.votes.cast},
                   {"interpolated", counts.votes.interpolated},
                   {"outside_view", counts.votes.outside_view},
                   {"behind_camera", counts.votes.behind_camera}};
  json["keyframes"] = counts.keyframes;
  json["keyframes_without_pose"] = counts.keyframes_without_pose;
  json["windows_without_events"] = counts.windows_without_events;
  json["silent"] = {{"keyframes", report.silent_keyframes},
                    {"subintervals", counts.silent_subintervals}};
  json["sorted_events"] = counts.sorted_events;
  json["skipped_events"] = report.skipped_events;
  json["duplicate_poses"] = counts.duplicate_poses;
  json["points"] = report.points;
  if (!report.map_hash.empty()) json["map_hash"] = report.map_hash;
  const PixelCounts& pixels = report.pixels;
  json["pixels"] = {{"candidates", pixels.candidates},
                    {"at_nearest", pixels.at_nearest},
                    {"at_farthest", pixels.at_farthest},
                    {"ambiguous", pixels.ambiguous},
                    {"neighbours", pixels.neighbours}};
  if (report.extent) json["extent_m"] = asJson(*report.extent);
  if (report.most_extent) json["most_extent_m"] = asJson(*report.most_extent);
  json["recording_seconds"] = report.recording_s;
  json["seconds"] = asJson(report.times.real);
  json["cpu_seconds"] = byGrowth(report.times.cpu);
  const double sweep_s = report.times.real.rays + report.times.real.sweep;
  const std::uint64_t swept = counts.votes.total() - counts.votes.interpolated;
  json["votes_per_second"] = sweep_s > 0 ? static_cast<double>(swept) / sweep_s : 0.0;
  json["kernel"] = std::string(nameOf(sweep.kernelOrFastest()));
  json["threads"] = sweep.threadsOrCores();
  json["peak_memory_bytes"] = report.peak_memory_bytes;
  if (report.sequence_maximum) json["sequence_maximum"] = *report.sequence_maximum;
  if (report.view) json["reference_view"] = asJson(*report.view);
  if (report.baseline_m) json["baseline_m"] = *report.baseline_m;
  if (report.stopped_at) json["stopped_at"] = *report.stopped_at;
  if (!report.error.empty()) json["error"] = report.error;
  if (report.live) json["live"] = asJson(*report.live, counts);
  json["warnings"] = asJson(report.warnings);
  if (!report.notes.empty()) json["notes"] = asJson(report.notes);
  json["quality"] = asJson(report.quality);
  if (const MotionCounts& motion = report.counts.motion; motion.known > 0) {
    json["motion"] = {{"known", motion.known},
                      {"corrected", motion.corrected},
                      {"blur_px", motion.meanBlurPx()},
                      {"sharpness_gain", motion.meanGain()}};
  }
  if (report.refinement) json["refinement"] = asJson(*report.refinement);
  if (report.pose_shift) json["refinement"]["moved"] = asJson(*report.pose_shift);
  if (report.faults.any()) json["perturbation"] = asJson(report.faults);
  if (const auto& session = report.session) {
    json["session"] = {{"bytes", session->bytes},
                       {"bytes_per_depth", session->bytesPerDepth()},
                       {"seconds", session->seconds}};
  }
  if (!report.chosen.empty()) json["chosen"] = asJson(report.chosen);
  json["options"] = asJson(report.options);
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

namespace {

/// Adds a line such as "points       48210".
void addLine(std::string& text, const char* name, const std::string& fact) {
  text += fmt::format("{:<11} {}\n", name, fact);
}

/// Returns text such as "48210" or "12.3 million".
std::string countText(std::uint64_t count) {
  constexpr std::uint64_t kMillion = 1'000'000;
  if (count < kMillion) return std::to_string(count);
  return fmt::format("{:.1f} million", static_cast<double>(count) / kMillion);
}

/// Returns text such as "5.1 %". A small share is not shown as 0 %.
std::string shareText(std::uint64_t part, std::uint64_t whole) {
  const double percent = 100.0 * static_cast<double>(part) / static_cast<double>(whole);
  return percent < 0.05 ? "under 0.1 %" : fmt::format("{:.1f} %", percent);
}

/// Returns a duration; short durations have a decimal.
std::string shortDurationText(double seconds) {
  constexpr double kShortS = 9.95;
  return seconds < kShortS ? fmt::format("{:.1f} s", seconds) : durationText(seconds);
}

/// Returns text for `most_extent`: the extent that a reader expects of a room.
std::string extentText(const MapExtent& extent) {
  const Eigen::Vector3d size_m = extent.max_m - extent.min_m;
  std::string text = fmt::format("{:.2f} x {:.2f} x {:.2f} m:", size_m.x(), size_m.y(), size_m.z());
  const char* before = " ";
  for (int axis = 0; axis < 3; ++axis) {
    text += fmt::format("{}{} {:.2f} to {:.2f}", before, "xyz"[axis], extent.min_m[axis],
                        extent.max_m[axis]);
    before = ", ";
  }
  return text;
}

/// Returns the share of used events, and the reasons why the other events were not used.
std::string eventsText(const EventCounts& counts) {
  std::string text = fmt::format("{} of {} used", shareText(counts[EventFate::kUsed], counts.read),
                                 countText(counts.read));
  const char* before = "; ";
  for (const EventFate fate :
       {EventFate::kOutsideWindow, EventFate::kWithoutPose, EventFate::kFiltered,
        EventFate::kOverBudget, EventFate::kLate, EventFate::kDropped, EventFate::kUnselected,
        EventFate::kOutsideLens}) {
    if (counts[fate] == 0) continue;
    text += before + shareText(counts[fate], counts.read) + " " + rowOf(fate).text;
    before = ", ";
  }
  return text;
}

std::string timeLine(const RunReport& report) {
  std::string text = shortDurationText(report.times.real.total);
  if (report.recording_s > 0) {
    text += " for " + shortDurationText(report.recording_s) + " of recording";
  }
  if (report.stopped_at) text += fmt::format(", stopped at {:.0f} %", 100 * *report.stopped_at);
  return text + fmt::format("; at most {:.0f} MB of memory",
                            1e-6 * static_cast<double>(report.peak_memory_bytes));
}

/// Returns text such as "window_s 0.5, min_depth_m 0.61; report.json says why".
std::string chosenText(const std::vector<ChosenOption>& chosen) {
  std::string text;
  for (const ChosenOption& option : chosen) {
    text += fmt::format("{}{} {:g}", text.empty() ? "" : ", ", option.key, option.value);
  }
  return text + "; report.json says why";
}

std::string shiftText(const PoseShift& shift) {
  return fmt::format(
      "moved the poses by {:.2f} cm and {:.2f} degrees (median), at most {:.2f} cm and {:.2f} "
      "degrees",
      100 * shift.median_m, shift.median_rad / kRadiansPerDegree, 100 * shift.max_m,
      shift.max_rad / kRadiansPerDegree);
}

std::string filesText(const RunReport& report, OutputKind kind,
                      const std::filesystem::path& folder) {
  if (kind == OutputKind::kDepth) {
    return folder.string() + ": points.pcd, depth.tiff, depth.png, report.json";
  }
  return folder.string() + ": map.html, map.pcd, keyframes/*/depth.png, trajectory.txt, " +
         (report.refinement ? "trajectory_tracker.txt, " : "") + "report.json";
}

}  // namespace

std::string summaryOf(const RunReport& report, OutputKind kind,
                      const std::filesystem::path& folder) {
  std::string text;
  if (report.quality.word != QualityWord::kUnknown) {
    addLine(text, "quality", textOf(report.quality));
  }
  if (kind == OutputKind::kMap) {
    addLine(text, "keyframes", std::to_string(report.counts.keyframes));
  }
  addLine(text, "points", std::to_string(report.points));
  if (!report.map_hash.empty()) addLine(text, "hash", report.map_hash);
  if (report.most_extent) addLine(text, "extent", extentText(*report.most_extent));
  const EventCounts events = report.counts.total();
  if (events.read > 0) addLine(text, "events", eventsText(events));
  addLine(text, "time", timeLine(report));
  if (!report.motion.empty()) addLine(text, "motion", report.motion);
  if (report.pose_shift) addLine(text, "refinement", shiftText(*report.pose_shift));
  if (!report.chosen.empty()) addLine(text, "chosen", chosenText(report.chosen));
  for (const Warning& warning : report.warnings) {
    if (warning.name == "depths-sensitive") addLine(text, "sensitive", warning.text);
  }
  if (!report.warnings.empty()) {
    addLine(text, "warnings",
            fmt::format("{}, on stderr and in report.json", report.warnings.size()));
  }
  addLine(text, "results", filesText(report, kind, folder));
  return text;
}

}  // namespace efm
