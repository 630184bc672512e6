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
  /// Events per camera of the rig, in time order, on the trajectory's clock; evenly chosen if a
  /// camera has more than `kMaxSampleEvents`.
  std::vector<std::vector<Event>> events;
  /// Poses of the window, and of up to half a second before and after it: other clocks are tried.
  Trajectory trajectory;
};

inline constexpr std::size_t kMaxSampleEvents = 300'000;

WindowSample sampleOf(const WindowData& data);

/// Returns the events of a sample within a window, per camera.
std::vector<EventSpan> eventsWithin(const WindowSample& sample, const Window& window);

/// Returns the part of a sample with a duration around the middle of its window, at most all of it.
WindowData middleOf(const WindowSample& sample, double duration_s);

/// Samples of some windows, evenly spread over a recording of unknown length: if there are more
/// than `kMaxSamples`, every second sample is dropped.
class SpreadSamples {
 public:
  static constexpr std::size_t kMaxSamples = 8;

  /// Adds a window. To be called with each window of a recording, in order.
  void add(const WindowData& data);
  const std::vector<WindowSample>& samples() const { return samples_; }
  /// Returns the samples and leaves none in this object.
  std::vector<WindowSample> take() { return std::move(samples_); }

 private:
  std::vector<WindowSample> samples_;
  std::size_t step_ = 1;  // every `step_`-th window is kept
  std::size_t windows_ = 0;
};

/// A short part of a sample, of a second or less.
struct SamplePiece {
  Window window;
  std::vector<std::vector<Event>> events;  // of each camera, evenly chosen
  Trajectory trajectory;                   // without jitter, of the whole sample

  WindowData along(const Trajectory& motion) const {
    return {window, {events.begin(), events.end()}, &motion};
  }
};

/// Maximum number of events of each camera.
inline constexpr std::uint32_t kMaxPieceEvents = 20'000;

/// Returns at most four pieces, evenly spread over the samples. The pieces in the middle come
/// first: they have poses for most time shifts.
std::vector<SamplePiece> piecesOf(const std::vector<WindowSample>& samples,
                                  const TrajectoryOptions& options);

/// The size of pieces that do not overlap.
struct PieceSize {
  double max_s = 0.2;
  std::uint32_t events = kMaxPieceEvents;  ///< Maximum number of each camera.
};
std::vector<SamplePiece> piecesOf(const std::vector<WindowSample>& samples,
                                  const TrajectoryOptions& options, const PieceSize& size);

/// Measures the motion of the cameras that the options select.
inline std::optional<ViewMotion> motionIn(const WindowData& data, const Rig& rig,
                                          const FusionMapperOptions& options) {
  return motionIn(data, rig, selectedCameras(rig, options.cameras), options.keyframe);
}

/// Common lenses do not focus on a nearer scene. It is searched only if the options ask for it.
inline constexpr double kNearestSceneM = 0.1;

/// The coarseness of a sweep. The default has enough pixels for the distribution of depths.
struct Coarseness {
  int width = 160;                ///< Maximum width of the view, pixels.
  std::uint32_t events = 40'000;  ///< Maximum number of events of each camera.
  double plane_step_px = 1;       ///< Parallax between neighbouring planes, pixels.
  double nearest_m = kNearestSceneM;
  ExtractionMethod extraction = ExtractionMethod::kAggregated;
};

/// A coarse sweep of samples in a small view, over a wide range of depths that follows from the
/// baseline.
class CoarseSweep {
 public:
  CoarseSweep(const Rig& rig, const FusionMapperOptions& options,
              const Coarseness& coarseness = {});

  /// Maps a window. @return std::nullopt without a pose, without events or without parallax.
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
  /// The median parallax of all these pixels, in pixels. It counts as 0 on the farthest plane. If
  /// it is less than some pixels, the depths are mostly noise.
  double parallax_px = 0;

  /// Returns the upper median, 1/m. @pre There is a point.
  double median() const { return inverse[inverse.size() / 2]; }
};

/// With fewer points, the range of depths is unknown.
inline constexpr std::size_t kMinScenePoints = 100;

struct InverseRange {
  double far = 0;   ///< 1/m
  double near = 0;  ///< 1/m
};

/// Returns the range of inverse depths of the scene. Wrong points are spread over all planes,
/// points of the scene are not. The range is the interval with the largest difference between its
/// fraction of the points and half of its fraction of the planes.
/// @param depths have at least one point.
InverseRange denseRange(const SceneDepths& depths);

/// Returns the limits of a map for a scene of this range: wider by a factor of at least 1.25 on
/// both sides, and nearly a factor of 10 apart. Closer limits hide that a peak is ambiguous: with
/// limits a factor of 4 apart, `hd_stereo` has 2.5 times the wrong points at equal numbers of
/// points.
InverseRange limitsAround(const InverseRange& scene);

SceneDepths sceneDepths(CoarseSweep& sweep, const std::vector<WindowSample>& samples,
                        double window_s);

}  // namespace efm
