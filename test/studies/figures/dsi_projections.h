// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mutex>
#include <opencv2/core.hpp>

#include "mapping/geometry/reference_view.h"
#include "mapping/sweep/space_sweep.h"

namespace efm::studies {

/// The max values of a DSI along each of its three axes (Ghosh and Gallego 2022, Fig. 2): the views
/// from the front, from above and from the side. Plane 0, the nearest, is the lowest row of the
/// view from above and the first column of the view from the side.
class DsiProjections : public DsiSink {
 public:
  DsiProjections(const DepthPlanes& planes, const ReferenceView& view);

  void addPlane(int plane, const float* values) override;

  /// The three views in one picture: front in the upper left, top below it, side to its right. Blue
  /// is 0, yellow is the max.
  cv::Mat3b picture() const;

 private:
  std::mutex mutex_;
  cv::Mat1f front_;
  cv::Mat1f top_;
  cv::Mat1f side_;
};

}  // namespace efm::studies
