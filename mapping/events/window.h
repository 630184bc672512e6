// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "mapping/base/named_choice.h"
#include "mapping/base/option.h"
#include "mapping/events/event.h"
#include "mapping/geometry/lens.h"
#include "mapping/geometry/reference_view.h"
#include "mapping/geometry/rig.h"
#include "mapping/geometry/rigid3.h"
#include "mapping/geometry/trajectory.h"

namespace efm {

/// The interval [t0, t1) of a keyframe's events, and the time of its reference view.
struct Window {
  std::int64_t t0_ns = 0;
  std::int64_t t1_ns = 0;
  std::int64_t t_ref_ns = 0;

  bool contains(std::int64_t t_ns) const { return t_ns >= t0_ns && t_ns < t1_ns; }
};

/// Half-open interval [t0, t1) on the trajectory's clock. Not given: no limit.
struct TimeLimits {
  std::optional<std::int64_t> t0_ns;
  std::optional<std::int64_t> t1_ns;

  bool contain(std::int64_t t_ns) const {
    return (!t0_ns || t_ns >= *t0_ns) && (!t1_ns || t_ns < *t1_ns);
  }
  void validate() const;
};

/// The quantity that is equal in the sub-intervals of a window.
enum class SubintervalSplit {
  kDuration,  ///< The duration.
  kCount,     ///< The number of a camera's events, to within one.
};

/// The sub-intervals of the cameras that are fused with each other, in one slot.
enum class SubintervalShuffle {
  kNone,    ///< The same sub-intervals: simultaneous events.
  kShift,   ///< Each camera's sub-intervals are rotated by its own offset.
  kRandom,  ///< Each camera's sub-intervals are permuted at random.
};

template <>
inline constexpr NamedChoice<SubintervalSplit> kNamesOf<SubintervalSplit>[] = {
    {SubintervalSplit::kDuration, "duration"},
    {SubintervalSplit::kCount, "count"},
};
template <>
inline constexpr NamedChoice<SubintervalShuffle> kNamesOf<SubintervalShuffle>[] = {
    {SubintervalShuffle::kNone, "none"},
    {SubintervalShuffle::kShift, "shift"},
    {SubintervalShuffle::kRandom, "random"},
};

/// Options of the sub-intervals of a window. Each sub-interval has a DSI per camera (Ghosh and
/// Gallego 2022, Algorithm 2, line 3).
struct SubintervalOptions {
  int count = 1;  ///< N_s, 1 to 1000; the paper finds 2 to 8 useful. 1: no fusion across time.
  SubintervalSplit split = SubintervalSplit::kDuration;
  SubintervalShuffle shuffle = SubintervalShuffle::kNone;
  std::uint32_t shuffle_seed = 1;  ///< Seed of `kRandom`.

  template <typename Self, typename Visit>
  static void fields(Self& self, Visit&& visit) {
    visit("subintervals", self.count, Allowed::from(1, 1000, "1 to 1000"));
    visit("split", self.split);
    visit("shuffle", self.shuffle);
    visit("shuffle_seed", self.shuffle_seed);
  }
  void validate() const { requireFields(*this); }
};

/// Divides one camera's events of the window [t0, t1) into consecutive, half-open sub-intervals.
/// Events of the same time may be in two sub-intervals if `split` is `kCount`.
std::vector<EventSpan> splitIntoSubintervals(EventSpan events, std::int64_t t0_ns,
                                             std::int64_t t1_ns, const SubintervalOptions& options);

/// Returns the sub-interval of each camera in each slot: indices [camera][slot]. `kShift`: (slot +
/// camera * max(1, N_s / cameras)) mod N_s, which keeps the cameras as far apart in time as
/// possible. The result is the same for every window.
std::vector<std::vector<int>> assignSubintervals(int cameras, const SubintervalOptions& options);

/// Events and poses of a window; owns nothing.
struct WindowData {
  Window window;
  std::vector<EventSpan> events;  ///< Per camera of the rig; times on the trajectory's clock.
  const Trajectory* trajectory = nullptr;  ///< Has at least the poses of the window.
};

/// One camera's events of a window, and the calibration to turn them into rays. Owns nothing.
struct CameraEvents {
  int camera = 0;  ///< Index in the rig.
  const RigCamera* calibration = nullptr;
  const UndistortionTable* undistortion = nullptr;
  EventSpan events;  ///< In time order, on the trajectory's clock, inside the sensor.
};

/// One window: the events of the selected cameras, and the view and planes of its DSI. Owns
/// nothing.
struct WindowInput {
  const Window& window;
  const std::vector<CameraEvents>& cameras;
  const ReferenceView& view;
  const DepthPlanes& planes;
  Rigid3 T_world_ref;  ///< Pose of the reference view.
};

/// Options of split fusion: a window's events are divided into groups by polarity and by time. Each
/// group is fused across cameras by itself, and the fused DSIs of all groups are summed. A wrong
/// intersection then needs rays of one polarity and one time from all cameras. A true edge loses
/// little: it fires the same polarity in all cameras at the same time. Confidences keep their
/// scale: the harmonic mean of sums is at least the sum of harmonic means, and equal if cameras
/// agree.
struct SplitFusionOptions {
  /// Returns options with all events in one group: the paper's fusion.
  static SplitFusionOptions none() { return {false, 1}; }

  bool polarity = true;  ///< True: a group per polarity.
  /// Number of groups in time, 1 to 1000. A single camera's slices are fused by the rule across
  /// cameras, as if each slice were a camera; then only polarities are summed. More than 2 slices
  /// gain nothing in windows of 0.2 and 0.5 s, cost time, and lose weak edges of a single camera.
  int time_slices = 2;

  int polarities() const { return polarity ? 2 : 1; }
  template <typename Self, typename Visit>
  static void fields(Self& self, Visit&& visit) {
    visit("split_polarity", self.polarity);
    visit("time_slices", self.time_slices, Allowed::from(1, 1000, "1 to 1000"));
  }
  void validate() const { requireFields(*this); }
};

/// The events of a span, divided by polarity.
struct PolaritySplit {
  EventSpan all;             ///< The undivided span.
  std::vector<Event> of[2];  ///< Off events, on events; may be longer than `size`.
  std::size_t size[2] = {0, 0};
};

/// A part of one camera's events: one sub-interval of one slice, and of one polarity if the options
/// divide by polarity.
struct EventPart {
  EventSpan all;                 ///< The sub-interval's events.
  std::optional<bool> polarity;  ///< Polarity of the events; not given: both polarities.
  std::size_t subinterval = 0;   ///< Index among the sub-intervals of all slices.

  /// Returns the part's events in order: a view of `all`, or of `split` if `polarity` is given.
  /// @param split keeps the events of both polarities for the next part; the view is valid until
  /// `split` changes.
  EventSpan select(PolaritySplit& split) const;
};

/// The parts of the cameras that are fused with each other.
struct FusionLayout {
  struct Source {
    std::size_t camera = 0;
    std::size_t part = 0;
  };
  /// Sources at [input][group * slots + slot]. The slots are the sub-intervals of a group. An input
  /// is a camera; with a single camera, an input is one of its time slices.
  std::vector<std::vector<Source>> inputs;
  int groups = 1;
};

/// Divides the events of a window into the parts that are fused. No other class knows the order of
/// a camera's parts: [slice][polarity][sub-interval].
class EventGroups {
 public:
  EventGroups(const SplitFusionOptions& split, const SubintervalOptions& subintervals);

  /// Returns one camera's events of the window, in parts.
  std::vector<EventPart> partsOf(EventSpan events, const Window& window) const;
  /// Returns the number of sub-intervals of all slices.
  std::size_t subintervals() const;
  /// @param cameras number of cameras that are fused; at least 1.
  FusionLayout layoutOf(int cameras) const;

 private:
  SplitFusionOptions split_;
  SubintervalOptions subintervals_;  // of one time slice
};

}  // namespace efm
