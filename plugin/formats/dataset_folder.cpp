// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/formats/dataset_folder.h"

#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "plugin/calibration/camchain.h"
#include "plugin/formats/merged_recording.h"
#include "plugin/recordings/recording_with_poses.h"
#include "tracking_stub/poses/tum_trajectory.h"

namespace efm {
namespace {

namespace fs = std::filesystem;

bool isFile(const fs::path& path) {
  std::error_code ignored;
  return fs::is_regular_file(path, ignored);
}

fs::path eventsOf(const fs::path& folder, std::size_t camera) {
  return folder / ("cam" + std::to_string(camera)) / "events.txt";
}

std::vector<StampedPose> readPoses(const fs::path& folder) {
  for (const char* name : {"poses.txt", "groundtruth.txt"}) {
    std::error_code ignored;
    if (fs::exists(folder / name, ignored)) return readPosesFile(folder / name);
  }
  throw std::runtime_error(folder.string() +
                           ": no poses: expected poses.txt or groundtruth.txt, or --poses FILE");
}

/// A given rig, with one camera for each camN/events.txt.
Rig givenRig(const Calibration& calibration, const fs::path& folder) {
  Rig rig;
  while (isFile(eventsOf(folder, rig.cameras.size()))) {
    rig.cameras.push_back(calibration.camera(rig.cameras.size(), std::nullopt));
  }
  calibration.requireCameras(rig.cameras.size());
  return rig;
}

/// The folder's own rig if it has one. Then the caller replaces it by a given one and counts the
/// difference.
Rig readRig(const fs::path& folder, const RecordingOverrides& given) {
  const fs::path own = folder / "camchain.yaml";
  if (isFile(own)) {
    Rig rig = readCamchain(own);
    if (given.calibration != nullptr) given.calibration->requireLike(rig);
    return rig;
  }
  if (given.calibration != nullptr) return givenRig(*given.calibration, folder);
  throw std::runtime_error(folder.string() +
                           ": no calibration: expected camchain.yaml, or --calibration FILE");
}

}  // namespace

bool looksLikeDatasetFolder(const fs::path& folder) {
  return isFile(folder / "camchain.yaml") || isFile(eventsOf(folder, 0));
}

std::unique_ptr<Recording> openDatasetFolder(const fs::path& folder,
                                             const RecordingOverrides& given) {
  Rig rig = readRig(folder, given);
  std::vector<EventTextReader> readers;
  for (std::size_t camera = 0; camera < rig.cameras.size(); ++camera) {
    const CameraModel& model = rig.cameras[camera].model;
    readers.emplace_back(eventsOf(folder, camera), CameraSize{model.width, model.height});
  }
  auto events = std::make_unique<MergedRecording>(std::move(rig), std::move(readers));
  if (given.has_poses) return events;
  return std::make_unique<RecordingWithPoses>(std::move(events), readPoses(folder));
}

}  // namespace efm
