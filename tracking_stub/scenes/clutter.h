// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "tracking_stub/scenes/texture.h"

namespace efm {

struct ClutterOptions {
  double width_m = 1;
  double height_m = 1;
  /// Size of a texel: about half of what a pixel sees at the nearest, so that the blur of the
  /// finest texture level is half a pixel.
  double texel_m = 0.002;
  double feature_m = 0.1;  ///< Mean size of a shape, and mean distance of shapes.
  double coverage = 0.5;   ///< Shapes per feature_m x feature_m.
  double contrast = 0.9;   ///< Largest difference in log intensity between a shape and the ground.
  /// The ground's log intensity is drawn from -ground to ground: surfaces differ from each other,
  /// so that silhouettes are seen.
  double ground = 0.6;
  std::uint64_t seed = 0;
};

/// Paints what lies about on a desk: sharp blocks, triangles, polygons and bars of all orientations
/// and many contrasts on an even ground. Seeded. The edges are clear and mostly alone within the
/// reach of a pixel's blur, so that events gather on them.
Texture paintClutter(const ClutterOptions& options);

}  // namespace efm
