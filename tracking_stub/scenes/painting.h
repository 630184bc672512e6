// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "tracking_stub/scenes/scene.h"

namespace efm {

struct PaintingOptions {
  std::uint64_t seed = 0;
  double focal_px = 226;   ///< Longest focal length of the cameras: a pixel covers depth / focal.
  double coverage = 0.28;  ///< Of clutter: shapes per feature x feature.
  /// Min size of a texel, metres. It limits the memory of large surfaces. Edges are softer where
  /// the distance is below 2 x texel x focal.
  double min_texel_m = 0;
};

/// Paints the surfaces of a scene, each with its own seed: the n-th surface depends on n and the
/// seed only. The painters that it returns must not outlive it.
class Painting {
 public:
  explicit Painting(const PaintingOptions& options)
      : options_(options), seed_(options.seed * 1000) {}

  /// Paints clutter (see clutter.h).
  /// @param nearest_m the shortest distance to a camera. It sets the texel.
  /// @param feature_m size of the shapes.
  Scene::Painter clutter(double nearest_m, double feature_m, double contrast = 0.9);

  /// Paints rings around a pole, in two tones. All facets are equal.
  /// @param tone log intensity of the first ring; the second is darker by `contrast`.
  Scene::Painter rings(double nearest_m, double band_m, float tone, float contrast) const;

 private:
  double texelFor(double nearest_m) const;

  PaintingOptions options_;
  std::uint64_t seed_;
};

}  // namespace efm
