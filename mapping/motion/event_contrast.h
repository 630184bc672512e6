// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <opencv2/core.hpp>
#include <vector>

#include "mapping/motion/warped_events.h"

namespace efm {

/// The contrast of the images of warped events (Gallego et al., CVPR 2018) of all cameras. The
/// images are fused pixel by pixel by the harmonic mean, like DSIs (Ghosh and Gallego 2022,
/// Sec. 3.4); the contrast is the sum of the squares of the fused image.
///
/// Variables: six for the rig's velocity, linear (m/s) and angular (rad/s), and one for each square
/// patch of the view, added to its inverse depth (1/m). The patches are needed because depth that
/// was found along a wrong motion fits that motion: fixed depth would hold the motion too.
class EventContrast {
 public:
  /// @param events of each camera; must outlive this object. @param patch_px side of a patch.
  EventContrast(const std::vector<std::vector<WarpedEvent>>& events, cv::Size view, int patch_px);

  /// Standard deviation of the Gaussian that images are smoothed with, in pixels, above 0.
  void setBlur(double blur_px) { blur_px_ = blur_px; }

  /// 6 plus the number of patches with events.
  Eigen::Index variables() const { return 6 + static_cast<Eigen::Index>(events_in_patch_.size()); }
  /// For each patch with events.
  const std::vector<std::size_t>& eventsInPatch() const { return events_in_patch_; }

  /// The contrast with a change of the variables, and its gradient. 0 where the events of the
  /// cameras do not meet in any pixel. Cameras run in parallel.
  double at(const Eigen::VectorXd& change, Eigen::VectorXd& gradient) const;

 private:
  struct Cell;
  using Change = Eigen::VectorXf;

  Cell cellOf(std::size_t camera, std::size_t event, const Change& change) const;
  cv::Mat1f imageOf(std::size_t camera, const Change& change) const;
  cv::Mat1f smoothed(const cv::Mat1f& image) const;
  Eigen::VectorXd gradientOf(std::size_t camera, const Change& change,
                             const cv::Mat1f& by_pixel_value) const;

  const std::vector<std::vector<WarpedEvent>>& events_;
  cv::Size view_;
  double blur_px_ = 1;
  std::vector<std::vector<int>> patches_;  // [camera][event]
  std::vector<std::size_t> events_in_patch_;
};

}  // namespace efm
