// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>
#include <Eigen/Core>

#include <cmath>
#include <vector>

#include "mapping/sweep/space_sweep.h"
#include "mapping/sweep/tiles.h"
#include "test/mapping/dsi/chosen_dsi.h"

namespace efm::test {

/// Three tiles by three, the last of which ends at the view's border.
inline const ReferenceView kTiledView{150, 130, 100, 100, 75, 65};

/// One pixel in the unit of a tile's rays.
inline constexpr float kTileUnit = 1 << kernels::kFractionBits;

/// Returns a tile's rays that meet every plane at the given points of the view (pixels).
inline TileRays raysAt(const std::vector<Eigen::Vector2d>& points, const cv::Point& origin) {
  TileRays rays;
  rays.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    rays.view().x[i] = static_cast<float>(points[i].x() - origin.x) * kTileUnit;
    rays.view().y[i] = static_cast<float>(points[i].y() - origin.y) * kTileUnit;
    rays.view().dx[i] = rays.view().dy[i] = 0;
  }
  rays.resize(points.size());
  rays.pad();
  return rays;
}

/// The input and the options of a sweep.
struct SweepCase {
  ReferenceView view;
  DepthPlanes planes;
  std::vector<CameraRays> cameras;
  FusionOptions fusion = {FusionRule::kArithmetic, FusionRule::kArithmetic,
                          FusionOrder::kCamerasThenTime};
  int groups = 1;
  bool camera_peaks = true;
  int column_window = 0;
};

struct SweepOutput {
  std::vector<float> dsi;
  SweepResult result;
};

inline SweepOutput sweep(const SweepCase& input, VotingKernel kernel, int threads = 1) {
  SpaceSweepOptions options;
  options.fusion = input.fusion;
  options.kernel = kernel;
  options.threads = threads;
  WholeDsi dsi(input.planes, input.view);
  SweepResult result = sweepSpace(input.cameras, {input.view, input.planes}, options,
                                  {input.camera_peaks, &dsi, input.groups, input.column_window});
  EXPECT_TRUE(dsi.isComplete());
  return {dsi.values, std::move(result)};
}

/// The difference of a DSI from a reference.
struct DsiDifference {
  double mass = 0;          ///< Sum of the reference.
  double error_sum = 0;     ///< Sum of absolute differences.
  double error = 0;         ///< error_sum / mass.
  double signed_error = 0;  ///< Difference of the sums / mass.
};

template <typename Reference>
DsiDifference differenceOf(const std::vector<float>& values, const std::vector<Reference>& exact) {
  DsiDifference difference;
  EXPECT_EQ(values.size(), exact.size());
  double sum = 0;
  for (std::size_t i = 0; i < exact.size(); ++i) {
    const double off = double{values[i]} - double{exact[i]};
    difference.mass += double{exact[i]};
    difference.error_sum += std::abs(off);
    sum += off;
  }
  if (difference.mass > 0) {
    difference.error = difference.error_sum / difference.mass;
    difference.signed_error = sum / difference.mass;
  }
  return difference;
}

}  // namespace efm::test
