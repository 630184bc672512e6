// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/output/map_output.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <utility>

#include "mapping/geometry/timestamp.h"
#include "maps/io/atomic_file.h"
#include "maps/io/point_cloud_file.h"
#include "plugin/pictures/depth_picture.h"
#include "plugin/pictures/height_colours.h"
#include "tracking_stub/poses/tum_trajectory.h"

namespace efm {
namespace {

/// The images of one depth map.
constexpr std::array<std::string_view, 4> kImages = {"depth.tiff", "confidence.tiff", "depth.png",
                                                     "confidence.png"};
constexpr std::string_view kEventImage = "events.png";
// Removed first: without it, what is left of an earlier result does not look complete.
constexpr const char* kReport = "report.json";
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

/// A file that is not regular was not written here.
void removeFile(const std::filesystem::path& file) {
  if (std::filesystem::is_regular_file(std::filesystem::symlink_status(file))) {
    std::filesystem::remove(file);
  }
}

template <typename Names>
void removeFiles(const std::filesystem::path& folder, const Names& names) {
  for (const std::string_view name : names) removeFile(folder / name);
}

/// What a killed run left of the files that it was writing.
template <typename Names>
void removePartialFiles(const std::filesystem::path& folder, const Names& names) {
  for (const std::string_view name : names) removeFile(AtomicFile::temporaryOf(folder / name));
}

constexpr std::string_view kCameraFolder = "cam";  // and the camera's index

std::string cameraFolder(int camera) { return std::string(kCameraFolder) + std::to_string(camera); }

bool isCameraFolder(const std::filesystem::directory_entry& entry) {
  const std::string name = entry.path().filename().string();
  return name.size() > kCameraFolder.size() && name.rfind(kCameraFolder, 0) == 0 &&
         name.find_first_not_of("0123456789", kCameraFolder.size()) == std::string::npos &&
         std::filesystem::is_directory(entry.symlink_status());
}

/// Removes the images of a keyframe and of its single cameras.
void removeImages(const std::filesystem::path& folder) {
  removeFiles(folder, kImages);
  removePartialFiles(folder, kImages);
  std::vector<std::filesystem::path> cameras;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (isCameraFolder(entry)) cameras.push_back(entry.path());
  }
  for (const std::filesystem::path& camera : cameras) {
    removeFiles(camera, kImages);
    removePartialFiles(camera, kImages);
    removeFiles(camera, std::array{kEventImage});
    removePartialFiles(camera, std::array{kEventImage});
    if (std::filesystem::is_empty(camera)) std::filesystem::remove(camera);
  }
}

bool isKeyframeFolder(const std::filesystem::directory_entry& entry) {
  const std::string name = entry.path().filename().string();
  const std::optional<std::int64_t> t_ns = parseSeconds(name);
  return t_ns && formatSeconds(*t_ns) == name &&
         std::filesystem::is_directory(entry.symlink_status());
}

void removeKeyframes(const std::filesystem::path& keyframes) {
  if (!std::filesystem::is_directory(keyframes)) return;
  std::vector<std::filesystem::path> earlier;
  for (const auto& entry : std::filesystem::directory_iterator(keyframes)) {
    if (isKeyframeFolder(entry)) earlier.push_back(entry.path());
  }
  for (const std::filesystem::path& keyframe : earlier) {
    removeImages(keyframe);
    if (std::filesystem::is_empty(keyframe)) std::filesystem::remove(keyframe);
  }
  if (!std::filesystem::is_symlink(keyframes) && std::filesystem::is_empty(keyframes)) {
    std::filesystem::remove(keyframes);
  }
}

/// Whether a file is the report of a run.
bool isReport(const std::filesystem::path& file) {
  if (!std::filesystem::is_regular_file(file)) return false;
  std::ifstream stream(file);
  const auto report = nlohmann::json::parse(stream, nullptr, false);
  return report.is_object() && report.contains("version") && report.contains("options") &&
         report.contains("keyframes");
}

void writeImage(const std::filesystem::path& path, const cv::Mat& image) {
  writeAtomically(path, [&](const std::filesystem::path& temporary) {
    // Not imwrite: where the disk is full, the libraries of pictures print that to stderr.
    std::vector<std::uint8_t> bytes;
    // Matching beside run lengths: a third of the size of OpenCV's default, in the same time.
    const std::vector<int> quick = {cv::IMWRITE_PNG_COMPRESSION, 1, cv::IMWRITE_PNG_STRATEGY,
                                    cv::IMWRITE_PNG_STRATEGY_DEFAULT};
    const std::string extension = path.extension().string();
    const std::vector<int> parameters = extension == ".png" ? quick : std::vector<int>();
    if (!cv::imencode(extension, image, bytes, parameters)) {
      throw std::runtime_error("no picture can be made of it");
    }
    std::ofstream file(temporary, std::ios::binary);
    file.write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
    file.close();
    if (!file) throw std::runtime_error("the file cannot be created or the disk is full");
  });
}

/// @param write puts the content into the stream.
template <typename Write>
void writeText(const std::filesystem::path& path, Write write) {
  writeAtomically(path, [&](const std::filesystem::path& temporary) {
    std::ofstream file(temporary, std::ios::binary);
    write(file);
    file.close();
    if (!file) throw std::runtime_error("the file cannot be created or the disk is full");
  });
}

}  // namespace

MapOutput::MapOutput(std::filesystem::path folder, OutputKind kind,
                     const DepthPlanesOptions& limits, PictureStyle style)
    : folder_(std::move(folder)), kind_(kind), limits_(limits), style_(style) {
  makeFolder(folder_);
  // Before the first file of this run: one may be under way when `removeEarlier` runs (dsi.npy).
  removePartialFiles(folder_, kMapFiles);
  removePartialFiles(folder_, kDepthFiles);
  // The mark of a killed run stays where nothing else tells that the folder is a result's.
  if (isReport(folder_ / kReport)) removePartialFiles(folder_, std::array{kReport});
}

bool MapOutput::holdsResult(const std::filesystem::path& folder) {
  return isReport(folder / kReport) ||
         std::filesystem::exists(AtomicFile::temporaryOf(folder / kReport));
}

bool MapOutput::holdsFilesOf(OutputKind kind, const std::filesystem::path& folder) {
  const auto has = [&](std::string_view name) { return std::filesystem::exists(folder / name); };
  if (kind == OutputKind::kMap) {
    return has("keyframes") || std::any_of(kMapFiles.begin(), kMapFiles.end(), has);
  }
  return std::any_of(kDepthFiles.begin(), kDepthFiles.end(), has) ||
         std::any_of(kImages.begin(), kImages.end(), has);
}

/// A map of five keyframes must not show two of an earlier map of seven.
void MapOutput::removeEarlier() {
  if (std::exchange(began_, true)) return;
  const bool replaces_both = holdsResult(folder_);
  std::ofstream(AtomicFile::temporaryOf(folder_ / kReport)) << "{}\n";
  removeFiles(folder_, std::array{kReport});
  if (replaces_both || kind_ == OutputKind::kMap) {
    removeFiles(folder_, kMapFiles);
    removeKeyframes(folder_ / "keyframes");
  }
  if (replaces_both || kind_ == OutputKind::kDepth) {
    removeFiles(folder_, kDepthFiles);
    removeImages(folder_);
  }
}

void MapOutput::writeKeyframe(const KeyframeDepthMap& keyframe) {
  removeEarlier();
  const std::filesystem::path folder =
      folder_ / "keyframes" / formatSeconds(keyframe.window.t_ref_ns);
  makeFolder(folder);
  writeImagesTo(folder, keyframe);
}

void MapOutput::writeImages(const KeyframeDepthMap& keyframe) {
  removeEarlier();
  writeImagesTo(folder_, keyframe);
}

void MapOutput::writeImagesTo(const std::filesystem::path& folder,
                              const KeyframeDepthMap& keyframe) const {
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

void MapOutput::writeMap(const std::filesystem::path& folder, const DepthMap& map) const {
  writeImage(folder / "depth.tiff", map.depth);
  writeImage(folder / "confidence.tiff", map.confidence);
  const bool plain = style_ == PictureStyle::kPlain;
  writeImage(folder / "depth.png", plain ? depthPicture(map.depth, limits_, Palette::kBlueToRed)
                                         : depthFigure(map, limits_));
  if (plain) {
    writeImage(folder / "confidence.png", confidencePicture(map.confidence));
  } else {
    writeImage(folder / "confidence.png", confidenceFigure(map.confidence));
  }
}

void MapOutput::writeTrajectory(const std::string& name, const std::vector<StampedPose>& poses) {
  removeEarlier();
  writeText(folder_ / name, [&](std::ostream& stream) { writeTumTrajectory(stream, poses); });
}

void MapOutput::writeCloud(const std::string& name, const std::vector<CloudPoint>& points) {
  removeEarlier();
  writePcd(folder_ / name, points);
}

void MapOutput::writeColouredCloud(const std::vector<CloudPoint>& points,
                                   const Eigen::Vector3d& upward) {
  removeEarlier();
  writeColouredPly(folder_ / "map.ply", points, coloursByHeight(points, upward));
}

void MapOutput::writeFile(const std::string& name,
                          const std::function<void(const std::filesystem::path&)>& write) {
  removeEarlier();
  writeAtomically(folder_ / name, write);
}

void MapOutput::writePicture(const std::string& name, const cv::Mat3b& picture) {
  removeEarlier();
  writeImage(folder_ / name, picture);
}

void MapOutput::writePage(const std::function<void(std::ostream&)>& write) {
  removeEarlier();
  writeText(folder_ / "map.html", write);
}

void MapOutput::writeReport(const std::string& json) {
  removeEarlier();
  writeText(folder_ / kReport, [&](std::ostream& stream) { stream << json; });
}

}  // namespace efm
