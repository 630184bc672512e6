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
  kOblique,     ///< An edge, but neither.
};

struct EdgeKindOptions {
  double blur_px = 1.0;        ///< Standard deviation of the Gaussian whose gradient is taken.
  double min_gradient = 1.5;   ///< Grey values per pixel from which on a pixel is near an edge.
  double line_gradient = 3.0;  ///< The same for a line of edge pixels to begin.
  double horizontal_deg = 15;  ///< See EdgeKind.
  double vertical_deg = 30;

  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

/// Where an image has edges, and how they run.
struct EdgeKinds {
  cv::Mat1b kinds;  ///< EdgeKind of every pixel.
  /// The thin lines among them (Canny): 255 at edge pixels of the kind, else 0.
  cv::Mat1b horizontal_lines;
  cv::Mat1b vertical_lines;

  /// The kind of the strongest edge within a pixel of (x, y).
  EdgeKind kindNear(int x, int y) const;

 private:
  friend EdgeKinds edgeKinds(const cv::Mat1f& grey, const EdgeKindOptions& options);
  cv::Mat1f magnitude_;
};

/// @param grey of any scale; the thresholds are in its units.
/// @throws std::invalid_argument where the options are not valid.
EdgeKinds edgeKinds(const cv::Mat1f& grey, const EdgeKindOptions& options = {});

}  // namespace efm::studies
