// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <opencv2/core.hpp>
#include <vector>

#include "mapping/motion/warped_events.h"

namespace efm {

/// How well the events of all cameras meet: the contrast of their images of warped events (Gallego
/// et al., CVPR 2018), fused pixel by pixel by the harmonic mean as DSIs are (Ghosh and Gallego
/// 2022, Sec. 3.4): the sum of the squares of the fused image.
///
/// Events are moved by six numbers for the rig's velocity, linear (m/s) and angular (rad/s), and
/// one for each square patch of the view: by how much inverse depth (1/m) is larger there. Depth
/// that was found along a wrong motion is wrong in a way that suits that motion, and differs from
/// place to place; fixed, it would hold the motion where it is.
class EventContrast {
 public:
  /// @param events of each camera; must stay. @param patch_px side of a patch.
  EventContrast(const std::vector<std::vector<WarpedEvent>>& events, cv::Size view, int patch_px);

  /// Standard deviation of the Gaussian that images are smoothed with, in pixels, above 0.
  void setBlur(double blur_px) { blur_px_ = blur_px; }

  /// Six and the number of patches that have events.
  Eigen::Index variables() const { return 6 + static_cast<Eigen::Index>(events_in_patch_.size()); }
  /// Per patch that has events.
  const std::vector<std::size_t>& eventsInPatch() const { return events_in_patch_; }

  /// The contrast with a change of the variables, and its gradient: 0 where the cameras' events do
  /// not meet. Cameras run side by side.
  double at(const Eigen::VectorXd& change, Eigen::VectorXd& gradient) const;

 private:
  struct Cell;
  using Change = Eigen::VectorXf;

  Cell cellOf(std::size_t camera, std::size_t event, const Change& change) const;
  cv::Mat1f imageOf(std::size_t camera, const Change& change) const;
  cv::Mat1f smoothed(const cv::Mat1f& image) const;
  Eigen::VectorXd gradientOf(std::size_t camera, const Change& change,
                             const cv::Mat1f& slope) const;

  const std::vector<std::vector<WarpedEvent>>& events_;
  cv::Size view_;
  double blur_px_ = 1;
  std::vector<std::vector<int>> patches_;  // [camera][event]
  std::vector<std::size_t> events_in_patch_;
};

}  // namespace efm
