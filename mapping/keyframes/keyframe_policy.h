// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>

#include "mapping/events/window.h"
#include "mapping/geometry/rigid3.h"
#include "mapping/keyframes/keyframe_depth_map.h"

namespace efm {

enum class KeyframePolicyKind {
  kPeriod,    ///< A window of fixed duration at every stride.
  kEvents,    ///< Windows of a number of events, one after the other.
  kBaseline,  ///< Windows that last until the camera has moved enough.
};

/// Where in its window the reference view stands.
enum class ReferenceTime {
  kMiddle,
  kEnd,  ///< For vehicles that look where they go.
};

std::string_view nameOf(KeyframePolicyKind policy);
std::string_view nameOf(ReferenceTime reference);
/// @throws std::invalid_argument naming the value and what is known.
KeyframePolicyKind keyframePolicyFromName(std::string_view name);
ReferenceTime referenceTimeFromName(std::string_view name);

struct KeyframePolicyOptions {
  KeyframePolicyKind policy = KeyframePolicyKind::kPeriod;
  /// Duration of a window, at least 1e-6; with `kBaseline` the longest one.
  double window_s = 0.2;
  /// At least 1e-6. `kPeriod`: from one window's start to the next, shorter than a window: overlap.
  /// `kBaseline`: the steps in which a window grows, at most `window_s`.
  double stride_s = 0.2;
  /// `kEvents`: events of all selected cameras together in a window, at least 1.
  std::int64_t window_events = 400'000;
  /// `kBaseline`: a window ends once the reference camera has moved this share of the scene's mean
  /// depth. Above 0, at most 10. EMVS (Rebecq et al., IJCV 2018, Sec. 7) takes 0.15 to 0.4.
  double min_baseline_ratio = 0.1;
  /// `kBaseline`: or once less than this share of what it saw is still in view. 0 to 1.
  double min_visible_share = 0.7;
  ReferenceTime reference = ReferenceTime::kMiddle;

  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

/// The window [t0, t1) with its reference time.
Window windowOf(std::int64_t t0_ns, std::int64_t t1_ns, ReferenceTime reference);

/// What a policy may know of a recording: only what is complete, so that its choice does not depend
/// on how far the recording happens to have been read.
class RecordingProgress {
 public:
  virtual ~RecordingProgress() = default;
  /// The first event with a pose.
  virtual std::int64_t startNs() const = 0;
  /// The newest event of any camera; the recording goes on until then at least.
  virtual std::int64_t reachedNs() const = 0;
  /// All events of the selected cameras before this time are here, and poses reach it.
  virtual std::int64_t completeNs() const = 0;
  /// Time of the `count`-th event (from 1) at or after `from_ns`, of the selected cameras together;
  /// nothing where so many are not complete.
  virtual std::optional<std::int64_t> timeOfEvent(std::int64_t from_ns,
                                                  std::int64_t count) const = 0;
  /// T_world_ref: where the reference view would stand at a time, or nothing.
  virtual std::optional<Rigid3> viewPoseAt(std::int64_t t_ns) const = 0;
  virtual const ReferenceView& view() const = 0;
};

/// Decides which windows of a recording become keyframes, in order of t0.
class KeyframePolicy {
 public:
  virtual ~KeyframePolicy() = default;
  /// The next window, as soon as it is sure that the recording fills it; does not move on.
  /// @return nothing before that, and after the last one.
  virtual std::optional<Window> current(const RecordingProgress& recording) = 0;
  /// Events before this time, and poses before `earliestReference`, are in no window to come.
  virtual std::int64_t earliestStart(const RecordingProgress& recording) const = 0;
  virtual std::int64_t earliestReference(const RecordingProgress& recording) const {
    return earliestStart(recording);
  }
  /// Moves on to the window after the current one, which became this keyframe, if it did.
  virtual void advance(const Window& window, const KeyframeDepthMap* keyframe) = 0;
  /// Told that there are no events before `t_ns` that were not in a window: moves on past the
  /// windows that end by then, at a cost that does not depend on their number.
  /// @return how many there were.
  virtual std::uint64_t advancePast(const RecordingProgress& recording, std::int64_t t_ns) = 0;
};

/// @param depth_guess_m the mean depth of the scene before a keyframe tells.
/// @throws std::invalid_argument where the options are not valid.
std::unique_ptr<KeyframePolicy> makeKeyframePolicy(const KeyframePolicyOptions& options,
                                                   double depth_guess_m);
/// One window and no other, wherever the recording starts, whether the recording fills it or not.
std::unique_ptr<KeyframePolicy> makeSingleWindowPolicy(const Window& window);

}  // namespace efm
