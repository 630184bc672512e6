// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "mapping/keyframes/fusion_mapper.h"
#include "mapping/survey/scene_depths.h"

namespace efm {

/// Two measurements of the same depths: from the motion of the reference camera alone, and from all
/// cameras within a short time, pixel by pixel. Calibration and poses decide both.
struct DepthAgreement {
  /// Median of (depth by motion) / (depth by the rig). Right poses and baselines give 1; positions
  /// in the wrong unit give its factor.
  double scale = 1;
  /// The fraction of the pixels whose ratio is within 15 % of that median.
  double agreeing = 0;
};

/// @return nothing for one camera, and where too few pixels have both depths: the camera hardly
///   moves.
std::optional<DepthAgreement> depthAgreement(const Rig& rig,
                                             const std::vector<WindowSample>& samples,
                                             const FusionMapperOptions& options);

/// How much the depths change with small errors of the poses, as fractions of the depth: the median
/// over some windows of the median over the pixels.
struct DepthSensitivity {
  double per_10_ms = 0;           ///< By a clock that is 10 ms off.
  double per_percent_travel = 0;  ///< By positions that are scaled by 1 %.
  double sigma = 0;               ///< The standard deviation that the depths state.
};

/// Maps windows of up to three samples coarsely: as they are, with other clocks, with more travel.
/// @param options with the window of the map.
/// @return nothing where too few pixels have depths.
std::optional<DepthSensitivity> depthSensitivity(const Rig& rig,
                                                 const std::vector<WindowSample>& samples,
                                                 const FusionMapperOptions& options);

/// Measures how well poses and rig explain events: the squares of the DSI's confidences (the
/// largest fused value of each pixel), relative to the number of events. Rays that meet in few
/// points give few large values. Compares motions of the same events alone.
class EventSharpness {
 public:
  /// @param options of the map: its cameras take part.
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
