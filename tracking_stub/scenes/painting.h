// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "tracking_stub/scenes/scene.h"

namespace efm {

struct PaintingOptions {
  std::uint64_t seed = 0;
  double focal_px = 226;   ///< Of the sharpest camera that will look: a pixel sees depth / focal.
  double coverage = 0.28;  ///< Of clutter: shapes per feature x feature.
  /// No texel is smaller, metres: large surfaces stay affordable, at the price of softer edges
  /// where they are seen from nearer than 2 x texel x focal.
  double min_texel_m = 0;
};

/// Paints a scene's surfaces one after the other, each its own way: the n-th surface painted looks
/// the same for the same seed. The painters that it hands out must not outlive it.
class Painting {
 public:
  explicit Painting(const PaintingOptions& options)
      : options_(options), seed_(options.seed * 1000) {}

  /// Clutter, see there.
  /// @param nearest_m the nearest that the surface is seen from: makes the texel.
  /// @param feature_m size of the shapes on it.
  Scene::Painter clutter(double nearest_m, double feature_m, double contrast = 0.9);

  /// Rings around a pole: bands across its length, in two tones. All of its facets look the same.
  /// @param tone log intensity of the first band; the second is darker by `contrast`.
  Scene::Painter rings(double nearest_m, double band_m, float tone, float contrast) const;

 private:
  double texelFor(double nearest_m) const;

  PaintingOptions options_;
  std::uint64_t seed_;
};

}  // namespace efm
