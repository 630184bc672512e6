// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include "mapping/depth/depth_map.h"
#include "mapping/geometry/reference_view.h"
#include "plugin/results/pictures/palette.h"
#include "plugin/results/pictures/plot_axis.h"

namespace efm {

/// Colours of a depth map, linear in inverse depth, white without depth (0). `kBlueToRed` is red at
/// the near limit and blue at the far one.
/// @return 8-bit BGR, of the map's size.
cv::Mat3b depthPicture(const cv::Mat1f& depth_m, const DepthPlanesOptions& limits,
                       Palette palette = Palette::kBlueToRed);

/// A depth map of at most `max_width` pixels: joins square blocks of pixels to the nearest depth of
/// each, so that thin edges stay.
cv::Mat1f reducedDepth(const cv::Mat1f& depth_m, int max_width);

/// The axis of depths between two limits: linear in inverse depth.
AxisRange depthAxis(const DepthPlanesOptions& limits);

/// A depth map for a paper: perceptual colours, the confidence in light grey under the depths, a
/// colour bar in metres. Images of small sensors are enlarged by a whole factor.
cv::Mat3b depthFigure(const DepthMap& map, const DepthPlanesOptions& limits);
/// A confidence map in the same layout, black at the map's maximum, grey.
cv::Mat1b confidenceFigure(const cv::Mat1f& confidence);

/// Grey levels of a confidence map, negated as in Ghosh and Gallego 2022: white is 0, black is the
/// map's maximum.
cv::Mat1b confidencePicture(const cv::Mat1f& confidence);

/// Colours of accumulated events: red if ON events are the majority, blue if OFF events are, grey
/// if both are equal, white without events. The colour is full from a majority of 3.
/// @param counts per pixel: OFF, ON.
cv::Mat3b eventPicture(const cv::Mat_<cv::Vec2i>& counts);

}  // namespace efm
