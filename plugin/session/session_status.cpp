// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/session_status.h"

#include <fmt/format.h>

#include <cmath>

#include "mapping/geometry/timestamp.h"

namespace efm {
namespace {

std::string offsetText(std::int64_t t_ns, std::int64_t start_ns) {
  const double milliseconds = std::round(1e3 * secondsBetween(start_ns, t_ns));
  return fmt::format("{:+.12g}", milliseconds / 1e3 + 0.0);  // + 0: no "-0"
}

}  // namespace

std::string timeText(std::int64_t t_ns, std::optional<std::int64_t> start_ns) {
  const std::string time = formatSeconds(t_ns) + " s";
  if (!start_ns) return time;
  return fmt::format("{} ({} s)", time, offsetText(t_ns, *start_ns));
}

std::string timeText(std::int64_t first_ns, std::int64_t last_ns,
                     std::optional<std::int64_t> start_ns) {
  const std::string times =
      fmt::format("{} to {} s", formatSeconds(first_ns), formatSeconds(last_ns));
  if (!start_ns) return times;
  return fmt::format("{} ({} to {} s)", times, offsetText(first_ns, *start_ns),
                     offsetText(last_ns, *start_ns));
}

std::string limitsText(const TimeLimits& limits) {
  std::string text;
  if (limits.t0_ns) text += fmt::format("from --t0 {} s", formatSeconds(*limits.t0_ns));
  if (limits.t0_ns && limits.t1_ns) text += " ";
  if (limits.t1_ns) text += fmt::format("until --t1 {} s", formatSeconds(*limits.t1_ns));
  return text;
}

std::string durationText(double seconds) {
  const auto whole = static_cast<long long>(std::llround(std::max(0.0, seconds)));
  if (whole < 60) return fmt::format("{} s", whole);
  if (whole < 3600) return fmt::format("{}:{:02} min", whole / 60, whole % 60);
  return fmt::format("{:02}:{:02} h", whole / 3600, whole / 60 % 60);
}

std::string asText(const DroppedWindows& windows) {
  std::string text = fmt::format("{} windows dropped", windows.total());
  const char* separator = ": ";
  for (const DropReasonRow& row : kDropReasons) {
    const std::uint64_t count = windows[row.reason];
    if (count == 0) continue;
    text += fmt::format("{}{} {}", separator, count, row.text);
    separator = ", ";
  }
  return text;
}

double LiveStatus::dropRatio() const {
  std::uint64_t received = 0;
  std::uint64_t missing = 0;
  for (const auto& [index, camera] : cameras) {
    received += camera.received;
    missing += camera.losses();
  }
  return received == 0 ? 0 : static_cast<double>(missing) / static_cast<double>(received);
}

std::string choiceText(const SessionStatus& status) {
  std::string text = "options chosen from the data:";
  for (const ChosenOption& option : status.chosen) {
    text += fmt::format(" {} = {:g} ({});", option.key, option.value, option.reason);
  }
  text.pop_back();
  return text;
}

}  // namespace efm
