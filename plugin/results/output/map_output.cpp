// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/results/output/map_output.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <utility>

#include "event_fusion/engine.h"
#include "mapping/base/picture_file.h"
#include "mapping/geometry/timestamp.h"
#include "maps/io/point_cloud_file.h"
#include "plugin/results/pictures/depth_picture.h"
#include "plugin/results/pictures/picture.h"

namespace efm {
namespace {

/// The images of one depth map.
constexpr std::array<std::string_view, 5> kImages = {
    "depth.tiff", "confidence.tiff", "probability.tiff", "depth.png", "confidence.png"};
constexpr std::string_view kEventImage = "events.png";
// Removed first: without the report, the remaining files do not look like a complete result.
constexpr const char* kReport = "report.json";
constexpr const char* kKeyframes = "keyframes";
constexpr std::array<std::string_view, 8> kMapFiles = {
    "map.html",      "map.pcd",      "map.png",        "map.ply",
    "map.simplemap", "overview.png", "trajectory.txt", "trajectory_tracker.txt"};
constexpr std::array<std::string_view, 2> kDepthFiles = {"points.pcd", "dsi.npy"};

void makeFolder(const std::filesystem::path& folder) {
  if (folder.empty()) throw std::runtime_error("'': expected the name of the folder to write");
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (!std::filesystem::is_directory(folder)) {
    throw std::runtime_error("cannot make the folder " + folder.string() + ": " +
                             (error ? error.message() : "a file of that name is there"));
  }
}

/// Removes a regular file: other files were not written here. @return true if a file was removed.
bool removeFile(const std::filesystem::path& file) {
  return std::filesystem::is_regular_file(std::filesystem::symlink_status(file)) &&
         std::filesystem::remove(file);
}

template <typename Names>
void removeFiles(const std::filesystem::path& folder, const Names& names) {
  for (const std::string_view name : names) removeFile(folder / name);
}

/// Removes the files that a killed run was writing.
void removeTemporaryFiles(const std::filesystem::path& folder, pid_t process) {
  const auto removeIn = [&](const std::filesystem::path& place, const auto& names) {
    for (const std::string_view name : names) {
      for (int trial = 0; removeFile(AtomicFile::temporaryName(place / name, process, trial));
           ++trial) {
      }
    }
  };
  const auto removeImagesIn = [&](const std::filesystem::path& place) {
    removeIn(place, kImages);
    removeIn(place, std::array{kEventImage});
  };
  removeIn(folder, kMapFiles);
  removeIn(folder, kDepthFiles);
  removeIn(folder, std::array{std::string_view(kReport)});
  removeImagesIn(folder);
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (std::filesystem::is_directory(entry.symlink_status())) removeImagesIn(entry.path());
  }
}

constexpr std::string_view kCameraFolder = "cam";  // followed by the camera's index

std::string cameraFolder(int camera) { return std::string(kCameraFolder) + std::to_string(camera); }

bool isCameraFolder(const std::filesystem::directory_entry& entry) {
  const std::string name = entry.path().filename().string();
  return name.size() > kCameraFolder.size() && name.rfind(kCameraFolder, 0) == 0 &&
         name.find_first_not_of("0123456789", kCameraFolder.size()) == std::string::npos &&
         std::filesystem::is_directory(entry.symlink_status());
}

/// Removes the images of a keyframe and the images of its cameras.
void removeImages(const std::filesystem::path& folder) {
  removeFiles(folder, kImages);
  std::vector<std::filesystem::path> cameras;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (isCameraFolder(entry)) cameras.push_back(entry.path());
  }
  for (const std::filesystem::path& camera : cameras) {
    removeFiles(camera, kImages);
    removeFiles(camera, std::array{kEventImage});
    if (std::filesystem::is_empty(camera)) std::filesystem::remove(camera);
  }
}

bool isKeyframeFolder(const std::filesystem::directory_entry& entry) {
  const std::string name = entry.path().filename().string();
  const std::optional<std::int64_t> t_ns = parseSeconds(name);
  return t_ns && formatSeconds(*t_ns) == name &&
         std::filesystem::is_directory(entry.symlink_status());
}

std::vector<std::filesystem::path> keyframeFolders(const std::filesystem::path& keyframes) {
  std::vector<std::filesystem::path> folders;
  if (!std::filesystem::is_directory(keyframes)) return folders;
  for (const auto& entry : std::filesystem::directory_iterator(keyframes)) {
    if (isKeyframeFolder(entry)) folders.push_back(entry.path());
  }
  return folders;
}

void removeKeyframe(const std::filesystem::path& keyframe) {
  removeImages(keyframe);
  if (std::filesystem::is_empty(keyframe)) std::filesystem::remove(keyframe);
}

void removeKeyframes(const std::filesystem::path& keyframes) {
  if (!std::filesystem::is_directory(keyframes)) return;
  for (const auto& keyframe : keyframeFolders(keyframes)) removeKeyframe(keyframe);
  if (!std::filesystem::is_symlink(keyframes) && std::filesystem::is_empty(keyframes)) {
    std::filesystem::remove(keyframes);
  }
}

/// Returns the content of a report, std::nullopt if the file is not the report of a run.
std::optional<EarlierResult> readReport(const std::filesystem::path& file) {
  if (!std::filesystem::is_regular_file(file)) return std::nullopt;
  std::ifstream stream(file);
  const auto report = nlohmann::json::parse(stream, nullptr, false);
  if (!report.is_object() || !report.contains("version") || !report.contains("options") ||
      !report.contains("keyframes")) {
    return std::nullopt;
  }
  try {
    return EarlierResult{true, report.value("recording", std::vector<std::string>()),
                         report["keyframes"].get<std::uint64_t>()};
  } catch (const nlohmann::json::exception&) {
    return std::nullopt;
  }
}

/// Returns a function that writes a file; `write` puts the content into a stream.
std::function<void(const std::filesystem::path&)> byStream(
    std::function<void(std::ostream&)> write) {
  return [write = std::move(write)](const std::filesystem::path& path) {
    std::ofstream file(path, std::ios::binary);
    write(file);
    file.close();
    if (!file) throw std::runtime_error("the file cannot be created or the disk is full");
  };
}

}  // namespace

bool EarlierResult::isOf(const std::vector<std::string>& files) const {
  const auto text = [](const std::vector<std::string>& names) {
    return nlohmann::json(names).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  };
  return text(recording) == text(files);
}

MapOutput::MapOutput(std::filesystem::path folder, OutputKind kind,
                     const DepthPlanesOptions& limits, PictureStyle style,
                     std::vector<std::string> recording)
    : folder_(std::move(folder)),
      kind_(kind),
      limits_(limits),
      style_(style),
      recording_(std::move(recording)) {
  makeFolder(folder_);
  // Done before the first file of this run: dsi.npy may be in progress when `begin` runs.
  const auto killed = RunMark::ofKilledRun(folder_);
  if (!killed) return;
  removeTemporaryFiles(folder_, killed->process);
  for (const auto& empty : keyframeFolders(folder_ / kKeyframes)) ::rmdir(empty.c_str());
  // Without a report the mark stays: only the mark shows that the folder holds a result.
  if (readReport(folder_ / kReport)) removeFile(folder_ / RunMark::kName);
}

std::optional<EarlierResult> MapOutput::earlierResult(const std::filesystem::path& folder) {
  const auto killed = RunMark::ofKilledRun(folder);
  if (auto result = readReport(folder / kReport)) return result;
  if (!killed) return std::nullopt;
  return EarlierResult{false, killed->recording, keyframeFolders(folder / kKeyframes).size()};
}

bool MapOutput::holdsFilesOf(OutputKind kind, const std::filesystem::path& folder) {
  const auto has = [&](std::string_view name) { return std::filesystem::exists(folder / name); };
  if (kind == OutputKind::kMap) {
    return has(kKeyframes) || std::any_of(kMapFiles.begin(), kMapFiles.end(), has);
  }
  return std::any_of(kDepthFiles.begin(), kDepthFiles.end(), has) ||
         std::any_of(kImages.begin(), kImages.end(), has);
}

MapOutput::~MapOutput() {
  if (!keeps_earlier_) return;
  waiting_.clear();
  // rmdir removes only empty folders: files, and folders that hold files, stay.
  for (auto path = not_on_disk_.rbegin(); path != not_on_disk_.rend(); ++path) {
    ::rmdir(path->c_str());
  }
  ::unlink((folder_ / RunMark::kName).c_str());
}

/// Prepares the folder before the first file.
void MapOutput::begin() {
  if (mark_) return;
  const std::optional<EarlierResult> earlier = earlierResult(folder_);
  mark_ = std::make_unique<RunMark>(folder_, recording_);
  keeps_earlier_ = earlier && earlier->complete;
  if (!keeps_earlier_) removeEarlier(earlier.has_value());
}

/// Removes an earlier result: a new map of five keyframes must not show two old keyframes.
void MapOutput::removeEarlier(bool of_both_kinds) {
  removeFiles(folder_, std::array{kReport});
  if (of_both_kinds || kind_ == OutputKind::kMap) {
    removeFiles(folder_, kMapFiles);
    removeKeyframes(folder_ / kKeyframes);
  }
  if (of_both_kinds || kind_ == OutputKind::kDepth) {
    removeFiles(folder_, kDepthFiles);
    removeImages(folder_);
  }
  syncToDisk(folder_);
}

void MapOutput::write(const std::filesystem::path& path,
                      const std::function<void(const std::filesystem::path&)>& fill,
                      DiskSync sync) {
  begin();
  if (!keeps_earlier_) return writeAtomically(path, fill, sync);
  auto file = std::make_unique<AtomicFile>(path);
  file->fill(fill);
  waiting_.push_back(std::move(file));
}

void MapOutput::add(std::unique_ptr<AtomicFile> file) {
  begin();
  if (!keeps_earlier_) return file->replace();
  waiting_.push_back(std::move(file));
}

void MapOutput::writeKeyframe(const KeyframeDepthMap& keyframe) {
  begin();
  const std::filesystem::path folder =
      folder_ / kKeyframes / formatSeconds(keyframe.window.t_ref_ns);
  makeFolder(folder);
  try {
    writeImagesTo(folder, keyframe);
  } catch (...) {
    if (!keeps_earlier_) removeKeyframe(folder);  // no incomplete keyframe stays
    throw;
  }
}

void MapOutput::writeImages(const KeyframeDepthMap& keyframe) {
  begin();
  writeImagesTo(folder_, keyframe);
}

void MapOutput::writeImagesTo(const std::filesystem::path& folder,
                              const KeyframeDepthMap& keyframe) {
  writeMap(folder, keyframe.map);
  for (const CameraDepthMap& camera : keyframe.camera_maps) {
    const std::filesystem::path own = folder / cameraFolder(camera.camera);
    makeFolder(own);
    writeMap(own, camera.map);
  }
  for (const EventImage& image : keyframe.event_images) {
    const std::filesystem::path own = folder / cameraFolder(image.camera);
    makeFolder(own);
    writeImage(own / kEventImage, eventPicture(image.counts));
  }
}

/// Writes a picture. All pictures are synced to disk together, before the report: this is faster.
void MapOutput::writeImage(const std::filesystem::path& path, const cv::Mat& image) {
  const std::size_t folder = folder_.native().size();
  for (std::filesystem::path part = path; part.native().size() > folder;) {
    not_on_disk_.insert(part);
    part = part.parent_path();
  }
  const bool png = path.extension() == ".png";
  const auto encode = [&](std::ostream& file) {
    file << (png ? encodePng(image, PngPacking::kQuick) : encodeTiff(image));
  };
  write(path, byStream(encode), DiskSync::kLater);
}

void MapOutput::writeMap(const std::filesystem::path& folder, const DepthMap& map) {
  writeImage(folder / "depth.tiff", map.depth);
  writeImage(folder / "confidence.tiff", map.confidence);
  cv::Mat1f probability = map.probability;
  if (probability.empty()) {  // of no pixel known
    probability = cv::Mat1f::zeros(map.depth.size());
    probability.setTo(std::numeric_limits<float>::quiet_NaN(), map.depth > 0);
  }
  writeImage(folder / "probability.tiff", probability);
  const bool plain = style_ == PictureStyle::kPlain;
  writeImage(folder / "depth.png", plain ? depthPicture(map.depth, limits_, Palette::kBlueToRed)
                                         : depthFigure(map, limits_));
  writeImage(folder / "confidence.png",
             plain ? confidencePicture(map.confidence) : confidenceFigure(map.confidence));
}

void MapOutput::writeTrajectory(const std::string& name, const std::vector<StampedPose>& poses) {
  write(folder_ / name, byStream([&](std::ostream& file) { writeTumTrajectory(file, poses); }));
}

void MapOutput::writeCloud(const std::string& name, const MapCloud& cloud) {
  write(folder_ / name, byStream([&](std::ostream& file) { writePcdTo(file, cloud); }));
}

void MapOutput::writeColouredCloud(const MapCloud& cloud, const Eigen::Vector3d& upward,
                                   const std::vector<StampedPose>& views) {
  const std::vector<PointColour> colours = coloursByHeight(cloud, upward);
  write(folder_ / "map.ply",
        byStream([&](std::ostream& file) { writePlyTo(file, cloud, colours, views); }));
}

void MapOutput::writeFile(const std::string& name,
                          const std::function<void(const std::filesystem::path&)>& write) {
  this->write(folder_ / name, write);
}

void MapOutput::writePicture(const std::string& name, const cv::Mat3b& picture) {
  writeImage(folder_ / name, picture);
}

void MapOutput::writePage(const std::function<void(std::ostream&)>& write) {
  this->write(folder_ / "map.html", byStream(write));
}

void MapOutput::writeReport(const std::string& json) {
  begin();
  writeAtomically(folder_ / kReport, [&](const std::filesystem::path& temporary) {
    byStream([&](std::ostream& file) { file << json; })(temporary);
    for (const auto& file : waiting_) syncToDisk(file->temporary());
    if (std::exchange(keeps_earlier_, false)) removeEarlier(true);
    for (const auto& file : waiting_) file->replace(DiskSync::kLater);
    waiting_.clear();
    for (const std::filesystem::path& path : not_on_disk_) syncToDisk(path);
    not_on_disk_.clear();
  });
  removeFile(folder_ / RunMark::kName);
}

void writePly(const std::filesystem::path& file, const MapCloud& cloud,
              const std::vector<StampedPose>& views) {
  const std::vector<PointColour> colours = coloursByHeight(cloud, Eigen::Vector3d::UnitZ());
  AtomicFile atomic(file);
  byStream([&](std::ostream& stream) { writePlyTo(stream, cloud, colours, views); })(
      atomic.temporary());
  atomic.replace();
}

}  // namespace efm
