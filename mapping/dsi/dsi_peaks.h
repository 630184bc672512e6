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

/// The peak of the fused DSI along every ray of the reference view: four images of its size.
struct DsiPeaks {
  cv::Mat1f confidence;  ///< The largest fused value; 0 where nothing voted.
  cv::Mat1i plane;       ///< Its plane; of equals the nearest.
  cv::Mat1f before;      ///< The value one plane nearer; -1 at the nearest plane.
  cv::Mat1f after;       ///< The value one plane farther; -1 at the farthest plane.
};

/// Images of a view's size, to be written: their pixels have no values yet.
DsiPeaks unwrittenPeaks(const ReferenceView& view);

/// The best value along each ray of a view or of a tile of it, over a group of consecutive planes,
/// taken one by one, and the group's outermost planes: what its neighbours need to complete their
/// peaks. Groups that follow each other join to what one group over all planes would have found,
/// bit for bit.
class RunningPeaks {
 public:
  /// @param kernel an available one; every kernel gives the same bits.
  explicit RunningPeaks(std::size_t pixels, VotingKernel kernel = fastestKernel());

  /// Planes in increasing order, without a gap.
  void take(int plane, const PlaneValues& values);
  /// Takes in the group that follows this one.
  void append(const RunningPeaks& next);

  /// Of pixels that are the whole view.
  DsiPeaks images(const ReferenceView& view) const;
  /// Writes pixels that are a tile of the view, row by row, into its place. Tiles that do not
  /// overlap may be written by several threads at once.
  void writeTo(DsiPeaks& images, const cv::Rect& tile) const;

 private:
  const kernels::PeakFunctions* functions_;
  PlaneValues best_;
  PlaneValues before_;
  PlaneValues after_;
  PixelValues<std::int32_t> plane_;
  int first_plane_ = 0;
  PlaneValues first_;     // the values of the group's first plane
  PlaneValues previous_;  // and of the last one taken
};

}  // namespace efm
