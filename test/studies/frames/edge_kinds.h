// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>

namespace efm::studies {

/// The gradient of an image under a Gaussian blur, in grey values per pixel.
struct ImageGradient {
  cv::Mat1f x, y, magnitude;
};
ImageGradient imageGradient(const cv::Mat1f& grey, double blur_px);

enum class EdgeKind : std::uint8_t {
  kNone,        ///< No edge.
  kHorizontal,  ///< The grey values' gradient is within 15 degrees of vertical.
  kVertical,    ///< The gradient is within 30 degrees of horizontal.
  kOblique,     ///< Another edge.
};

struct EdgeKindOptions {
  double blur_px = 1.0;        ///< Standard deviation of the Gaussian blur.
  double min_gradient = 1.5;   ///< Min gradient of an edge, grey values per pixel.
  double line_gradient = 3.0;  ///< Min gradient at the start of a line of edge pixels.
  double horizontal_deg = 15;  ///< See EdgeKind.
  double vertical_deg = 30;

  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

/// The edges of an image and their directions.
struct EdgeKinds {
  cv::Mat1b kinds;  ///< EdgeKind of every pixel.
  /// Thin lines of edge pixels (Canny): 255 at pixels of the kind, else 0.
  cv::Mat1b horizontal_lines;
  cv::Mat1b vertical_lines;

  /// The kind of the strongest edge within a pixel of (x, y).
  EdgeKind kindNear(int x, int y) const;

 private:
  friend EdgeKinds edgeKinds(const cv::Mat1f& grey, const EdgeKindOptions& options);
  cv::Mat1f magnitude_;
};

/// @param grey any scale; the thresholds have its unit.
/// @throws std::invalid_argument where the options are not valid.
EdgeKinds edgeKinds(const cv::Mat1f& grey, const EdgeKindOptions& options = {});

}  // namespace efm::studies
