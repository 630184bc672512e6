// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include <filesystem>
#include <vector>

#include "mapping/geometry/trajectory.h"
#include "maps/cloud/map_point.h"
#include "maps/io/point_cloud_file.h"

namespace efm {

/// Writes a picture as PNG. The file appears under its name only when it is complete.
void writePicture(const std::filesystem::path& file, const cv::Mat3b& picture);

/// Joins pictures from left to right on white, with their tops in line.
cv::Mat3b sideBySide(const std::vector<cv::Mat3b>& pictures);
/// Joins pictures from top to bottom on white, each centred.
cv::Mat3b oneBelowAnother(const std::vector<cv::Mat3b>& pictures);

/// Colours of values, from the low end of their range to the high one.
enum class Palette {
  kBlueToRed,  ///< The rainbow "jet".
  /// For depth in print: plasma, whose lightness changes evenly, so that it can be read in grey and
  /// by colour-blind readers. Cut where it is too light for white paper.
  kBrightToDark,
  kWhiteToBlack,
  kRainbow,  ///< For height: turbo without its darkest ends, readable on white.
};

/// @param levels 0: the low end of the range, 255: the high end.
/// @return 8-bit BGR.
cv::Mat3b coloured(const cv::Mat1b& levels, Palette palette);

/// The direction up, estimated from the keyframes' cameras: across their x axes, which lie level in
/// most recordings, and near their mean -y. Within 15 degrees of an axis of the world it is that
/// axis. z where there is no keyframe or the cameras looked in all directions.
/// @param trajectory T_world_ref of the keyframes.
/// @return a unit vector, frame `world`.
Eigen::Vector3d upwardOf(const std::vector<StampedPose>& trajectory);

/// The colours of points by their height: plasma, from dark (low) to bright (high), whose lightness
/// changes evenly. The lowest and the highest hundredth of the points, where outliers are, do not
/// widen its range.
/// @param upward a unit vector, frame `world`.
std::vector<PointColour> coloursByHeight(const MapCloud& cloud, const Eigen::Vector3d& upward);

}  // namespace efm
