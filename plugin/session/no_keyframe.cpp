// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/no_keyframe.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <utility>

#include "mapping/geometry/timestamp.h"
#include "plugin/session/time_text.h"

namespace efm {
namespace {

/// What makes a window full, by the policy.
std::string fullWindow(const KeyframePolicyOptions& options) {
  const std::string duration = formatSeconds(durationFromSeconds(options.window_s));
  switch (options.policy) {
    case KeyframePolicyKind::kEvents:
      return fmt::format("{} events (window_events)", options.window_events);
    case KeyframePolicyKind::kBaseline:
      return fmt::format(
          "at most {} s (window_s) with motion enough (min_baseline_ratio, min_visible_fraction)",
          duration);
    case KeyframePolicyKind::kPeriod:
      break;
  }
  return duration + " s (window_s)";
}

std::string whyNoPoses(const SessionStatus& status) {
  std::string why = "the recording has no poses";
  if (status.other_poses.empty()) return why + ": a map needs --poses FILE";
  const char* before = " of the source that [rig] pose_source says, but of ";
  for (const auto& [source, count] : status.other_poses) {
    why += std::exchange(before, ", ") + asText(source);
  }
  return why;
}

}  // namespace

std::string whyNoKeyframe(const SessionStatus& status, const FusionMapperOptions& options) {
  if (!status.events) return "the recording has no events";
  if (!status.poses) return whyNoPoses(status);
  const std::int64_t start_ns = status.events->first_ns;
  const auto text = [&](const TimeSpan& span) {
    return timeText(span.first_ns, span.last_ns, start_ns);
  };
  const auto& [t0_ns, t1_ns] = options.limits;
  if ((t0_ns && *t0_ns > status.events->last_ns) || (t1_ns && *t1_ns <= status.events->first_ns)) {
    return fmt::format("no event lies {}: the events span {}", limitsText(options.limits),
                       text(*status.events));
  }
  const std::string spans =
      fmt::format("the events span {}, the poses {}", text(*status.events), text(*status.poses));
  const std::int64_t first_ns = std::max(status.events->first_ns, status.poses->first_ns);
  const std::int64_t last_ns = std::min(status.events->last_ns, status.poses->last_ns);
  if (first_ns > last_ns) {
    return fmt::format("{}: they miss each other by {} s", spans,
                       formatSeconds(first_ns - last_ns));
  }
  if (status.live && !status.live->too_large.empty()) return status.live->too_large;
  const EventCounts counts = status.counts.total();
  if (counts.filtered > 0 && counts.used == 0 && counts.filtered + counts.dropped == counts.read) {
    return fmt::format(
        "the filters took all {} events of the selected cameras for noise: [filter] is too strict "
        "for this recording",
        counts.filtered);
  }
  if (counts.outside_lens > 0 && counts.used == 0 &&
      counts.outside_lens + counts.filtered + counts.dropped == counts.read) {
    return fmt::format(
        "{} of {} events lie outside the lens: its model has no viewing ray for their pixels, so "
        "the calibration is wrong",
        counts.outside_lens, counts.read);
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

}  // namespace efm
