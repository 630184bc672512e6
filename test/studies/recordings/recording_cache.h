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

/// A simulation with its events and poses, to be mapped in several ways and held against its truth.
struct Recording {
  Simulation simulation;
  std::vector<std::vector<Event>> events;  ///< Per camera, in time order.
  /// For each event the place that its pixel saw, frame `world`, metres; NaN for noise.
  std::vector<std::vector<Eigen::Vector3f>> sources;
  Trajectory trajectory;  ///< The true poses, every millisecond.

  /// `count` windows of equal duration spread evenly over the recording, the first at its start and
  /// the last at its end, each with its reference view in the middle; they overlap where there is
  /// no room.
  std::vector<Window> windows(double window_s, int count) const;
  /// A camera's events in a window.
  EventSpan eventsOf(std::size_t camera, const Window& window) const;
  /// The events of all cameras in a window.
  std::vector<EventSpan> eventsOf(const Window& window) const;
  /// Mean number of events of all cameras in a window.
  double meanEventsIn(const std::vector<Window>& windows) const;
};

/// Identifies what a simulation makes: cameras, motion, surfaces and what is painted on them,
/// pixels, noise, seed and duration.
std::uint64_t fingerprintOf(const Simulation& simulation);

/// Simulated events on disk, so that they are simulated once. A file is known by the fingerprint of
/// its simulation: whatever a study changes of it makes another file. What a change of the
/// simulator itself does is not seen: remove the folder then.
class RecordingCache {
 public:
  /// @param folder made where it is not there.
  explicit RecordingCache(std::filesystem::path folder);

  /// @param name what the file and the progress on the console are called.
  /// @throws std::runtime_error naming the file that cannot be read or written.
  Recording make(const std::string& name, const Simulation& simulation) const;

 private:
  std::filesystem::path folder_;
};

}  // namespace efm::studies
