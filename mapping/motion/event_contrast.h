// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include <cstddef>
#include <vector>

#include "mapping/events/window.h"
#include "mapping/geometry/reference_view.h"
#include "mapping/geometry/rigid3.h"
#include "mapping/geometry/trajectory.h"

namespace efm {

/// Returns the corrected motion during a window. In [t0, t1) it has poses at the times of
/// `trajectory`, and one at the reference time.
/// @param trajectory has a pose at the reference time.
Trajectory correctedTrajectory(const Trajectory& trajectory, const Window& window,
                               const VelocityCorrection& correction);

/// A semi-dense depth map that is spread over the pixels around: each pixel has the depth of the
/// nearest pixel with a depth, and the distance to that pixel.
class NearestDepths {
 public:
  /// @param depth metres; 0: no depth.
  /// @param radius_px the distance to which a depth is spread.
  NearestDepths(const cv::Mat1f& depth, double radius_px);

  /// Returns whether no pixel has a depth.
  bool empty() const { return empty_; }
  /// Returns the inverse depth (1/m) of the nearest pixel with a depth; 0 beyond the radius.
  float inverseDepth(cv::Point pixel) const { return inverse_(pixel); }
  float distancePx(cv::Point pixel) const { return distance_(pixel); }

 private:
  bool empty_ = true;
  cv::Mat1f inverse_;
  cv::Mat1f distance_;
};

/// An event warped to the reference view at its depth, and its derivatives by a correction of the
/// rig's velocity and of the depth. The derivatives are of first order: exact to 0.02 pixels for
/// rotations of half a degree at a focal length of 300 pixels.
struct WarpedEvent {
  Eigen::Vector2f pixel;  ///< Position in the reference view, without a correction.
  /// Derivative of the pixel by the velocity (linear in m/s, angular in rad/s).
  Eigen::Matrix<float, 2, 6> by_velocity;
  Eigen::Vector2f by_inverse_depth;  ///< Derivative of the pixel by inverse depth in 1/m.
};

/// A depth plane in inverse depth.
struct InversePlane {
  float inverse_depth = 0;  ///< 1/m.
  float half_step = 0;      ///< Half the distance to its neighbours, 1/m.
};
std::vector<InversePlane> inversePlanes(const DepthPlanes& planes);

/// The view and the depths that events are warped to.
struct WarpTarget {
  Rigid3 T_ref_world;
  ReferenceView view;
  std::vector<InversePlane> planes;       ///< Candidate depths.
  const NearestDepths* depths = nullptr;  ///< Depths of the view; not owned.
  std::int64_t t_ref_ns = 0;
};

/// Warps one camera's events along a trajectory. The depth of an event is that of a pixel near its
/// ray. Events without such a pixel, without a pose or outside the lens are left out.
/// @param every only the middle one of each `every` consecutive events is warped.
std::vector<WarpedEvent> warpEvents(const CameraEvents& camera, std::size_t every,
                                    const Trajectory& trajectory, const WarpTarget& target);

/// The contrast of the images of warped events (Gallego et al., CVPR 2018) of all cameras. The
/// images are fused pixel by pixel by the harmonic mean, like DSIs (Ghosh and Gallego 2022,
/// Sec. 3.4); the contrast is the sum of the squares of the fused image.
///
/// Variables: six for the rig's velocity, linear (m/s) and angular (rad/s), and one for each square
/// patch of the view, added to its inverse depth (1/m). The patches are needed because depth that
/// was found along a wrong motion fits that motion: fixed depths would keep the wrong motion.
class EventContrast {
 public:
  /// @param events of each camera; must outlive this object. @param patch_px side of a patch.
  EventContrast(const std::vector<std::vector<WarpedEvent>>& events, cv::Size view, int patch_px);

  /// Sets the standard deviation of the Gaussian that smooths the images, in pixels, above 0.
  void setBlur(double blur_px) { blur_px_ = blur_px; }

  /// Returns 6 plus the number of patches with events.
  Eigen::Index variables() const { return 6 + static_cast<Eigen::Index>(events_in_patch_.size()); }
  /// Returns the number of events in each patch that has events.
  const std::vector<std::size_t>& eventsInPatch() const { return events_in_patch_; }

  /// Returns the contrast after a change of the variables, and sets its gradient. It is 0 if the
  /// events of the cameras meet in no pixel. Cameras run in parallel.
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
