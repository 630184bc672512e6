// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/app/observed_statistics.h"

#include <fmt/format.h>

#include <iostream>

#include "plugin/app/exit_status.h"
#include "plugin/mrpt/CObservationEvents.h"
#include "plugin/mrpt/pose_observation.h"

namespace efm {

bool addObservation(const mrpt::obs::CObservation& observation, RecordingStatistics& statistics) {
  if (const auto* packet = dynamic_cast<const CObservationEvents*>(&observation)) {
    const RigCamera camera{packet->camera, rigidFrom(packet->camera_pose), packet->time_offset_ns};
    statistics.addEvents(packet->camera_index, packet->sensorLabel, camera, packet->events);
    return true;
  }
  const auto source = poseSourceOf(observation);
  if (!source) return false;
  const auto observed = poseIn(observation);
  statistics.addPose(*source, observed->t_ns, observed->T_world_body, observed->T_body_rig);
  return true;
}

void printWarnings(const std::vector<Warning>& warnings) {
  for (const Warning& warning : warnings) {
    std::cerr << "event-fusion: warning: " << warning.name << ": " << warning.text << "\n";
  }
}

bool failStrictly(const std::vector<Warning>& warnings) {
  if (warnings.empty()) return false;
  fail(fmt::format("{} warnings, and --strict makes them errors", warnings.size()));
  return true;
}

}  // namespace efm
