// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/scenes/painting.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "tracking_stub/scenes/clutter.h"

namespace efm {

double Painting::texelFor(double nearest_m) const {
  return std::max(0.5 * nearest_m / options_.focal_px, options_.min_texel_m);
}

Scene::Painter Painting::clutter(double nearest_m, double feature_m, double contrast) {
  return [this, nearest_m, feature_m, contrast](double width_m, double height_m) {
    ClutterOptions options;
    options.width_m = width_m;
    options.height_m = height_m;
    options.texel_m = texelFor(nearest_m);
    options.feature_m = feature_m;
    options.coverage = options_.coverage;
    options.contrast = contrast;
    options.seed = seed_++;
    return paintClutter(options);
  };
}

Scene::Painter Painting::rings(double nearest_m, double band_m, float tone, float contrast) const {
  const double texel_m = texelFor(nearest_m);
  return [texel_m, band_m, tone, contrast](double width_m, double height_m) {
    const auto texels = [texel_m](double length_m) {
      return std::max(4, static_cast<int>(std::ceil(length_m / texel_m)));
    };
    cv::Mat1f painting(texels(height_m), texels(width_m));
    for (int row = 0; row < painting.rows; ++row) {
      const bool second = static_cast<int>((row + 0.5) * texel_m / band_m) % 2 == 1;
      painting.row(row) = second ? tone - contrast : tone;
    }
    return Texture(painting, texel_m);
  };
}

}  // namespace efm
