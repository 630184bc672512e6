// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/results/output/summary.h"

#include <fmt/format.h>

#include "mapping/geometry/rigid3.h"
#include "plugin/session/session_status.h"

namespace efm {
namespace {

/// "points       48210".
void addLine(std::string& text, const char* name, const std::string& fact) {
  text += fmt::format("{:<11} {}\n", name, fact);
}

/// "48210", or "12.3 million".
std::string countText(std::uint64_t count) {
  constexpr std::uint64_t kMillion = 1'000'000;
  if (count < kMillion) return std::to_string(count);
  return fmt::format("{:.1f} million", static_cast<double>(count) / kMillion);
}

/// "5.1 %". A small share is not shown as none.
std::string shareText(std::uint64_t part, std::uint64_t whole) {
  const double percent = 100.0 * static_cast<double>(part) / static_cast<double>(whole);
  return percent < 0.05 ? "under 0.1 %" : fmt::format("{:.1f} %", percent);
}

/// Short times have a decimal.
std::string shortDurationText(double seconds) {
  constexpr double kShortS = 9.95;
  return seconds < kShortS ? fmt::format("{:.1f} s", seconds) : durationText(seconds);
}

/// Of 0.1 to 99.9 % of the points: the extent that a reader expects of a room.
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

/// The share of used events, and why the others were not used.
std::string eventsText(const EventCounts& counts) {
  const std::pair<std::uint64_t, const char*> unused[] = {
      {counts.outside_window, "outside the keyframes' windows"},
      {counts.without_pose, "without a pose"},
      {counts.filtered, "filtered as noise"},
      {counts.over_budget, "over max_events_per_camera"},
      {counts.dropped, "too late, or of a camera that takes no part"},
      {counts.outside_lens, "outside the lens model"}};
  std::string text =
      fmt::format("{} of {} used", shareText(counts.used, counts.read), countText(counts.read));
  const char* before = "; ";
  for (const auto& [count, why] : unused) {
    if (count == 0) continue;
    text += before + shareText(count, counts.read) + " " + why;
    before = ", ";
  }
  return text;
}

std::string timeLine(const MapReport& report) {
  std::string text = shortDurationText(report.times.real.total);
  if (report.recording_s > 0) {
    text += " for " + shortDurationText(report.recording_s) + " of recording";
  }
  if (report.stopped_at) text += fmt::format(", stopped at {:.0f} %", 100 * *report.stopped_at);
  return text + fmt::format("; at most {:.0f} MB of memory",
                            1e-6 * static_cast<double>(report.peak_memory_bytes));
}

/// "window_s 0.5, min_depth_m 0.61; report.json says why".
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

std::string filesText(const MapReport& report, OutputKind kind,
                      const std::filesystem::path& folder) {
  if (kind == OutputKind::kDepth) {
    return folder.string() + ": points.pcd, depth.tiff, depth.png, report.json";
  }
  return folder.string() + ": map.html, map.pcd, keyframes/*/depth.png, trajectory.txt, " +
         (report.refinement ? "trajectory_tracker.txt, " : "") + "report.json";
}

}  // namespace

std::string summaryOf(const MapReport& report, OutputKind kind,
                      const std::filesystem::path& folder) {
  std::string text;
  if (!report.doubts.empty()) {
    text = fmt::format("doubtful: {}\n", fmt::join(report.doubts, "; "));
  }
  if (kind == OutputKind::kMap) {
    addLine(text, "keyframes", std::to_string(report.counts.keyframes));
  }
  addLine(text, "points", std::to_string(report.points));
  if (report.most_extent) addLine(text, "extent", extentText(*report.most_extent));
  const EventCounts events = report.counts.total();
  if (events.read > 0) addLine(text, "events", eventsText(events));
  addLine(text, "time", timeLine(report));
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
