// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/app/simulate_command.h"

#include <cstdio>

#include "plugin/app/progress.h"
#include "tracking_stub/dataset_writer.h"
#include "tracking_stub/simulated_rig.h"

namespace efm {

int runSimulate(const SimulateArguments& arguments) {
  const Simulation simulation = makeSimulation(arguments.simulation);
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
