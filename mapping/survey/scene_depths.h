// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "mapping/keyframes/fusion_mapper.h"
#include "mapping/keyframes/view_motion.h"
#include "mapping/survey/window_sample.h"

namespace efm {

/// Of the cameras that the options select.
inline std::optional<ViewMotion> motionIn(const WindowData& data, const Rig& rig,
                                          const FusionMapperOptions& options) {
  return motionIn(data, rig, selectedCameras(rig, options.cameras), options.keyframe);
}

/// No lens in use focuses on a nearer scene, so one is looked for only where the options name it.
inline constexpr double kNearestSceneM = 0.1;

/// How coarse a sweep is. The default has enough pixels for the distribution of depths.
struct Coarseness {
  int width = 240;                 ///< Of the view, pixels, at most.
  std::uint32_t events = 100'000;  ///< Of each camera, at most.
  double plane_step_px = 1;        ///< Parallax between neighbouring planes.
  double nearest_m = kNearestSceneM;
  ExtractionMethod extraction = ExtractionMethod::kAggregated;
};

/// Sweeps samples coarsely, over a wide range of depths that follows from the baseline, in a small
/// view.
class CoarseSweep {
 public:
  /// @throws std::invalid_argument where the options do not fit the rig.
  CoarseSweep(const Rig& rig, const FusionMapperOptions& options,
              const Coarseness& coarseness = {});

  /// The keyframe of the window. @return nothing without a pose, without events or without
  /// parallax.
  std::optional<KeyframeDepthMap> map(const WindowData& data);
  /// The planes of the last keyframe.
  const DepthPlanes& planes() const { return mapper_.planes(); }

 private:
  FusionMapperOptions options_;  // with the small view
  double plane_step_px_;
  double nearest_m_;
  KeyframeMapper mapper_;
};

/// The depths of a scene, of all samples.
struct SceneDepths {
  std::vector<double> inverse;  ///< Inverse depths of the points, 1/m, in increasing order.
  double nearest = 0;           ///< The inverse depth of the nearest plane, 1/m.
  /// The inverse depth of the farthest plane, once per pixel whose peak lies on it.
  std::vector<double> farthest;
  /// The median parallax of all these pixels, where that of the farthest plane counts as none.
  /// Under some pixels, the depths are mostly noise.
  double parallax_px = 0;

  /// The upper median, 1/m. @pre There is a point.
  double median() const { return inverse[inverse.size() / 2]; }
};

/// Fewer points do not tell the range of depths.
inline constexpr std::size_t kMinScenePoints = 100;

struct InverseRange {
  double far = 0;   ///< 1/m
  double near = 0;  ///< 1/m
};

/// The range of inverse depths that the scene has. Wrong points are spread over all planes, the
/// scene's are not: it is the interval with the largest difference between its fraction of the
/// points and half of its fraction of the planes.
/// @param depths with at least one point.
InverseRange denseRange(const SceneDepths& depths);

/// The limits of a map for a scene of this range: by a factor of at least 1.25 wider on both sides,
/// and nearly a factor of 10 apart. Closer limits hide that a peak is ambiguous: with limits a
/// factor of 4 apart, `hd_stereo` has 2.5 times the wrong points at equal numbers of points.
InverseRange limitsAround(const InverseRange& scene);

SceneDepths sceneDepths(CoarseSweep& sweep, const std::vector<WindowSample>& samples,
                        double window_s);

}  // namespace efm
