// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/app/simulate_command.h"

#include <cstdio>
#include <stdexcept>
#include <vector>

#include "mapping/timestamp.h"
#include "plugin/app/progress.h"
#include "plugin/datasets/camchain.h"
#include "tracking_stub/dataset_writer.h"
#include "tracking_stub/simulated_rig.h"
#include "tracking_stub/simulation_preset.h"
#include "tracking_stub/trajectory_simulation.h"
#include "tracking_stub/tum_trajectory.h"

namespace efm {
namespace {

Simulation makePreset(const SimulateArguments& arguments) {
  SimulationOptions options;
  options.preset = arguments.preset;
  options.duration_s = arguments.duration_s;
  options.seed = arguments.seed;
  return makeSimulation(options);
}

Simulation makeOnTrajectory(const SimulateArguments& arguments) {
  TrajectorySimulationOptions options;
  options.scene = arguments.scene;
  options.start_ns = arguments.start_ns;
  options.duration_s = arguments.duration_s;
  options.seed = arguments.seed;
  const std::vector<StampedPose> poses = readTumTrajectory(arguments.trajectory);
  const Rig rig = readCamchain(arguments.calibration);
  try {
    return makeTrajectorySimulation(options, poses, rig);
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(arguments.trajectory.string() + ": " + error.what());
  }
}

void setPixels(const SimulateArguments& arguments, Simulation& simulation) {
  EventPixelOptions& pixels = simulation.pixels;
  pixels.threshold_on = arguments.threshold_on.value_or(pixels.threshold_on);
  pixels.threshold_off = arguments.threshold_off.value_or(pixels.threshold_off);
  pixels.mismatch = arguments.mismatch;
  pixels.refractory_ns = durationFromSeconds(arguments.refractory_us * 1e-6);
  simulation.noise = arguments.noise;
  pixels.validate();
  simulation.noise.validate();
}

}  // namespace

int runSimulate(const SimulateArguments& arguments) {
  Simulation simulation =
      arguments.preset.empty() ? makeOnTrajectory(arguments) : makePreset(arguments);
  setPixels(arguments, simulation);
  DatasetWriter writer(arguments.out);
  std::vector<CameraRecording> recordings;
  {
    Progress progress;
    SimulationRun run;
    run.progress = [&progress](double share) { progress.showShare("simulating", share); };
    recordings = simulateEvents(simulation, run);
    progress.show("writing");
    writer.write(simulation, recordings);
  }
  for (std::size_t c = 0; c < recordings.size(); ++c) {
    std::printf("cam%zu: %zu events\n", c, recordings[c].events.size());
  }
  std::printf("written to %s\n", arguments.out.c_str());
  return 0;
}

}  // namespace efm
