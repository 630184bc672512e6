// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "mapping/events/event.h"

namespace efm {

/// The quantity that is equal in the sub-intervals of a window.
enum class SubintervalSplit {
  kDuration,  ///< Their duration.
  kCount,     ///< The number of a camera's events in them, to within one.
};

/// Which sub-intervals of the cameras are fused with each other, in one slot.
enum class SubintervalShuffle {
  kNone,    ///< The same ones: simultaneous events.
  kShift,   ///< Those of each camera are rotated by its own offset.
  kRandom,  ///< Those of each camera are permuted at random.
};

std::string_view nameOf(SubintervalSplit split);
std::string_view nameOf(SubintervalShuffle shuffle);
/// @throws std::invalid_argument naming the value and the known names.
SubintervalSplit subintervalSplitFromName(std::string_view name);
SubintervalShuffle subintervalShuffleFromName(std::string_view name);

/// The sub-intervals of a window; each has a DSI per camera (Ghosh and Gallego 2022, Algorithm 2,
/// line 3).
struct SubintervalOptions {
  int count = 1;  ///< N_s, 1 to 1000; the paper finds 2 to 8 useful. 1: no fusion across time.
  SubintervalSplit split = SubintervalSplit::kDuration;
  SubintervalShuffle shuffle = SubintervalShuffle::kNone;
  std::uint32_t shuffle_seed = 1;  ///< Of `kRandom`.

  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

/// Divides one camera's events of the window [t0, t1) into consecutive, half-open sub-intervals.
/// With `kCount`, events of the same time may be in two sub-intervals.
std::vector<EventSpan> splitIntoSubintervals(EventSpan events, std::int64_t t0_ns,
                                             std::int64_t t1_ns, const SubintervalOptions& options);

/// The sub-interval of each camera in each slot: indices [camera][slot]. `kShift`: (slot + camera *
/// max(1, N_s / cameras)) mod N_s, which keeps the cameras as far apart in time as possible. The
/// same for every window.
std::vector<std::vector<int>> assignSubintervals(int cameras, const SubintervalOptions& options);

}  // namespace efm
