// SPDX-License-Identifier: BSD-3-Clause
// Members of MappingSession that choose automatic options.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "mapping/geometry/timestamp.h"
#include "plugin/session/mapping_session.h"

namespace efm {
namespace {

/// Shortest window to choose from, if a tracker jump or a clock reset cuts the first window.
constexpr double kMinFirstWindowS = 0.2;
/// Longest wait for a scene. It also ends after `max_queue_events` events.
constexpr std::int64_t kMaxSceneWaitNs = 10 * kNanosecondsPerSecond;
/// Number of consecutive keyframes that do not agree with their depth limits before the options are
/// chosen again. This happens at most once in an interval, which doubles up to the longest one as
/// long as the new choice does not help.
constexpr int kMaxMisfits = 3;
constexpr std::int64_t kLookIntervalNs = 2 * kNanosecondsPerSecond;
constexpr std::int64_t kMaxLookIntervalNs = 8 * kNanosecondsPerSecond;

const char* const kBetweenJumps = "no longer one surely fits between two jumps of the tracker";

double lengthOf(const WindowData& data) {
  return secondsBetween(data.window.t0_ns, data.window.t1_ns);
}

/// Adds the source of the choice to each reason.
void noteSource(const WindowData& data, std::vector<ChosenOption>& chosen) {
  for (ChosenOption& option : chosen) {
    option.reason +=
        fmt::format("; from {:.3g} s at {} s", lengthOf(data), formatSeconds(data.window.t0_ns));
  }
}

}  // namespace

/// Chooses automatic options from the first window that shows the scene, or after 10 s without a
/// scene. A second choice keeps the options of the first choice if it sees no scene.
/// @return true if all automatic options are chosen.
bool MappingSession::chooseAutomatic() {
  if (waits_for_options_) return false;
  const bool is_first = status_.choices == 0;
  while (options_.automatic.any()) {
    const std::optional<WindowData> data = dataToChooseFrom();
    // No window yet. At the end of the input, choose without data. At the end of a piece of the
    // input, try the next piece. Otherwise wait for more data.
    if (!data && is_first && pieceEnds() && !hasWaitedTooLong() && endPiece()) continue;
    if (!data && !finished_ && !pieceEnds()) return false;
    const bool is_all = data && finished_ && lengthOf(*data) < kFirstWindowS;
    Chosen chosen = chooseFrom(data, is_all ? std::optional(lengthOf(*data)) : std::nullopt);
    if (data && is_first && !chosen.choice.found_scene && skipWithoutScene(*data)) continue;
    useLook(data, std::move(chosen));
  }
  return true;
}

bool MappingSession::chooseFromSoFar(double at_least_s) {
  if (!hasCameras() || waits_for_options_ || !options_.automatic.any()) return false;
  std::optional<WindowData> data = store_.mapper.window();
  if (!data) data = store_.mapper.rest();
  if (!data || lengthOf(*data) < at_least_s) return false;
  useLook(data, chooseFrom(data, std::nullopt));
  return true;
}

/// Chooses from live data. @param duration_s set if all data are known.
Chosen MappingSession::chooseFrom(const std::optional<WindowData>& data,
                                  std::optional<double> duration_s) const {
  RecordingSurvey survey;
  survey.rig = store_.mapper.rig();
  if (data) survey.samples.push_back(sampleOf(*data));
  survey.duration_s = duration_s;
  return choose(survey, options_);
}

/// Uses a choice from live data. Without a scene, uses wide depth limits or the options of the
/// first choice.
void MappingSession::useLook(const std::optional<WindowData>& data, Chosen looked) {
  OptionChoice& choice = looked.choice;
  FusionMapperOptions& chosen = looked.mapper;
  if (!choice.found_scene && status_.choices > 0) {
    options_.automatic = {};
    return store_.mapper.configure(options_.mapper.policy, planes());
  }
  if (data) {
    if (!choice.found_scene) choice = chooseWideDepths(options_.automatic, chosen);
    const std::int64_t begin_ns = std::min(store_.segment.begin_ns, data->window.t0_ns);
    const double segment_s = secondsBetween(begin_ns, data->window.t1_ns);
    const bool jumps = break_ && std::holds_alternative<Jump>(*break_);
    if (jumps && segment_s < kFirstWindowS) {
      limitWindow(segment_s / 2, kBetweenJumps, chosen.policy, choice.options);
    }
    fitIntoQueue(options_.live, eventRate(*data), chosen.policy, choice.options);
    noteSource(*data, choice.options);
  }
  use(std::move(choice), chosen);
}

/// Returns a window to choose from. A tracker jump or a clock reset may cut the window.
std::optional<WindowData> MappingSession::dataToChooseFrom() {
  std::optional<WindowData> data = store_.mapper.window();
  if (data || !pieceEnds()) return data;
  data = store_.mapper.rest();
  return data && lengthOf(*data) >= kMinFirstWindowS ? data : std::nullopt;
}

/// Returns whether tracker jumps left no window to choose from for 10 s. The first call begins the
/// wait.
bool MappingSession::hasWaitedTooLong() {
  if (!store_.events) return false;
  if (!store_.no_scene_since_ns) store_.no_scene_since_ns = store_.events->last_ns;
  return store_.events->last_ns - *store_.no_scene_since_ns >= kMaxSceneWaitNs;
}

/// Drops a window that shows no scene. If this piece of the input ends with it, goes on to the next
/// piece. @return false if the wait for a scene was too long, or no piece follows.
bool MappingSession::skipWithoutScene(const WindowData& data) {
  const Window& window = data.window;
  if (!store_.no_scene_since_ns) store_.no_scene_since_ns = window.t0_ns;
  for (const EventSpan& span : data.events) store_.events_without_scene += span.size();
  if (window.t1_ns - *store_.no_scene_since_ns >= kMaxSceneWaitNs) return false;
  if (store_.events_without_scene > static_cast<std::size_t>(options_.live.max_queue_events)) {
    return false;
  }
  if (secondsBetween(window.t0_ns, window.t1_ns) < kFirstWindowS) return endPiece();
  store_.mapper.dropWindowsBefore(window.t1_ns, DropReason::kNoScene);
  return true;
}

/// Uses the window of the options if it was shortened. @return true if it was.
bool MappingSession::applyShorterWindow(double former_s) {
  if (options_.mapper.policy.window_s == former_s) return false;
  store_.mapper.configure(options_.mapper.policy, planes());
  ++status_.choices;
  return true;
}

/// Shortens chosen windows that are larger than the queue.
/// @return true if it shortened them.
bool MappingSession::shortenWindows(double events_per_s) {
  KeyframePolicyOptions& policy = options_.mapper.policy;
  const double former_s = policy.window_s;
  fitIntoQueue(options_.live, events_per_s, policy, status_.chosen);
  return applyShorterWindow(former_s);
}

/// Shortens a chosen window if two consecutive segments between tracker jumps were too short for
/// it.
void MappingSession::fitIntoSegments(std::int64_t end_ns) {
  const double length_s = secondsBetween(store_.segment.begin_ns, end_ns);
  const std::uint64_t keyframes = earlier_counts_.keyframes + store_.mapper.counts().keyframes;
  const bool fits = keyframes > store_.segment.keyframes || length_s < kMinFirstWindowS;
  store_.segment = {end_ns, keyframes, fits ? 0 : store_.segment.too_short + 1};
  if (store_.segment.too_short < 2 || options_.automatic.any()) return;
  KeyframePolicyOptions& policy = options_.mapper.policy;
  const double former_s = policy.window_s;
  limitWindow(length_s / 2, kBetweenJumps, policy, status_.chosen);
  applyShorterWindow(former_s);
}

void MappingSession::use(NewOptions given) {
  PoseVerdict& verdict = given.chosen.verdict;
  waits_for_options_ = false;
  store_.mapper.setMotion(given.chosen.mapper.keyframe.motion);
  status_.pose_warnings = std::move(verdict.warnings);
  status_.pose_notes = std::move(verdict.notes);
  facts_ = std::move(verdict.quality);
  map_quality_ = {};
  use(std::move(given.chosen.choice), given.chosen.mapper);
  if (!given.follow_depths) depth_follower_.reset();
}

/// Uses the options of a choice from now on.
void MappingSession::use(OptionChoice choice, const FusionMapperOptions& chosen) {
  options_.mapper = chosen;
  options_.automatic = {};
  const DepthPlanesOptions& planes = chosen.keyframe.planes;
  if (automatic_.min_depth_m || automatic_.max_depth_m) {
    depth_follower_.emplace(automatic_, planes, choice.parallax_px_m);
  }
  store_.mapper.configure(chosen.policy, planes);
  if (choice.voxel_size_m) {
    options_.cloud.voxel_size_m = *choice.voxel_size_m;
    cloud_ = RefinedCloud(options_.cloud, options_.movableKeyframes());
  }
  if (!std::exchange(automatic_.voxel_size_m, false)) {  // it was chosen before
    for (ChosenOption& option : status_.chosen) {
      if (option.key == "voxel_size_m") choice.options.push_back(std::move(option));
    }
  }
  status_.chosen = std::move(choice.options);
  status_.scene_unknown = !choice.is_proven;
  ++status_.choices;
  look_interval_ns_ = std::clamp(2 * look_interval_ns_, kLookIntervalNs, kMaxLookIntervalNs);
}

/// Chooses the options again, from the data after this window, if keyframes do not agree with their
/// depth limits.
void MappingSession::lookAgain(const Window& window) {
  if (depth_follower_->misfits() == 0) look_interval_ns_ = kLookIntervalNs;
  if (depth_follower_->misfits() < kMaxMisfits || window.t1_ns < store_.look_again_ns) return;
  store_.look_again_ns = window.t1_ns + look_interval_ns_;
  options_.automatic = automatic_;
  store_.mapper.configure(mapperOptions(options_).policy, planes());
}

}  // namespace efm
