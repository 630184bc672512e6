// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "mapping/events/event.h"
#include "mapping/events/subintervals.h"
#include "mapping/events/window.h"

namespace efm {

/// Split fusion: the events of a window are divided into groups by polarity and by time. Each group
/// is fused across cameras by itself, and the fused DSIs of all groups are summed. A wrong
/// intersection then needs rays of one polarity and one time from all cameras. A true edge loses
/// little: it fires the same polarity in all cameras at the same time. The harmonic mean of sums is
/// at least the sum of harmonic means, and equal where cameras agree: confidences keep their scale.
struct SplitFusionOptions {
  /// All events in one group: the paper's fusion.
  static SplitFusionOptions none() { return {false, 1}; }

  bool polarity = true;  ///< A group per polarity.
  /// Groups in time, 1 to 1000. A single camera's slices are fused by the rule across cameras, as
  /// if each were a camera; then only polarities are summed. More than 2 slices gain nothing in
  /// windows of 0.2 and 0.5 s, cost time, and lose weak edges of a single camera.
  int time_slices = 2;

  int polarities() const { return polarity ? 2 : 1; }
  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

/// The events of a span, divided by polarity.
struct PolaritySplit {
  EventSpan all;             ///< The span.
  std::vector<Event> of[2];  ///< Off and on events; may be longer than `size`.
  std::size_t size[2] = {0, 0};
};

/// A part of one camera's events: one sub-interval of one slice, and of one polarity if the options
/// divide by polarity.
struct EventPart {
  EventSpan all;                 ///< The sub-interval's events.
  std::optional<bool> polarity;  ///< Of the part's events; not given: both polarities.
  std::size_t subinterval = 0;   ///< Index among the sub-intervals of all slices.

  /// The part's events in their order: a view of `all`, or, with a polarity, of `split`.
  /// @param split keeps the events of both polarities for the next part; the view is valid until
  /// it changes.
  EventSpan select(PolaritySplit& split) const;
};

/// Which parts of the cameras are fused with each other.
struct FusionLayout {
  struct Source {
    std::size_t camera = 0;
    std::size_t part = 0;
  };
  /// [input][group * slots + slot], where the slots are the sub-intervals of a group. An input is
  /// a camera; with a single camera, an input is one of its time slices.
  std::vector<std::vector<Source>> inputs;
  int groups = 1;
};

/// Divides the events of a window into the parts that are fused. No other class knows the order of
/// a camera's parts: [slice][polarity][sub-interval].
class EventGroups {
 public:
  EventGroups(const SplitFusionOptions& split, const SubintervalOptions& subintervals);

  /// One camera's events of the window, in parts.
  std::vector<EventPart> partsOf(EventSpan events, const Window& window) const;
  /// The number of sub-intervals of all slices.
  std::size_t subintervals() const;
  /// @param cameras the number of cameras that are fused; at least 1.
  FusionLayout layoutOf(int cameras) const;

 private:
  SplitFusionOptions split_;
  SubintervalOptions subintervals_;  // of a slice
};

}  // namespace efm
