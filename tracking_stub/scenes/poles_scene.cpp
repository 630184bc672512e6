// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/scenes/poles_scene.h"

#include <Eigen/Geometry>

#include "mapping/base/named_choice.h"
#include "tracking_stub/random/random_numbers.h"
#include "tracking_stub/scenes/furnishing.h"
#include "tracking_stub/scenes/painting.h"

namespace efm {

Scene makePoles(const PolesOptions& options) {
  using Eigen::Vector3d;
  requireOption(options.nearest_m > 0, "nearest_m", options.nearest_m, "above 0");
  requireOption(options.farthest_m > options.nearest_m, "farthest_m", options.farthest_m,
                "above nearest_m");
  requireOption(options.wall_m > options.farthest_m, "wall_m", options.wall_m, "above farthest_m");
  Painting painting(PaintingOptions{options.seed, options.focal_px});
  RandomNumbers random(options.seed, 1);
  Scene scene;
  const double half_wall = 1.6 * options.half_view * options.wall_m + 0.5;
  addPanels(scene,
            {{-half_wall, options.wall_m, -half_wall},
             Vector3d::UnitX(),
             Vector3d::UnitZ(),
             2 * half_wall,
             2 * half_wall},
            1.5, painting.clutter(options.wall_m - 0.3, 0.1 * options.wall_m));
  for (int i = 0; i < options.poles; ++i) {
    // Even in inverse depth. Neighbours in depth are far apart to the side, so that no pole hides
    // another.
    const double fraction = (i + random.uniform(0.2, 0.8)) / options.poles;
    const double depth = 1 / ((1 - fraction) / options.nearest_m + fraction / options.farthest_m);
    const double side = (i * 5 % options.poles + random.uniform(0.2, 0.8)) / options.poles;
    Rigid3 T_world_pole;
    T_world_pole.translation = {(2 * side - 1) * 0.9 * options.half_view * depth, depth, 0};
    // The pole leans to the side: its depth is constant.
    T_world_pole.rotation = Eigen::AngleAxisd(random.uniform(-0.45, 0.45), Vector3d::UnitY());
    // 3 to 6 pixels wide.
    const double radius = random.uniform(1.5, 3) * depth / options.focal_px;
    const auto tone =
        static_cast<float>(i % 2 == 0 ? random.uniform(0.9, 1.3) : random.uniform(-1.3, -0.9));
    scene.addPole({T_world_pole, radius, 2.6 * options.half_view * depth},
                  painting.rings(depth, 0.12 * depth, tone, i % 2 == 0 ? 0.5F : -0.5F));
  }
  return scene;
}

}  // namespace efm
