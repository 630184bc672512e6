// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "mapping/survey/sample_piece.h"
#include "mapping/survey/scene_depths.h"

namespace efm {

/// Measures how well poses and rig explain events: the squares of the DSI's confidences (the
/// largest fused value of each pixel), relative to the number of events. Rays that meet in few
/// points give few large values. Compares motions of the same events alone.
class EventSharpness {
 public:
  /// @param options of the map: its cameras take part.
  /// @throws std::invalid_argument where the options do not fit the rig.
  EventSharpness(const Rig& rig, const FusionMapperOptions& options);

  /// The largest distance of the reference camera from its position in the middle of the piece,
  /// metres.
  double shiftIn(const SamplePiece& piece) const;
  /// @param trajectory of the rig, in place of the piece's own.
  /// @return 0 where nothing is seen: without a pose, without an event or without parallax.
  double of(const SamplePiece& piece, const Trajectory& trajectory);

 private:
  Rig rig_;
  FusionMapperOptions options_;
  CoarseSweep sweep_;
};

}  // namespace efm
