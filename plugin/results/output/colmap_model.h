// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include <cstddef>
#include <filesystem>
#include <set>
#include <vector>

#include "mapping/geometry/reference_view.h"
#include "mapping/geometry/trajectory.h"
#include "mapping/keyframes/keyframe_depth_map.h"
#include "maps/cloud/map_point.h"

namespace efm {

/// A map as COLMAP's sparse model, with pictures of the keyframes' events: what programs for
/// Gaussian splatting and NeRF start from.
///
///     images/000000.png, …     the reference camera's events near t_ref, without distortion
///     sparse/0/cameras.txt     the views, PINHOLE
///     sparse/0/images.txt      the keyframes: poses, and the pixels of each point
///     sparse/0/points3D.txt    the map: mean colour of its pixels, their mean error, its track
///     sparse/0/points3D.ply    the same points with colours and normals
///     transforms.json          cameras and poses for nerfstudio and instant-ngp
class ColmapModel {
 public:
  /// @param folder exists, and is empty.
  explicit ColmapModel(std::filesystem::path folder);

  /// Writes the picture of the next keyframe.
  /// @param points of the keyframe, frame `ref`.
  /// @throws std::runtime_error if the keyframe has no events, or a file cannot be written.
  void add(const KeyframeDepthMap& keyframe, const std::vector<ViewPoint>& points);
  /// Writes the other files. A pixel belongs to the point of its voxel.
  /// @param left_out keyframes whose points are not in the map: their pictures are removed.
  /// @throws std::runtime_error naming a file that cannot be written.
  void finish(const MapCloud& cloud, double voxel_size_m, const std::set<std::size_t>& left_out);

 private:
  struct Pixel {
    Eigen::Vector2f at;  ///< The middle of the first pixel is (0, 0).
    Eigen::Vector3f p_ref;
    cv::Vec3b bgr;
  };
  struct Image {
    StampedPose T_world_ref;
    std::size_t camera;
    std::vector<Pixel> pixels;
    bool is_left_out = false;
  };
  struct Track;

  std::vector<Track> tracksOf(const MapCloud& cloud, double voxel_size_m) const;
  void writeTransforms() const;

  std::filesystem::path folder_;
  std::vector<ReferenceView> cameras_;
  std::vector<Image> images_;
};

}  // namespace efm
