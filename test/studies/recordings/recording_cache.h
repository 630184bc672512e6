// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "mapping/events/event.h"
#include "mapping/events/window.h"
#include "mapping/geometry/trajectory.h"
#include "tracking_stub/sensor/simulated_rig.h"

namespace efm::studies {

/// A simulation with its events and poses. Several methods map it, and its truth judges them.
struct Recording {
  Simulation simulation;
  std::vector<std::vector<Event>> events;  ///< Per camera, in time order.
  /// For each event the point that its pixel saw, frame `world`, metres; NaN for noise.
  std::vector<std::vector<Eigen::Vector3f>> sources;
  Trajectory trajectory;  ///< The true poses, every millisecond.

  /// `count` windows of equal duration, evenly spread from the start to the end of the recording.
  /// They may overlap. The reference time is in the middle of a window.
  std::vector<Window> windows(double window_s, int count) const;
  /// A camera's events in a window.
  EventSpan eventsOf(std::size_t camera, const Window& window) const;
  /// The events of all cameras in a window.
  std::vector<EventSpan> eventsOf(const Window& window) const;
  /// Mean number of events of all cameras in a window.
  double meanEventsIn(const std::vector<Window>& windows) const;
};

/// A hash of the inputs of a simulation: cameras, motion, surfaces and their textures, pixels,
/// noise, seed and duration.
std::uint64_t fingerprintOf(const Simulation& simulation);

/// Simulated events on disk: they are simulated once. The name of a file contains the fingerprint
/// of its simulation, so a changed simulation gets another file. Remove the folder after a change
/// of the simulator itself.
class RecordingCache {
 public:
  /// @param folder made if it does not exist.
  explicit RecordingCache(std::filesystem::path folder);

  /// @param name for the file and the progress on the console.
  /// @throws std::runtime_error naming the file that cannot be read or written.
  Recording make(const std::string& name, const Simulation& simulation) const;

 private:
  std::filesystem::path folder_;
};

}  // namespace efm::studies
