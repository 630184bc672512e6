// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "mapping/events/event.h"
#include "mapping/events/window.h"
#include "mapping/geometry/rig.h"
#include "mapping/geometry/trajectory.h"
#include "test/mapping/keyframes/random_scene.h"

namespace efm::test {

/// Random events of some cameras in motion: one window full.
struct RandomRecording {
  static constexpr std::int64_t kStart_ns = 1'700'000'000'000'000'001;
  static constexpr std::int64_t kDuration_ns =
      100'000'007;  // no number of sub-intervals divides it
  static constexpr Window kWindow{kStart_ns, kStart_ns + kDuration_ns,
                                  kStart_ns + kDuration_ns / 2};

  Rig rig;
  Trajectory trajectory;
  std::vector<std::vector<Event>> events;  // per camera

  RandomRecording(std::uint32_t seed, int cameras, std::size_t events_per_camera) {
    RandomScene random(seed);
    trajectory = random.motion(kStart_ns, 0.11, 2.0, 2.0);
    for (int c = 0; c < cameras; ++c) {
      rig.cameras.push_back({smallCamera(), random.pose(0.1, 0.1), 0});
      events.push_back(random.events(smallCamera(), events_per_camera, kStart_ns, kDuration_ns));
    }
  }

  std::vector<int> cameras() const {
    std::vector<int> all;
    for (std::size_t c = 0; c < events.size(); ++c) all.push_back(static_cast<int>(c));
    return all;
  }
  std::vector<EventSpan> spans() const { return {events.begin(), events.end()}; }
};

}  // namespace efm::test
