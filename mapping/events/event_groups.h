// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "mapping/events/event.h"
#include "mapping/sweep/space_sweep.h"

namespace efm {

/// Split fusion: the events of a window are divided into groups by polarity and by time, each group
/// is fused across cameras by itself, and the fused DSIs of all groups are summed. A wrong
/// intersection then needs rays of one polarity and one time from all cameras; a right one loses
/// little, because an edge fires the same polarity in all of them at the same time. The harmonic
/// mean of sums is at least the sum of harmonic means, and equal where cameras agree: confidences
/// keep their scale.
struct SplitFusionOptions {
  /// All events in one group: the paper's fusion.
  static SplitFusionOptions none() { return {false, 1}; }

  bool polarity = true;  ///< A group per polarity.
  /// Groups in time, 1 to 1000. Where a single camera is fused, its slices take the place of
  /// cameras: the rule across cameras fuses them, and only polarities are summed. More than 2 gain
  /// nothing in windows of 0.2 and 0.5 s, cost time, and lose weak edges of a single camera.
  int time_slices = 2;

  int polarities() const { return polarity ? 2 : 1; }
  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

/// The events of one polarity, in their order.
std::vector<Event> eventsOfPolarity(EventSpan events, bool polarity);

/// What the sweep fuses: inputs in the place of cameras, and how many groups their slots make.
struct SplitRays {
  std::vector<CameraRays> inputs;
  int groups = 1;
};

/// Arranges the rays of each camera for the sweep.
/// @param cameras rays[slice][polarity][sub-interval], flat in this order; at least one camera.
/// @param slices of time, in each camera.
/// @param slots which of its sub-intervals each camera puts into each slot: [camera][slot].
SplitRays arrangeGroups(std::vector<CameraRays> cameras, int slices,
                        const std::vector<std::vector<int>>& slots);

}  // namespace efm
