// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <fstream>

#include "mapping/geometry/trajectory.h"
#include "test/plugin/session/synthetic_recording.h"
#include "tracking_stub/truth/dataset_writer.h"

namespace efm {

/// Writes a synthetic recording as a dataset folder.
inline void writeDataset(const SyntheticRecording& recording, const std::filesystem::path& folder) {
  Rig rig;
  rig.cameras = recording.cameras;
  for (std::size_t c = 0; c < rig.cameras.size(); ++c) {
    const auto camera = folder / ("cam" + std::to_string(c));
    std::filesystem::create_directories(camera);
    writeEvents(camera / "events.txt", recording.events[c]);
  }
  std::ofstream(folder / "camchain.yaml") << formatCamchain(rig);
  writeTumTrajectory(folder / "poses.txt", recording.poses);
}

}  // namespace efm
