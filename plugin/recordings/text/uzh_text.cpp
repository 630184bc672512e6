// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/text/uzh_text.h"

#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "plugin/recordings/streams/source_files.h"
#include "plugin/recordings/text/event_text.h"
#include "plugin/recordings/text/pose_text.h"

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

/// The events, with the size of the images.
class UzhEvents : public EventTextStream {
 public:
  UzhEvents(const fs::path& folder, const ReaderOptions& options)
      : EventTextStream(eventFileIn(folder), options), size_(sizeOfImages(folder)) {}
  std::optional<CameraSize> size() const override {
    return size_ ? size_ : EventTextStream::size();
  }

 private:
  std::optional<CameraSize> size_;
};

}  // namespace

bool looksLikeUzhFolder(const fs::path& folder) { return isFile(eventFileIn(folder)); }

RecordingParts openUzhFolder(const std::vector<fs::path>& folders, const ReaderOptions& options) {
  const fs::path& folder = onlySource(folders, "a folder in the UZH layout");
  RecordingParts parts;
  parts.expected_calibration = "calib.txt";
  parts.expected_poses = "groundtruth.txt";
  parts.default_size = kDavis240c;
  parts.cameras.push_back(std::make_unique<UzhEvents>(folder, options));
  std::error_code ignored;
  if (fs::exists(folder / "calib.txt", ignored)) {
    parts.calibration = readUzhCalibration(folder / "calib.txt");
  }
  if (fs::exists(folder / "groundtruth.txt", ignored)) {
    parts.poses = requirePoseText(folder / "groundtruth.txt", options);
  }
  return parts;
}

CameraSize uzhSensorSize(const fs::path& folder) {
  return sizeOfImages(folder).value_or(kDavis240c);
}

}  // namespace efm
