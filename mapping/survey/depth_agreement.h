// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "mapping/keyframes/fusion_mapper.h"
#include "mapping/survey/scene_depths.h"

namespace efm {

/// Two measurements of the same depths, pixel by pixel: from the motion of the reference camera
/// alone, and from all cameras within a short time. Both depend on calibration and poses.
struct DepthAgreement {
  /// Median of (depth by motion) / (depth by the rig). Right poses and baselines give 1; positions
  /// in a wrong unit give the factor of that unit.
  double scale = 1;
  /// The fraction of the pixels whose ratio is within 15 % of that median.
  double agreeing = 0;
};

/// @return std::nullopt for one camera, or if too few pixels have both depths: the camera hardly
///   moves.
std::optional<DepthAgreement> depthAgreement(const Rig& rig,
                                             const std::vector<WindowSample>& samples,
                                             const FusionMapperOptions& options);

/// A smaller change of the depths is no finding.
inline constexpr double kMinDepthChange = 0.01;

/// The changes of the depths with small errors of the poses, as fractions of the depth. Each is the
/// median over some windows of the median over the pixels.
struct DepthSensitivity {
  double per_10_ms = 0;  ///< Change by a clock that is wrong by 10 ms.
  /// Change by positions that are scaled by 1 %; std::nullopt if it was not measured: where the
  /// clock changes the depths by less than `kMinDepthChange`, or few depths are left.
  std::optional<double> per_percent_travel;
  double sigma = 0;  ///< The standard deviation of the depths by their variance.
};

/// Maps windows of up to three samples coarsely: as they are, with other clocks, with more travel.
/// @param options have the window of the map.
/// @return std::nullopt if too few pixels have depths.
std::optional<DepthSensitivity> depthSensitivity(const Rig& rig,
                                                 const std::vector<WindowSample>& samples,
                                                 const FusionMapperOptions& options);

/// A measure of how well poses and rig explain events: the sum of the squares of the DSI's
/// confidences (the largest fused value of each pixel), over the squared number of events. Rays
/// that meet in few points give few large values. Only motions of the same events can be compared.
class EventSharpness {
 public:
  /// @param options of the map, whose cameras take part.
  EventSharpness(const Rig& rig, const FusionMapperOptions& options);

  /// Returns the largest distance of the reference camera from its position in the middle of the
  /// piece, metres.
  double shiftIn(const SamplePiece& piece) const;
  /// Measures a piece. @param trajectory of the rig, instead of the piece's own.
  /// @return 0 if nothing is seen: without a pose, without an event or without parallax.
  double of(const SamplePiece& piece, const Trajectory& trajectory);

 private:
  Rig rig_;
  FusionMapperOptions options_;
  CoarseSweep sweep_;
};

}  // namespace efm
