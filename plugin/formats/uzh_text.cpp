// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/formats/uzh_text.h"

#include <fmt/format.h>

#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "plugin/formats/merged_recording.h"
#include "plugin/recordings/recording_with_poses.h"
#include "tracking_stub/poses/tum_trajectory.h"

namespace efm {
namespace {

namespace fs = std::filesystem;

constexpr CameraSize kDavis240c = {240, 180};

/// The size of the first existing image of images.txt.
std::optional<CameraSize> sizeOfImages(const fs::path& folder) {
  std::ifstream list(folder / "images.txt");
  std::string line;
  while (std::getline(list, line)) {
    std::istringstream fields(line);
    std::string time;
    std::string name;
    if (!(fields >> time >> name) || time[0] == '#') continue;
    const fs::path file = folder / name;
    std::error_code ignored;
    if (!fs::is_regular_file(file, ignored)) continue;
    const cv::Mat image = cv::imread(file.string(), cv::IMREAD_UNCHANGED);
    if (image.empty()) {
      throw std::runtime_error(file.string() +
                               ": cannot be read as an image: expected one as large as the sensor");
    }
    return CameraSize{image.cols, image.rows};
  }
  return std::nullopt;
}

void requireFile(const fs::path& folder, const char* name, const char* what, const char* option) {
  std::error_code ignored;
  if (fs::exists(folder / name, ignored)) return;
  throw std::runtime_error(
      fmt::format("{}: no {}: expected {}, or {} FILE", folder.string(), what, name, option));
}

/// Only an image tells the size of the folder's sensor.
RigCamera givenCamera(const Calibration& calibration, const fs::path& folder) {
  calibration.requireCameras(1);
  const bool has_size = calibration.rig.cameras[0].model.width > 0;
  const std::optional<CameraSize> size = sizeOfImages(folder);
  return calibration.camera(0, size || has_size ? size : kDavis240c);
}

/// The folder's own camera if it has one. Then the caller replaces it by a given one and counts the
/// difference.
RigCamera readCamera(const fs::path& folder, const RecordingOverrides& given) {
  std::optional<RigCamera> camera;
  if (given.calibration != nullptr) camera = givenCamera(*given.calibration, folder);
  std::error_code ignored;
  if (camera && !fs::exists(folder / "calib.txt", ignored)) return *camera;
  requireFile(folder, "calib.txt", "calibration", "--calibration");
  const CameraSize size =
      camera ? CameraSize{camera->model.width, camera->model.height} : uzhSensorSize(folder);
  return {readUzhCalibration(folder / "calib.txt", size), {}, 0};
}

}  // namespace

bool looksLikeUzhFolder(const fs::path& folder) {
  std::error_code ignored;
  return fs::is_regular_file(folder / "events.txt", ignored);
}

std::unique_ptr<Recording> openUzhFolder(const fs::path& folder, const RecordingOverrides& given) {
  Rig rig;
  rig.cameras.push_back(readCamera(folder, given));
  const CameraModel& model = rig.cameras[0].model;
  std::vector<EventTextReader> readers;
  readers.emplace_back(folder / "events.txt", CameraSize{model.width, model.height});
  auto events = std::make_unique<MergedRecording>(std::move(rig), std::move(readers));
  if (given.has_poses) return events;
  requireFile(folder, "groundtruth.txt", "poses", "--poses");
  return std::make_unique<RecordingWithPoses>(std::move(events),
                                              readPosesFile(folder / "groundtruth.txt"));
}

CameraSize uzhSensorSize(const fs::path& folder) {
  return sizeOfImages(folder).value_or(kDavis240c);
}

}  // namespace efm
