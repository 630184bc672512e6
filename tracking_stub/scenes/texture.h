// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <vector>

namespace efm {

/// Log intensity painted on a plane, sampled without aliasing: a pyramid of Gaussian blurs with
/// trilinear interpolation. The blur models lens and pixel. It acts on log intensity: the position
/// of an edge does not depend on the intensities of its two sides.
class Texture {
 public:
  /// @param log_intensity the painting; texel (i, j) covers [i, i+1) x [j, j+1) times `texel_m`.
  Texture(const cv::Mat1f& log_intensity, double texel_m);

  /// Log intensity at (u, v) metres from the painting's corner, under a Gaussian blur of standard
  /// deviation `sigma_m` (at least one texel). The border is repeated outside of the painting.
  float sample(double u_m, double v_m, double sigma_m) const;

 private:
  struct Level {
    cv::Mat1f image;  // continuous; blurred with a standard deviation of one of its texels
    float texels_per_m = 0;
  };
  static float sampleLevel(const Level& level, double u_m, double v_m);

  std::vector<Level> levels_;
};

}  // namespace efm
