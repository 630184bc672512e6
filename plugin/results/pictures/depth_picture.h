// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "mapping/depth/depth_map.h"
#include "mapping/geometry/reference_view.h"
#include "plugin/results/pictures/curve_plot.h"
#include "plugin/results/pictures/picture.h"

namespace efm {

/// An image of values as colours, with a colour bar.
struct ValuePicture {
  std::string title;  ///< Empty: the picture begins with the image.
  cv::Mat1f values;   ///< NaN: no value.
  AxisRange range;    ///< Of the colours. A value outside has the colour of the nearer end.
  std::string unit;   ///< Written at the bar.
  Palette palette = Palette::kBlueToRed;
  int min_width = 320;   ///< Pixels. A smaller image is enlarged by a whole number.
  cv::Mat1b under = {};  ///< Grey levels where there is no value. Empty: white.
};

/// Text and bar are larger in wide pictures, so that they can be read where the picture is as wide
/// as a column of a paper.
cv::Mat3b drawValues(const ValuePicture& picture);

/// The colour bar alone, `width` pixels wide: colours, ticks and the unit on white.
cv::Mat3b drawBar(const AxisRange& range, Palette palette, const std::string& unit, int width);

/// Colours of a depth map, linear in inverse depth, white without depth (0). `kBlueToRed` is red at
/// the near limit and blue at the far one.
/// @return 8-bit BGR, of the map's size.
cv::Mat3b depthPicture(const cv::Mat1f& depth_m, const DepthPlanesOptions& limits,
                       Palette palette = Palette::kBlueToRed);

/// A depth map of at most `max_width` pixels: joins square blocks of pixels to the nearest depth of
/// each, so that thin edges stay.
cv::Mat1f reducedDepth(const cv::Mat1f& depth_m, int max_width);

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

/// Depth maps of keyframes evenly over a run, and a sheet of them. Memory is bounded: at most
/// `kMaxKept` small depth maps; where these are full, every second one is removed, and from then on
/// only keyframes of the doubled stride are kept. One thread at a time.
class KeyframeSheet {
 public:
  static constexpr std::size_t kMaxShown = 12;
  static constexpr std::size_t kMaxKept = 2 * kMaxShown;
  static constexpr int kMaxWidth = 360;  ///< Pixels: wider depth maps are reduced.

  /// Adds the next keyframe.
  void add(std::int64_t t_ref_ns, const cv::Mat1f& depth_m);

  /// Up to `kMaxShown` depth maps with their times in seconds, and one colour bar in metres.
  /// @param limits the colours run between its depths.
  /// @throws std::logic_error if there is no keyframe.
  cv::Mat3b draw(const DepthPlanesOptions& limits) const;

 private:
  struct Kept {
    std::int64_t t_ref_ns = 0;
    cv::Mat1f depth_m;
  };

  std::vector<Kept> kept_;
  std::size_t keyframes_ = 0;
  std::size_t stride_ = 1;
};

}  // namespace efm
