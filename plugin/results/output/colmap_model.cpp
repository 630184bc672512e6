// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/results/output/colmap_model.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <stdexcept>
#include <unordered_map>
#include <utility>

#include "mapping/base/atomic_file.h"
#include "mapping/base/picture_file.h"
#include "mapping/geometry/timestamp.h"
#include "maps/io/point_cloud_file.h"
#include "plugin/results/pictures/depth_picture.h"

namespace efm {
namespace {

namespace fs = std::filesystem;

/// COLMAP counts pixels from the corner of the first pixel, this project from its middle.
constexpr double kCorner = 0.5;

void write(const fs::path& path, const std::function<void(std::ostream&)>& fill) {
  fillFile(path, path, byStream(fill));
}

std::string nameOf(std::size_t image) { return fmt::format("{:06}.png", image); }

bool isSame(const ReferenceView& a, const ReferenceView& b) {
  return a.width == b.width && a.height == b.height && a.fx == b.fx && a.fy == b.fy &&
         a.cx == b.cx && a.cy == b.cy;
}

struct VoxelHash {
  std::size_t operator()(const std::array<std::int64_t, 3>& voxel) const {
    std::uint64_t hash = 0;
    for (const std::int64_t index : voxel) {
      hash = (hash ^ static_cast<std::uint64_t>(index)) * 0x9E3779B97F4A7C15U;
      hash ^= hash >> 32U;
    }
    return hash;
  }
};

std::array<std::int64_t, 3> voxelOf(const Eigen::Vector3d& p_world, double voxel_size_m) {
  std::array<std::int64_t, 3> voxel{};
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    voxel[static_cast<std::size_t>(axis)] =
        static_cast<std::int64_t>(std::floor(p_world[axis] / voxel_size_m));
  }
  return voxel;
}

}  // namespace

/// The pixels of a point: one of each image that shows it, by their indices.
struct ColmapModel::Track {
  std::vector<std::pair<std::size_t, std::size_t>> pixels;
  double error_px = 0;                          ///< Sum.
  Eigen::Array3d rgb = Eigen::Array3d::Zero();  ///< Sum.

  PointColour colour() const {
    if (pixels.empty()) return {128, 128, 128};
    const Eigen::Array3d mean = rgb / static_cast<double>(pixels.size());
    return {static_cast<std::uint8_t>(mean[0]), static_cast<std::uint8_t>(mean[1]),
            static_cast<std::uint8_t>(mean[2])};
  }
  double meanErrorPx() const {
    return pixels.empty() ? -1 : error_px / static_cast<double>(pixels.size());
  }
};

ColmapModel::ColmapModel(fs::path folder) : folder_(std::move(folder)) {
  fs::create_directories(folder_ / "images");
  fs::create_directories(folder_ / "sparse" / "0");
}

void ColmapModel::add(const KeyframeDepthMap& keyframe, const std::vector<ViewPoint>& points) {
  if (keyframe.view_events.empty()) {
    throw std::runtime_error(
        "keyframe " + formatSeconds(keyframe.window.t_ref_ns) +
        " has no events for a picture: expected the session of a `map`, with pictures");
  }
  const auto known = std::find_if(cameras_.begin(), cameras_.end(), [&](const ReferenceView& view) {
    return isSame(view, keyframe.view);
  });
  Image image{{keyframe.window.t_ref_ns, keyframe.T_world_ref},
              static_cast<std::size_t>(known - cameras_.begin()),
              {}};
  if (known == cameras_.end()) cameras_.push_back(keyframe.view);
  const cv::Mat3b picture = eventPicture(keyframe.view_events);
  for (const ViewPoint& point : points) {
    const Eigen::Vector2d at = keyframe.view.project(point.p_ref.cast<double>());
    image.pixels.push_back({at.cast<float>(), point.p_ref,
                            picture(std::clamp(cvRound(at.y()), 0, picture.rows - 1),
                                    std::clamp(cvRound(at.x()), 0, picture.cols - 1))});
  }
  write(folder_ / "images" / nameOf(images_.size()),
        [&](std::ostream& stream) { stream << encodePng(picture); });
  images_.push_back(std::move(image));
}

std::vector<ColmapModel::Track> ColmapModel::tracksOf(const MapCloud& cloud,
                                                      double voxel_size_m) const {
  std::unordered_map<std::array<std::int64_t, 3>, std::size_t, VoxelHash> points;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    points.emplace(voxelOf(positionIn(cloud, cloud[i]), voxel_size_m), i);
  }
  std::vector<Track> tracks(cloud.size());
  for (std::size_t i = 0; i < images_.size(); ++i) {
    const Image& image = images_[i];
    const Rigid3& T_world_ref = image.T_world_ref.T_world_rig;
    const Rigid3 T_ref_world = T_world_ref.inverse();
    std::map<std::size_t, std::pair<double, std::size_t>> nearest;  // error and pixel, by point
    for (std::size_t k = 0; k < image.pixels.size(); ++k) {
      const Pixel& pixel = image.pixels[k];
      const auto point =
          points.find(voxelOf(T_world_ref * pixel.p_ref.cast<double>(), voxel_size_m));
      if (point == points.end()) continue;
      const Eigen::Vector3d p_ref = T_ref_world * positionIn(cloud, cloud[point->second]);
      const double error_px =
          (cameras_[image.camera].project(p_ref) - pixel.at.cast<double>()).norm();
      const auto [kept, is_new] = nearest.try_emplace(point->second, error_px, k);
      if (!is_new && error_px < kept->second.first) kept->second = {error_px, k};
    }
    for (const auto& [point, of] : nearest) {
      const cv::Vec3b& bgr = image.pixels[of.second].bgr;
      tracks[point].pixels.emplace_back(i, of.second);
      tracks[point].error_px += of.first;
      tracks[point].rgb += Eigen::Array3d(bgr[2], bgr[1], bgr[0]);
    }
  }
  return tracks;
}

void ColmapModel::finish(const MapCloud& cloud, double voxel_size_m,
                         const std::set<std::size_t>& left_out) {
  for (const std::size_t i : left_out) {
    images_[i].is_left_out = true;
    images_[i].pixels.clear();
    fs::remove(folder_ / "images" / nameOf(i));
  }
  const fs::path sparse = folder_ / "sparse" / "0";
  write(sparse / "cameras.txt", [&](std::ostream& stream) {
    stream << "# CAMERA_ID MODEL WIDTH HEIGHT FX FY CX CY\n";
    for (std::size_t i = 0; i < cameras_.size(); ++i) {
      const ReferenceView& view = cameras_[i];
      stream << fmt::format("{} PINHOLE {} {} {} {} {} {}\n", i + 1, view.width, view.height,
                            view.fx, view.fy, view.cx + kCorner, view.cy + kCorner);
    }
  });

  const std::vector<Track> tracks = tracksOf(cloud, voxel_size_m);
  std::vector<std::vector<std::pair<std::size_t, std::size_t>>> seen(images_.size());
  std::vector<PointColour> colours;
  write(sparse / "points3D.txt", [&](std::ostream& stream) {
    stream << "# POINT3D_ID X Y Z R G B ERROR (IMAGE_ID POINT2D_IDX)...\n";
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      const Track& track = tracks[i];
      const Eigen::Vector3d p_world = positionIn(cloud, cloud[i]);
      const PointColour& rgb = colours.emplace_back(track.colour());
      stream << fmt::format("{} {} {} {} {} {} {} {:.4f}", i + 1, p_world.x(), p_world.y(),
                            p_world.z(), rgb[0], rgb[1], rgb[2], track.meanErrorPx());
      for (const auto& [image, pixel] : track.pixels) {
        stream << fmt::format(" {} {}", image + 1, seen[image].size());
        seen[image].emplace_back(i, pixel);
      }
      stream << '\n';
    }
  });
  write(sparse / "images.txt", [&](std::ostream& stream) {
    stream << "# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME\n# (X Y POINT3D_ID)...\n";
    for (std::size_t i = 0; i < images_.size(); ++i) {
      if (images_[i].is_left_out) continue;
      const Rigid3 T_ref_world = images_[i].T_world_ref.T_world_rig.inverse();
      const Eigen::Quaterniond& q = T_ref_world.rotation;
      const Eigen::Vector3d& t = T_ref_world.translation;
      stream << fmt::format("{} {} {} {} {} {} {} {} {} {}\n", i + 1, q.w(), q.x(), q.y(), q.z(),
                            t.x(), t.y(), t.z(), images_[i].camera + 1, nameOf(i));
      for (const auto& [point, pixel] : seen[i]) {
        const Eigen::Vector2f& at = images_[i].pixels[pixel].at;
        stream << fmt::format("{:.2f} {:.2f} {} ", at.x() + kCorner, at.y() + kCorner, point + 1);
      }
      stream << '\n';
    }
  });
  std::vector<StampedPose> views;
  for (const Image& image : images_) views.push_back(image.T_world_ref);
  write(sparse / "points3D.ply",
        [&](std::ostream& stream) { writePlyTo(stream, cloud, colours, views); });
  writeTransforms();
}

void ColmapModel::writeTransforms() const {
  nlohmann::ordered_json all = {{"camera_model", "OPENCV"},
                                {"ply_file_path", "sparse/0/points3D.ply"}};
  for (std::size_t i = 0; i < images_.size(); ++i) {
    if (images_[i].is_left_out) continue;
    const ReferenceView& view = cameras_[images_[i].camera];
    const Rigid3& T_world_ref = images_[i].T_world_ref.T_world_rig;
    Eigen::Matrix4d pose = Eigen::Matrix4d::Identity();
    pose.topLeftCorner<3, 3>() = T_world_ref.rotation.toRotationMatrix();
    pose.topRightCorner<3, 1>() = T_world_ref.translation;
    pose.middleCols<2>(1) *= -1;  // the axes of OpenGL: y up, z backward
    nlohmann::ordered_json frame = {{"file_path", "images/" + nameOf(i)},
                                    {"fl_x", view.fx},
                                    {"fl_y", view.fy},
                                    {"cx", view.cx + kCorner},
                                    {"cy", view.cy + kCorner},
                                    {"w", view.width},
                                    {"h", view.height}};
    for (const auto& row : pose.rowwise()) {
      frame["transform_matrix"].push_back(std::vector<double>(row.begin(), row.end()));
    }
    all["frames"].push_back(std::move(frame));
  }
  write(folder_ / "transforms.json", [&](std::ostream& stream) { stream << all.dump(1) << '\n'; });
}

}  // namespace efm
