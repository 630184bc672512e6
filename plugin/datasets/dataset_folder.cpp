// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/datasets/dataset_folder.h"

#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "plugin/datasets/camchain.h"
#include "plugin/datasets/merged_recording.h"
#include "plugin/datasets/poses_file.h"

namespace efm {
namespace {

namespace fs = std::filesystem;

std::vector<StampedPose> readPoses(const fs::path& folder) {
  for (const char* name : {"poses.txt", "groundtruth.txt"}) {
    std::error_code ignored;
    if (fs::exists(folder / name, ignored)) return readPosesFile(folder / name);
  }
  throw std::runtime_error(folder.string() + ": no poses: expected poses.txt or groundtruth.txt");
}

}  // namespace

bool looksLikeDatasetFolder(const fs::path& folder) {
  std::error_code ignored;
  return fs::is_regular_file(folder / "camchain.yaml", ignored) ||
         fs::is_regular_file(folder / "cam0" / "events.txt", ignored);
}

std::unique_ptr<Recording> openDatasetFolder(const fs::path& folder) {
  Rig rig = readCamchain(folder / "camchain.yaml");
  std::vector<EventTextReader> readers;
  for (std::size_t camera = 0; camera < rig.cameras.size(); ++camera) {
    const CameraModel& model = rig.cameras[camera].model;
    readers.emplace_back(folder / ("cam" + std::to_string(camera)) / "events.txt",
                         CameraSize{model.width, model.height});
  }
  return std::make_unique<MergedRecording>(std::move(rig), std::move(readers), readPoses(folder));
}

}  // namespace efm
