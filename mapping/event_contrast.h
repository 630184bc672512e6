// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <vector>

#include "mapping/warped_events.h"

namespace efm {

/// A correction of velocity as six numbers: linear (m/s), then angular (rad/s).
using VelocityVector = Eigen::Matrix<double, 6, 1>;

/// How sharp the images of warped events are (Gallego et al., CVPR 2018), of all cameras together.
class EventContrast {
 public:
  /// @param events of each camera.
  /// @param blur_px standard deviation of the Gaussian that images are smoothed with, above 0.
  EventContrast(const std::vector<std::vector<WarpedEvent>>& events, cv::Size view, double blur_px);

  struct Value {
    double contrast = 0;
    VelocityVector gradient = VelocityVector::Zero();
  };
  Value at(const VelocityVector& velocity) const;

 private:
  cv::Mat1f imageOf(const std::vector<WarpedEvent>& events, const VelocityVector& velocity) const;
  cv::Mat1f smoothed(const cv::Mat1f& image) const;

  const std::vector<std::vector<WarpedEvent>>& events_;
  cv::Size view_;
  double blur_px_;
};

}  // namespace efm
