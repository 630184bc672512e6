// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/open/recording_formats.h"
#include "test/studies/recordings/real_rigs.h"

#include <string>

#include "mapping/geometry/trajectory.h"
#include "plugin/recordings/calibration/calibration_formats.h"
#include "tracking_stub/presets/presets.h"

namespace efm::studies {
namespace {

std::filesystem::path need(const std::filesystem::path& file) {
  if (!std::filesystem::exists(file)) throw MissingData("no such file: " + file.string());
  return file;
}

Simulation simulate(const StudyRun& run, const std::string& rig, const std::string& trajectory,
                    const TrajectorySimulationOptions& options) {
  return makeTrajectorySimulation(
      options, readPoses(need(run.data / "trajectories" / trajectory)),
      readCamchain(need(run.data / "calibration" / rig / "camchain.yaml")));
}

}  // namespace

Simulation mvsecInRoom(const StudyRun& run, double duration_s) {
  TrajectorySimulationOptions options;
  options.scene = "room";
  options.duration_s = duration_s;
  return simulate(run, "mvsec", "mvsec_indoor_flying1.txt", options);
}

Recording roomRecording(const StudyRun& run) {
  return run.recordings->make("mvsec_room", mvsecInRoom(run, run.pick(10.0, 0.2)));
}

Simulation dsecInStreet(const StudyRun& run, double duration_s) {
  TrajectorySimulationOptions options;
  options.scene = "street";
  options.duration_s = duration_s;
  return simulate(run, "dsec", "dsec_zurich_city_04.txt", options);
}

}  // namespace efm::studies
