// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/text/dataset_folder.h"

#include <fmt/format.h>

#include <fstream>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>

#include "mapping/base/atomic_file.h"
#include "mapping/base/picture_file.h"
#include "mapping/base/text.h"
#include "mapping/geometry/timestamp.h"
#include "plugin/recordings/text/event_text.h"
#include "plugin/recordings/text/pose_text.h"

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

/// Returns the size of the first existing image of images.txt; std::nullopt if there is none.
std::optional<CameraSize> sizeOfImages(const fs::path& folder) {
  if (!isFile(folder / "images.txt")) return std::nullopt;
  for (const TimedFile& image : timedFilesIn(folder / "images.txt")) {
    if (!isFile(image.file)) continue;
    try {
      const cv::Size size = pictureSize(readBytes(image.file));
      return CameraSize{size.width, size.height};
    } catch (const std::runtime_error& error) {
      throw std::runtime_error(image.file.string() + ": cannot be read as an image: " +
                               error.what() + ", as large as the sensor");
    }
  }
  return std::nullopt;
}

}  // namespace

bool looksLikeDatasetFolder(const fs::path& folder) {
  return isFile(eventsOf(folder, 0)) ||
         (isFile(folder / "camchain.yaml") && !isFile(eventFileIn(folder)));
}

RecordingParts openDatasetFolder(const std::vector<fs::path>& folders,
                                 const ReaderOptions& options) {
  const fs::path& folder = onlySource(folders, "a dataset folder");
  RecordingParts parts;
  parts.expected_calibration = "camchain.yaml";
  parts.expected_poses = "poses.txt or groundtruth.txt";
  addFolderFiles(folder, options, parts);
  const std::size_t with_events = countCameras(folder);
  const std::size_t count = parts.calibration ? parts.calibration->rig.cameras.size() : with_events;
  if (count < with_events) {
    throw std::runtime_error(
        fmt::format("{}: {} cameras: expected {}, because the folder has events of cam0 to cam{}",
                    parts.calibration->file.string(), count, with_events, with_events - 1));
  }
  for (std::size_t camera = 0; camera < count; ++camera) {
    auto streams = openEventText(eventsOf(folder, camera), options);
    if (streams.size() > 1) {
      throw std::runtime_error(fmt::format(
          "{}: events of {} cameras: expected one in each folder camN, or give the file itself",
          streams.front()->name(), streams.size()));
    }
    parts.cameras.push_back(std::move(streams.front()));
  }
  return parts;
}

void addFolderFiles(const fs::path& folder, const ReaderOptions& options, RecordingParts& parts) {
  const fs::path camchain = folder / "camchain.yaml";
  if (!parts.calibration && isFile(camchain)) parts.calibration = readCalibration(camchain);
  for (const char* name : {"poses.txt", "groundtruth.txt"}) {
    std::error_code ignored;
    if (options.leaves_out_poses || !parts.poses.empty() || !fs::exists(folder / name, ignored))
      continue;
    parts.poses = readPoseText(folder / name, options, parts);
  }
}

std::vector<TimedFile> timedFilesIn(const fs::path& list) {
  std::vector<TimedFile> files;
  std::ifstream stream(list);
  if (!stream) throw std::runtime_error(list.string() + ": cannot be opened for reading");
  std::string line;
  for (std::size_t number = 1; std::getline(stream, line); ++number) {
    const auto words = splitWords(std::string_view(line).substr(0, line.find('#')));
    if (words.empty()) continue;
    const auto t_ns = parseSeconds(words[0]);
    if (!t_ns || words.size() < 2) {
      throw std::runtime_error(fmt::format("{}:{}: {}: expected a time in seconds and a file",
                                           list.string(), number, inQuotes(line)));
    }
    files.push_back({*t_ns, list.parent_path() / words[1]});
  }
  return files;
}

std::vector<TimedFile> truthOfFolder(const fs::path& folder) {
  const fs::path index = folder / "depth" / "index.txt";
  return isFile(index) ? timedFilesIn(index) : std::vector<TimedFile>();
}

bool looksLikeUzhFolder(const fs::path& folder) { return isFile(eventFileIn(folder)); }

RecordingParts openUzhFolder(const std::vector<fs::path>& folders, const ReaderOptions& options) {
  const fs::path& folder = onlySource(folders, "a folder in the UZH layout");
  RecordingParts parts;
  parts.expected_calibration = "calib.txt or camchain.yaml";
  parts.expected_poses = "groundtruth.txt or poses.txt";
  parts.default_size = CameraSize{240, 180};  // the whole dataset was recorded with a DAVIS240C
  const auto size = sizeOfImages(folder);
  for (auto& events : openEventText(eventFileIn(folder), options)) {
    if (size) events->setSize(*size);
    parts.cameras.push_back(std::move(events));
  }
  std::error_code ignored;
  if (fs::exists(folder / "calib.txt", ignored)) {
    parts.calibration = readUzhCalibration(folder / "calib.txt");
  }
  if (!options.leaves_out_poses && fs::exists(folder / "groundtruth.txt", ignored)) {
    parts.poses = readPoseText(folder / "groundtruth.txt", options, parts);
  }
  addFolderFiles(folder, options, parts);
  return parts;
}

}  // namespace efm
