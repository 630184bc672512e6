// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "mapping/events/event.h"
#include "mapping/geometry/rig.h"
#include "mapping/geometry/trajectory.h"
#include "tracking_stub/motion/motion.h"
#include "tracking_stub/scenes/scene.h"
#include "tracking_stub/sensor/event_noise.h"
#include "tracking_stub/sensor/event_pixels.h"

namespace efm {

/// All inputs of a simulated recording.
struct Simulation {
  Scene scene;
  Rig rig;  ///< Time offsets are 0. In a dataset folder the rig's frame is camera 0.
  std::shared_ptr<const Motion> motion;
  std::int64_t start_ns = 0;     ///< In the clock of the recording.
  std::int64_t duration_ns = 0;  ///< Above 0.
  EventPixelOptions pixels;
  EventNoiseOptions noise;
  /// Max motion in the image between two frames, in pixels, above 0. Between frames log intensity
  /// changes linearly: with a blur of half a pixel, the default misplaces an edge by at most 0.02
  /// pixels.
  double max_step_px = 0.35;
  /// Seed of the pixels' initial memory, mismatch and noise.
  std::uint64_t seed = 0;
  double truth_cell_m = 0.01;  ///< The truth clouds have a point per cell of a surface.

  std::int64_t endNs() const { return start_ns + duration_ns; }
};

/// The events of a camera and, for each, the surface point that its pixel saw; none for noise.
struct CameraRecording {
  std::vector<Event> events;  ///< By time, then row, then column; start <= t <= end.
  std::vector<SurfacePoint> sources;
};

struct SimulationRun {
  std::optional<int> threads;  ///< 1 to 1024. Default: the number of cores.
  /// Called at times with the completed fraction, 0 to 1, in the caller's thread.
  std::function<void(double)> progress;
};

/// Moves the rig through the scene and returns a recording per camera. The events do not depend on
/// the number of threads.
/// @throws std::invalid_argument where the simulation or the number of threads is not valid.
std::vector<CameraRecording> simulateEvents(const Simulation& simulation,
                                            const SimulationRun& run = {});

/// The true motion, sampled from start to end, inclusive. With the default period, interpolation of
/// a hand-held motion is exact to far below 0.01 pixels.
std::vector<StampedPose> samplePoses(const Simulation& simulation,
                                     std::int64_t period_ns = 1'000'000);

}  // namespace efm
