// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include <vector>

#include "mapping/geometry/trajectory.h"
#include "maps/cloud/map_point.h"
#include "maps/io/point_cloud_file.h"

namespace efm {

/// Joins pictures from left to right on white, with their tops in line.
cv::Mat3b sideBySide(const std::vector<cv::Mat3b>& pictures);
/// Joins pictures from top to bottom on white, each centred.
cv::Mat3b oneBelowAnother(const std::vector<cv::Mat3b>& pictures);

/// Colours of values, from the low end of their range to the high end.
enum class Palette {
  kBlueToRed,  ///< The rainbow "jet".
  /// Plasma, for depth in print. Its lightness changes evenly, so it is readable in grey and by
  /// colour-blind readers. The part that is too light for white paper is cut off.
  kBrightToDark,
  kWhiteToBlack,
  kRainbow,  ///< Turbo without its darkest ends, for height; readable on white.
};

/// Returns the colours of levels. @param levels 0: low end of the range, 255: high end.
/// @return 8-bit BGR.
cv::Mat3b coloured(const cv::Mat1b& levels, Palette palette);

/// Estimates the direction up from the keyframes' cameras: orthogonal to their x axes, which are
/// level in most recordings, and near their mean -y. An axis of the world within 15 degrees is used
/// instead. Returns z if there is no keyframe or the cameras looked in all directions.
/// @param trajectory T_world_ref of the keyframes.
/// @return a unit vector, frame `world`.
Eigen::Vector3d upwardOf(const std::vector<StampedPose>& trajectory);

/// Returns the colours of points by their height: plasma, from dark (low) to bright (high), whose
/// lightness changes evenly. The lowest and the highest percent of the points, which may be
/// outliers, do not widen the range.
/// @param upward a unit vector, frame `world`.
std::vector<PointColour> coloursByHeight(const MapCloud& cloud, const Eigen::Vector3d& upward);

}  // namespace efm
