// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <opencv2/core/types.hpp>
#include <vector>

#include "mapping/depth_planes.h"
#include "mapping/kernels/ray_samples.h"
#include "mapping/reference_view.h"
#include "mapping/space_sweep.h"

namespace efm {

/// A whole fused DSI that is kept to be sampled along rays: two bytes per voxel, values rounded to
/// 1/512 of themselves (bfloat16).
class PriorDsi : public DsiTileSink {
 public:
  PriorDsi(const ReferenceView& view, const DepthPlanes& planes);

  void takeTile(int plane, const cv::Rect& tile, const PlaneValues& values) override;

  int planes() const { return static_cast<int>(inverse_depths_.size()); }
  /// Once all its parts have come.
  kernels::SampledPlane plane(int plane) const;

 private:
  std::size_t indexOf(int plane) const;  // of its first value

  int width_;
  int height_;
  std::vector<float> inverse_depths_;
  std::unique_ptr<std::uint16_t[]> values_;  // [plane][row][column]
};

}  // namespace efm
