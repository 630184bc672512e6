// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include <vector>

#include "mapping/geometry/trajectory.h"
#include "maps/cloud/map_point.h"
#include "plugin/results/pictures/curve_plot.h"

namespace efm {

/// An orthographic view of a map.
struct MapView {
  cv::Rect area;            ///< Pixels of the picture.
  Eigen::Vector3d right;    ///< Unit vector, frame `world`.
  Eigen::Vector3d upwards;  ///< Unit vector across `right`: upwards in the picture.
  Eigen::Vector3d p_world;  ///< Is drawn in the middle of the area.
  double pixels_per_m = 1;

  /// The pixel of a position in the picture; the centre of a pixel has whole coordinates.
  cv::Point2d pixelOf(const Eigen::Vector3d& p_world) const;
};

/// Where the views of a map stand in a picture, all with one scale.
struct MapLayout {
  cv::Size size;  ///< Of the whole picture, pixels.
  MapView top;
  MapView side;
  cv::Rect legend;      ///< Below the views.
  AxisRange heights_m;  ///< Along `side.upwards`: the range of the colours.
};

/// Lays out the top view and the side view of a map, side by side or one above the other and turned
/// around the direction up such that the scale is as large as possible. The views show 98 % of the
/// points along each axis and the whole trajectory: far outliers do not change the scale.
/// @param cloud may be empty.
/// @param trajectory T_world_ref of the keyframes; not empty where there are no points.
MapLayout layOutMap(const MapCloud& cloud, const std::vector<StampedPose>& trajectory);

/// A map from above and from the side, for a paper: the points coloured by height and the denser
/// the more opaque, the trajectory, a scale bar in metres. Up to 1500 pixels wide and high.
/// @param cloud may be empty: then the picture has the trajectory alone.
/// @param trajectory T_world_ref of the keyframes.
/// @param voxel_size_m of the map: points are drawn no smaller than their voxels.
cv::Mat3b drawMap(const MapCloud& cloud, const std::vector<StampedPose>& trajectory,
                  double voxel_size_m);

}  // namespace efm
