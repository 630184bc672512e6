// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include <vector>

#include "mapping/geometry/trajectory.h"
#include "maps/cloud/map_point.h"
#include "plugin/results/pictures/picture_axis.h"

namespace efm {

/// An orthographic view of a map.
struct MapView {
  cv::Rect area;            ///< Pixels of the picture.
  Eigen::Vector3d right;    ///< Unit vector, frame `world`.
  Eigen::Vector3d upwards;  ///< Unit vector orthogonal to `right`: upwards in the picture.
  Eigen::Vector3d p_world;  ///< The position in the middle of the area.
  double pixels_per_m = 1;

  /// Returns the pixel of a position; the centre of a pixel has whole coordinates.
  cv::Point2d pixelOf(const Eigen::Vector3d& p_world) const;
};

/// The places of a map's views in a picture. All views have the same scale.
struct MapLayout {
  cv::Size size;  ///< Size of the whole picture, pixels.
  MapView top;
  MapView side;
  cv::Rect legend;      ///< Place of the legend, below the views.
  AxisRange heights_m;  ///< The range of the colours, along `side.upwards`.
};

/// Lays out the top view and the side view of a map, side by side or one above the other. The map
/// is turned around the vertical so that the scale is as large as possible. The views show at least
/// 98 % of the points along each axis and the whole trajectory, so far outliers do not change the
/// scale. A trajectory far from the points is left out where a view would be mostly empty.
/// @param cloud may be empty.
/// @param trajectory T_world_ref of the keyframes; not empty if there are no points.
MapLayout layOutMap(const MapCloud& cloud, const std::vector<StampedPose>& trajectory);

/// Draws a map from above and from the side, for a paper: points, trajectory and a scale bar in
/// metres. Points are coloured by height; dense points are more opaque. At most 1500 x 1500 pixels.
/// @param cloud may be empty: then the picture shows only the trajectory.
/// @param trajectory T_world_ref of the keyframes.
/// @param voxel_size_m voxel size of the map. Points are drawn as large as their voxels or larger.
cv::Mat3b drawMap(const MapCloud& cloud, const std::vector<StampedPose>& trajectory,
                  double voxel_size_m);

}  // namespace efm
