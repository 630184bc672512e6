// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/text/dataset_folder.h"

#include <string>
#include <system_error>

#include "plugin/streams/source_files.h"
#include "plugin/text/event_text.h"
#include "tracking_stub/poses/tum_trajectory.h"

namespace efm {
namespace {

namespace fs = std::filesystem;

fs::path eventsOf(const fs::path& folder, std::size_t camera) {
  return eventFileIn(folder / ("cam" + std::to_string(camera)));
}

std::size_t countCameras(const fs::path& folder) {
  std::size_t count = 0;
  while (isFile(eventsOf(folder, count))) ++count;
  return count;
}

}  // namespace

bool looksLikeDatasetFolder(const fs::path& folder) {
  return isFile(folder / "camchain.yaml") || isFile(eventsOf(folder, 0));
}

RecordingParts openDatasetFolder(const std::vector<fs::path>& folders,
                                 const ReaderOptions& options) {
  const fs::path& folder = onlySource(folders, "a dataset folder");
  RecordingParts parts;
  parts.expected_calibration = "camchain.yaml";
  parts.expected_poses = "poses.txt or groundtruth.txt";
  addFolderFiles(folder, parts);
  const std::size_t count =
      parts.calibration ? parts.calibration->rig.cameras.size() : countCameras(folder);
  for (std::size_t camera = 0; camera < count; ++camera) {
    parts.cameras.push_back(std::make_unique<EventTextStream>(eventsOf(folder, camera), options));
  }
  return parts;
}

void addFolderFiles(const fs::path& folder, RecordingParts& parts) {
  const fs::path camchain = folder / "camchain.yaml";
  if (!parts.calibration && isFile(camchain)) parts.calibration = readCalibration(camchain);
  for (const char* name : {"poses.txt", "groundtruth.txt"}) {
    std::error_code ignored;
    if (!parts.poses.empty() || !fs::exists(folder / name, ignored)) continue;
    parts.poses = readPosesFile(folder / name);
  }
}

}  // namespace efm
