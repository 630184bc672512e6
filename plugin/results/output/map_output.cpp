// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/results/output/map_output.h"

#include <limits>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "event_fusion/engine.h"
#include "mapping/base/atomic_file.h"
#include "mapping/base/picture_file.h"
#include "mapping/geometry/timestamp.h"
#include "maps/io/point_cloud_file.h"
#include "plugin/results/output/result_folder.h"
#include "plugin/results/output/simple_map.h"
#include "plugin/results/pictures/depth_picture.h"
#include "plugin/results/pictures/picture.h"

namespace efm {
namespace {

/// Writes a file. After an error it is not there.
void write(const std::filesystem::path& path,
           const std::function<void(const std::filesystem::path&)>& fill) {
  try {
    fillFile(path, path, fill);
  } catch (...) {
    std::error_code ignored;
    std::filesystem::remove(path, ignored);
    throw;
  }
}

std::filesystem::path cameraFolder(const std::filesystem::path& folder, int camera) {
  const std::filesystem::path own = folder / ("cam" + std::to_string(camera));
  makeFolder(own);
  return own;
}

void writeImage(const std::filesystem::path& path, const cv::Mat& image) {
  const bool png = path.extension() == ".png";
  write(path, byStream([&](std::ostream& file) {
          file << (png ? encodePng(image) : encodeTiff(image));
        }));
}

}  // namespace

void MapOutput::writeKeyframe(const KeyframeDepthMap& keyframe) const {
  const std::filesystem::path folder =
      folder_ / "keyframes" / formatSeconds(keyframe.window.t_ref_ns);
  makeFolder(folder);
  try {
    writeImagesTo(folder, keyframe);
  } catch (...) {
    std::error_code ignored;
    std::filesystem::remove_all(folder, ignored);
    throw;
  }
}

void MapOutput::writeImagesTo(const std::filesystem::path& folder,
                              const KeyframeDepthMap& keyframe) const {
  writeMap(folder, keyframe.map);
  for (const CameraDepthMap& camera : keyframe.camera_maps) {
    writeMap(cameraFolder(folder, camera.camera), camera.map);
  }
  for (const EventImage& image : keyframe.event_images) {
    writeImage(cameraFolder(folder, image.camera) / "events.png", eventPicture(image.counts));
  }
}

void MapOutput::writeMap(const std::filesystem::path& folder, const DepthMap& map) const {
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

void MapOutput::writeTrajectory(const std::string& name,
                                const std::vector<StampedPose>& poses) const {
  writeText(name, [&](std::ostream& file) { writeTumTrajectory(file, poses); });
}

void MapOutput::writeCloud(const std::string& name, const MapCloud& cloud) const {
  writeText(name, [&](std::ostream& file) { writePcdTo(file, cloud); });
}

void MapOutput::writeColouredCloud(const MapCloud& cloud, const Eigen::Vector3d& upward,
                                   const std::vector<StampedPose>& views) const {
  const std::vector<PointColour> colours = coloursByHeight(cloud, upward);
  writeText("map.ply", [&](std::ostream& file) { writePlyTo(file, cloud, colours, views); });
}

void MapOutput::writeSimpleMap(const std::vector<StoredKeyframe>& keyframes) const {
  efm::write(folder_ / "map.simplemap",
             [&](const std::filesystem::path& file) { efm::writeSimpleMap(file, keyframes); });
}

void MapOutput::writePicture(const std::string& name, const cv::Mat3b& picture) const {
  writeImage(folder_ / name, picture);
}

void MapOutput::writeText(const std::string& name,
                          const std::function<void(std::ostream&)>& write) const {
  efm::write(folder_ / name, byStream(write));
}

void writePly(const std::filesystem::path& file, const MapCloud& cloud,
              const std::vector<StampedPose>& views, const Eigen::Vector3d& upward) {
  const std::vector<PointColour> colours = coloursByHeight(cloud, upward);
  writeAtomically(
      file, byStream([&](std::ostream& stream) { writePlyTo(stream, cloud, colours, views); }));
}

}  // namespace efm
