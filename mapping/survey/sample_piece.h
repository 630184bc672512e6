// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "mapping/events/window_data.h"
#include "mapping/survey/window_sample.h"

namespace efm {

/// A short part of a sample, of half a second or less.
struct SamplePiece {
  Window window;
  std::vector<std::vector<Event>> events;  // of each camera, evenly chosen
  Trajectory trajectory;                   // without jitter, of the whole sample

  WindowData along(const Trajectory& motion) const {
    return {window, {events.begin(), events.end()}, &motion};
  }
};

/// At most this many events of each camera.
inline constexpr std::uint32_t kMaxPieceEvents = 20'000;

/// At most four pieces, evenly spread over the samples. Those in the middle come first: they have
/// poses for most time shifts.
std::vector<SamplePiece> piecesOf(const std::vector<WindowSample>& samples,
                                  const TrajectoryOptions& options);

}  // namespace efm
