// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "mapping/base/named_choice.h"
#include "mapping/base/option.h"
#include "mapping/events/window.h"
#include "mapping/geometry/rigid3.h"
#include "mapping/keyframes/keyframe_depth_map.h"

namespace efm {

enum class KeyframePolicyKind {
  kPeriod,    ///< A window of fixed duration at every stride.
  kEvents,    ///< Consecutive windows with a fixed number of events.
  kBaseline,  ///< Consecutive windows that end once the camera has moved enough.
};

/// The time of the reference view within its window.
enum class ReferenceTime {
  kMiddle,
  kEnd,  ///< The end of the window, for forward-looking vehicles.
};

template <>
inline constexpr NamedChoice<KeyframePolicyKind> kNamesOf<KeyframePolicyKind>[] = {
    {KeyframePolicyKind::kPeriod, "period"},
    {KeyframePolicyKind::kEvents, "events"},
    {KeyframePolicyKind::kBaseline, "baseline"},
};
template <>
inline constexpr NamedChoice<ReferenceTime> kNamesOf<ReferenceTime>[] = {
    {ReferenceTime::kMiddle, "middle"},
    {ReferenceTime::kEnd, "end"},
};

struct KeyframePolicyOptions {
  KeyframePolicyKind policy = KeyframePolicyKind::kPeriod;
  /// Duration of a window in seconds, at least 1e-6; with `kBaseline` the maximum.
  double window_s = 0.2;
  /// Seconds, at least 1e-6. `kPeriod`: from the start of one window to the start of the next;
  /// windows overlap if it is shorter than `window_s`. `kBaseline`: the step by which a window
  /// grows, at most `window_s`.
  double stride_s = 0.2;
  /// `kEvents`: events in a window, of all selected cameras together, at least 1.
  std::int64_t window_events = 400'000;
  /// `kBaseline`: a window ends once the reference camera has moved this fraction of the scene's
  /// mean depth. Above 0, at most 10. EMVS (Rebecq et al., IJCV 2018, Sec. 7) uses 0.15 to 0.4.
  double min_baseline_ratio = 0.1;
  /// `kBaseline`: a window also ends once less than this fraction of the last keyframe's points is
  /// in view. 0 to 1.
  double min_visible_fraction = 0.7;
  ReferenceTime reference = ReferenceTime::kMiddle;

  template <typename Self, typename Visit>
  static void fields(Self& self, Visit&& visit) {
    visit("policy", self.policy);
    visit("window_s", self.window_s, Allowed::from(1e-6, 1e6, "1e-6 to 1e6"));
    visit("stride_s", self.stride_s, Allowed::from(1e-6, 1e6, "1e-6 to 1e6"));
    visit("window_events", self.window_events, Allowed::atLeast(1, "1 or above"));
    visit("min_baseline_ratio", self.min_baseline_ratio,
          Allowed::above(0, 10, "above 0, at most 10"));
    visit("min_visible_fraction", self.min_visible_fraction, Allowed::from(0, 1, "0 to 1"));
    visit("reference", self.reference);
  }
  void validate() const;
};

/// Returns the window [t0, t1) with its reference time.
Window windowOf(std::int64_t t0_ns, std::int64_t t1_ns, ReferenceTime reference);

/// The part of a recording that has arrived, for a policy. Queries about events and poses consider
/// complete data only, so that the choice of windows does not depend on the reading position.
class RecordingProgress {
 public:
  virtual ~RecordingProgress() = default;
  /// Returns the time of the first event with a pose.
  virtual std::int64_t startNs() const = 0;
  /// Returns the time of the newest event of any camera: the recording lasts at least until then.
  virtual std::int64_t reachedNs() const = 0;
  /// Returns the time until which the events of the selected cameras and the poses are complete.
  virtual std::int64_t completeNs() const = 0;
  /// Returns the time of the `count`-th event (from 1) at or after `from_ns`, of the selected
  /// cameras together; std::nullopt while fewer events are complete.
  virtual std::optional<std::int64_t> timeOfEvent(std::int64_t from_ns,
                                                  std::int64_t count) const = 0;
  /// Returns the number of events of the selected cameras in [t0, t1) that are here, complete or
  /// not.
  virtual std::int64_t eventsIn(std::int64_t t0_ns, std::int64_t t1_ns) const = 0;
  /// Returns T_world_ref of a reference view at a time; std::nullopt if there is no pose.
  virtual std::optional<Rigid3> viewPoseAt(std::int64_t t_ns) const = 0;
  virtual const ReferenceView& view() const = 0;
};

/// The choice of the windows of a recording that become keyframes, in order of t0.
class KeyframePolicy {
 public:
  /// A last window must add at least this fraction of what other windows add. Otherwise it would
  /// nearly repeat the window before it, and both would seem to support each other's depths.
  static constexpr double kLeastAdded = 0.1;

  virtual ~KeyframePolicy() = default;
  /// Returns the current window, as soon as the recording certainly fills it.
  /// @return std::nullopt before that time, and after the last window.
  virtual std::optional<Window> current(const RecordingProgress& recording) = 0;
  /// Returns a full window at the end of a finished recording, if enough of it is new
  /// (`kLeastAdded`).
  /// @param end_ns right after the last event with a pose.
  /// @return std::nullopt also if that window would begin before the recording.
  virtual std::optional<Window> last(const RecordingProgress& recording,
                                     std::int64_t end_ns) const = 0;
  /// Returns the time before which `last` needs no events.
  virtual std::int64_t earliestLast(const RecordingProgress& recording) const {
    return earliestStart(recording);
  }
  /// Returns the time before which no later window needs events (poses: `earliestReference`).
  virtual std::int64_t earliestStart(const RecordingProgress& recording) const = 0;
  virtual std::int64_t earliestReference(const RecordingProgress& recording) const {
    return earliestStart(recording);
  }
  /// Moves on to the next window.
  /// @param keyframe of the current window; null if there is none.
  virtual void advance(const Window& window, const KeyframeDepthMap* keyframe) = 0;
  /// Skips the windows that end by `t_ns`: they have no events. The cost does not depend on their
  /// number. None is skipped if every window has events.
  /// @return the number of skipped windows.
  virtual std::uint64_t advancePast(const RecordingProgress&, std::int64_t) { return 0; }
  /// Drops the windows that begin before `t_ns`. @return the number of these windows. If the ends
  /// of windows depend on data, which may be missing, it is the number that the events before
  /// `t_ns` would have filled. A window that is dropped piece by piece counts once.
  virtual std::uint64_t dropWindowsBefore(const RecordingProgress& recording,
                                          std::int64_t t_ns) = 0;
};

/// @param depth_guess_m assumed mean depth of the scene before the first keyframe.
std::unique_ptr<KeyframePolicy> makeKeyframePolicy(const KeyframePolicyOptions& options,
                                                   double depth_guess_m);
/// Makes a policy of these windows alone, whether the recording fills them or not.
/// @param windows in the order of `t0_ns`.
std::unique_ptr<KeyframePolicy> makeGivenWindowsPolicy(std::vector<Window> windows);

}  // namespace efm
