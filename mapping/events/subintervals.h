// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "mapping/events/event.h"

namespace efm {

/// What the sub-intervals of a window have in common.
enum class SubintervalSplit {
  kDuration,  ///< They last equally long.
  kCount,     ///< They hold equally many of a camera's events, to within one.
};

/// Which sub-intervals of the cameras meet in one slot of the fusion.
enum class SubintervalShuffle {
  kNone,    ///< The same ones: simultaneous events.
  kShift,   ///< Each camera's are rotated by its own offset.
  kRandom,  ///< Each camera's are permuted at random.
};

std::string_view nameOf(SubintervalSplit split);
std::string_view nameOf(SubintervalShuffle shuffle);
/// @throws std::invalid_argument naming the value and what is known.
SubintervalSplit subintervalSplitFromName(std::string_view name);
SubintervalShuffle subintervalShuffleFromName(std::string_view name);

/// A window is divided into sub-intervals, each with a DSI of its own per camera (Ghosh and Gallego
/// 2022, Algorithm 2, line 3).
struct SubintervalOptions {
  int count = 1;  ///< N_s, 1 to 1000; the paper finds 2 to 8 useful. 1: no fusion across time.
  SubintervalSplit split = SubintervalSplit::kDuration;
  SubintervalShuffle shuffle = SubintervalShuffle::kNone;
  std::uint32_t shuffle_seed = 1;  ///< Of `kRandom`.

  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

/// One camera's events of the window [t0, t1) by sub-interval: consecutive, half open, all events
/// in one of them. With `kCount` events of one time may fall to two sub-intervals.
std::vector<EventSpan> splitIntoSubintervals(EventSpan events, std::int64_t t0_ns,
                                             std::int64_t t1_ns, const SubintervalOptions& options);

/// Which of its sub-intervals each camera puts into each slot: indices [camera][slot]. `kShift`:
/// (slot + camera * max(1, N_s / cameras)) mod N_s, so that cameras are as far apart in time as
/// they can be. The same for every window.
std::vector<std::vector<int>> assignSubintervals(int cameras, const SubintervalOptions& options);

}  // namespace efm
