// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "mapping/events/event.h"
#include "mapping/events/window.h"
#include "mapping/geometry/trajectory.h"
#include "mapping/keyframes/fusion_mapper.h"
#include "mapping/keyframes/keyframe_mapper.h"

namespace efm {

/// A short interval of a recording, to try options and hypotheses on.
struct WindowSample {
  Window window;
  /// Per camera of the rig, in time order, on the trajectory's clock; evenly chosen where a window
  /// has more than `kMaxSampleEvents` of a camera.
  std::vector<std::vector<Event>> events;
  /// Of the window, and of half a second before and after it as far as there are poses: other
  /// clocks are tried.
  Trajectory trajectory;
};

inline constexpr std::size_t kMaxSampleEvents = 300'000;

WindowSample sampleOf(const WindowData& data);

/// The events of a sample within a window, per camera.
std::vector<EventSpan> eventsWithin(const WindowSample& sample, const Window& window);

/// The part of a sample within a time around the middle of its window, at most all of it.
WindowData middleOf(const WindowSample& sample, double duration_s);

/// Keeps some of the windows of a recording, evenly spread over it, without knowing its length:
/// where there are more than `kMaxSamples`, every second one goes.
class SpreadSamples {
 public:
  static constexpr std::size_t kMaxSamples = 8;

  /// Called with each window of a recording, in their order.
  void add(const WindowData& data);
  const std::vector<WindowSample>& samples() const { return samples_; }
  /// The samples, which this object has no more.
  std::vector<WindowSample> take() { return std::move(samples_); }

 private:
  std::vector<WindowSample> samples_;
  std::size_t step_ = 1;  // every `step_`-th window is kept
  std::size_t windows_ = 0;
};

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
