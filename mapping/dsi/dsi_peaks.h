// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <opencv2/core.hpp>

#include "mapping/dsi/plane_values.h"
#include "mapping/dsi/voting_kernel.h"
#include "mapping/geometry/reference_view.h"

namespace efm {

namespace kernels {
struct PeakFunctions;
}  // namespace kernels

/// The peak of the DSI in the column of every pixel: images of the view's size. Where whole columns
/// are stored (`DsiColumns`), which have the other values, there is the confidence alone.
struct DsiPeaks {
  cv::Mat1f confidence;  ///< The largest fused value; 0 where nothing voted.
  cv::Mat1i plane;       ///< Its plane; of equals the nearest.
  cv::Mat1f before;      ///< The value one plane nearer; -1 at the nearest plane.
  cv::Mat1f after;       ///< The value one plane farther; -1 at the farthest plane.
};

/// Images of a view's size whose pixels have no values yet. @param confidence_alone the others stay
/// empty.
DsiPeaks unwrittenPeaks(const ReferenceView& view, bool confidence_alone = false);

/// The peak of each pixel of a tile over the planes added so far: the argmax of the DSI (Ghosh and
/// Gallego 2022, Algorithm 1, line 5), and the values one plane before and after it.
class RunningPeaks {
 public:
  /// @param kernel an available one; every kernel gives the same bits.
  explicit RunningPeaks(std::size_t pixels, VotingKernel kernel = fastestKernel());

  /// Planes in increasing order, without a gap.
  void add(int plane, const PlaneValues& values);
  /// Writes the tile, row by row, to its position in the images that are not empty. Several threads
  /// may write tiles that do not overlap.
  void writeTo(DsiPeaks& images, const cv::Rect& tile) const;

 private:
  const kernels::PeakFunctions* functions_;
  PlaneValues best_;
  PlaneValues before_;
  PlaneValues after_;
  PixelValues<std::int32_t> plane_;
  PlaneValues previous_;  // the plane added last
};

}  // namespace efm
