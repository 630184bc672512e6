// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/scenes/furnishing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace efm {
namespace {

TEST(Clutter, HasEdgesOfAllOrientations) {
  ClutterOptions options;
  options.width_m = options.height_m = 2;
  const Texture texture = paintClutter(options);
  // Sum of gradients by direction, in bins of 22.5 degrees.
  std::array<double, 8> strength{};
  constexpr double kStep = 0.004;
  for (double v = kStep; v < 2; v += kStep) {
    for (double u = kStep; u < 2; u += kStep) {
      const double here = texture.sample(u, v, 0.002);
      const double gu = texture.sample(u + kStep, v, 0.002) - here;
      const double gv = texture.sample(u, v + kStep, 0.002) - here;
      if (std::hypot(gu, gv) < 0.1) continue;
      const double half_turns = std::fmod(std::atan2(gv, gu) + M_PI, M_PI) / M_PI;
      strength[std::min<std::size_t>(7, static_cast<std::size_t>(half_turns * 8))] +=
          std::hypot(gu, gv);
    }
  }
  const auto [weakest, strongest] = std::minmax_element(strength.begin(), strength.end());
  EXPECT_GT(*weakest, 0.25 * *strongest);
}

}  // namespace
}  // namespace efm
