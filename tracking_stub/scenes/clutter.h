// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "tracking_stub/scenes/texture.h"

namespace efm {

struct ClutterOptions {
  double width_m = 1;
  double height_m = 1;
  /// Size of a texel. About half a pixel at the shortest distance: then the blur of the finest
  /// texture level is half a pixel.
  double texel_m = 0.002;
  double feature_m = 0.1;  ///< Mean size of a shape, and mean distance of shapes.
  double coverage = 0.5;   ///< Shapes per feature_m x feature_m.
  double contrast = 0.9;   ///< Max difference in log intensity between a shape and the ground.
  /// The ground's log intensity is random, from -ground to ground: surfaces differ, so silhouettes
  /// are visible.
  double ground = 0.6;
  std::uint64_t seed = 0;
};

/// Paints clutter: sharp blocks, triangles, polygons and bars of all orientations and many
/// contrasts on an even ground. Most edges are farther apart than the blur of a pixel, so events
/// gather on them.
Texture paintClutter(const ClutterOptions& options);

}  // namespace efm
