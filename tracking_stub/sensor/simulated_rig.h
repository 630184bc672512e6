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

/// Everything that a simulated recording follows from.
struct Simulation {
  Scene scene;
  Rig rig;  ///< Synchronised: time offsets are 0. The dataset folder wants camera 0 for its frame.
  std::shared_ptr<const Motion> motion;
  std::int64_t start_ns = 0;     ///< Of the recording, in its own clock.
  std::int64_t duration_ns = 0;  ///< Above 0.
  EventPixelOptions pixels;
  EventNoiseOptions noise;
  /// Largest motion in the image from one frame to the next, in pixels, above 0. Within it log
  /// intensity is taken to change linearly: under a blur of half a pixel that misplaces an edge by
  /// 0.02 pixels at most.
  double max_step_px = 0.35;
  /// Of the pixels' memory when the recording starts, their mismatch and their noise.
  std::uint64_t seed = 0;
  double truth_cell_m = 0.01;  ///< Of the truth clouds: one point per cell of the surfaces.

  std::int64_t endNs() const { return start_ns + duration_ns; }
};

/// One camera's events and, for each, the place that its pixel saw; none for noise.
struct CameraRecording {
  std::vector<Event> events;  ///< By time, then row, then column; start <= t <= end.
  std::vector<SurfacePoint> sources;
};

struct SimulationRun {
  std::optional<int> threads;  ///< 1 to 1024; as many as there are cores where not given.
  /// Told the share of the work that is done, 0 to 1, now and then, from the caller's thread.
  std::function<void(double)> progress;
};

/// Drives the rig through the scene: per camera in the order of the rig. The same simulation gives
/// the same events, whatever the number of threads.
/// @throws std::invalid_argument where the simulation or the number of threads is not valid.
std::vector<CameraRecording> simulateEvents(const Simulation& simulation,
                                            const SimulationRun& run = {});

/// The true motion, sampled from start to end, both included, at a fixed period: dense enough that
/// interpolation between the samples is exact to far below 0.01 pixels for a hand-held motion.
std::vector<StampedPose> samplePoses(const Simulation& simulation,
                                     std::int64_t period_ns = 1'000'000);

}  // namespace efm
