// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "mapping/depth/depth_map.h"
#include "mapping/geometry/reference_view.h"
#include "plugin/results/pictures/picture.h"
#include "plugin/results/pictures/picture_axis.h"

namespace efm {

/// An image of values as colours, with a colour bar.
struct ValuePicture {
  cv::Mat1f values;  ///< NaN: no value.
  AxisRange range;   ///< Range of the colours. A value outside has the colour of the nearer end.
  std::string unit;  ///< Unit that is written at the bar.
  Palette palette = Palette::kBlueToRed;
  int min_width = 320;   ///< Pixels. A smaller image is enlarged by a whole factor.
  cv::Mat1b under = {};  ///< Grey levels for pixels without a value. Empty: white.
};

/// Draws the image. Text and bar are larger in wide pictures, so that they are readable if the
/// picture is as wide as a column of a paper.
cv::Mat3b drawValues(const ValuePicture& picture);

/// Draws only the colour bar, `width` pixels wide: colours, ticks and the unit on white.
cv::Mat3b drawBar(const AxisRange& range, Palette palette, const std::string& unit, int width);

/// Returns the colours of a depth map, linear in inverse depth; pixels without depth (0) are white.
/// `kBlueToRed` is red at the near limit and blue at the far limit.
/// @return 8-bit BGR, of the map's size.
cv::Mat3b depthPicture(const cv::Mat1f& depth_m, const DepthPlanesOptions& limits,
                       Palette palette = Palette::kBlueToRed);

/// Returns a depth map of at most `max_width` pixels. A square block of pixels becomes one pixel
/// with the block's nearest depth, so that thin edges stay.
cv::Mat1f reducedDepth(const cv::Mat1f& depth_m, int max_width);

/// Draws a depth map for a paper: perceptual colours, the confidence in light grey under the
/// depths, a colour bar in metres. The colours reach from the 2nd to the 98th percentile of the
/// depths. Images of small sensors are enlarged by a whole factor.
/// @param planes limits for a map without depths.
cv::Mat3b depthFigure(const DepthMap& map, const DepthPlanesOptions& planes);
/// Draws a confidence map in grey levels in the same layout; the map's maximum is black.
cv::Mat1b confidenceFigure(const cv::Mat1f& confidence);

/// Returns grey levels of a confidence map, inverted as in Ghosh and Gallego 2022: white is 0,
/// black is the map's maximum.
cv::Mat1b confidencePicture(const cv::Mat1f& confidence);

/// Returns the colours of accumulated events: red for more ON events, blue for more OFF events,
/// grey for equal numbers, white without events. The colour is full if the difference is 3 or more.
/// @param counts numbers of OFF and ON events per pixel.
cv::Mat3b eventPicture(const cv::Mat_<cv::Vec2i>& counts);

/// Collects depth maps of keyframes evenly over a run, and draws a sheet of them. Memory is
/// bounded: at most `kMaxKept` small depth maps are kept. If there are more, every second map is
/// removed, and from then on only keyframes of the doubled stride are kept. One thread at a time.
class KeyframeSheet {
 public:
  static constexpr std::size_t kMaxShown = 12;
  static constexpr std::size_t kMaxKept = 2 * kMaxShown;
  static constexpr int kMaxWidth = 360;  ///< Pixels: wider depth maps are reduced.

  /// Adds the next keyframe.
  void add(std::int64_t t_ref_ns, const cv::Mat1f& depth_m);

  /// Draws up to `kMaxShown` depth maps with their times in seconds, and one colour bar in metres.
  /// The colours are those of `depthFigure`, for all depth maps.
  /// @throws std::logic_error if there is no keyframe.
  cv::Mat3b draw(const DepthPlanesOptions& planes) const;

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
