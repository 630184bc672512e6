// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include <cstddef>
#include <optional>
#include <vector>

#include "mapping/events/window.h"
#include "mapping/geometry/reference_view.h"
#include "mapping/geometry/rigid3.h"
#include "mapping/geometry/trajectory.h"
#include "mapping/motion/motion_correction.h"

namespace efm {

/// The edges in a slice of one camera's events: the difference of two Gaussians of the number of
/// events per pixel of the camera's view without distortion, relative to the wider Gaussian. It is
/// high on edges, and does not depend on their contrast. Bytes; 0 and 255 are the clipped ends.
///
/// Levels: the finest first, each with half the pixels on a side. None if the slice has too few
/// events.
using EdgeLevels = std::vector<cv::Mat1b>;

/// @param finest number of times that the view's sides are halved for the finest level.
EdgeLevels edgesIn(EventSpan slice, const UndistortionTable& undistortion,
                   const ReferenceView& view, int finest);

/// The effort of an alignment.
struct SliceEffort {
  double spacing_s = 0.01;  ///< Distance of two slices in time.
  int max_points = 1000;

  /// Returns the effort to see whether a correction is worthwhile: a third. Fewer points or pixels
  /// would show a blur of exact poses.
  static SliceEffort look() { return {0.03, 1000}; }
};

/// A correction of the motion, and what it does to the image.
struct AlignedMotion {
  MotionCorrection correction;
  /// Root mean square of the distances by which the correction differs from the start, in the
  /// image, over points and slices, pixels.
  double shift_px = 0;
  /// Size of a pixel of the finest edges, in pixels of the camera's view. A smaller shift is no
  /// error of the motion.
  double finest_px = 1;
};

/// Aligns short slices of a window's events with the points of a depth map of the window, in all
/// cameras: finds the motion along which the points lie on the edges of each slice.
///
/// The poses of the slices are found together by Gauss-Newton steps, from blurred to sharp edges.
/// Their prior is the tracker's motion with a random walk of its error. Slices far from the
/// reference time join step by step, because errors grow with the distance. Points that lie on no
/// edges lose weight from step to step: they are wrong. Then all poses are moved together so that
/// the pose at the reference time stays.
class SliceAlignment {
 public:
  /// Finds the edges of all slices, in parallel on the threads of the caller's task arena. Memory:
  /// up to 50 MB per camera and second of the window. @param input must outlive this object.
  SliceAlignment(const WindowInput& input, const Trajectory& tracked,
                 const MotionCorrectionOptions& options, const SliceEffort& effort = {});

  /// @param depth of the input's view, metres; 0: no depth.
  /// @param start of the search.
  /// @return std::nullopt if there are too few depths or events.
  std::optional<AlignedMotion> align(const cv::Mat1f& depth, const MotionCorrection& start) const;

  /// Returns the correction without an effect: all knots are 0.
  const MotionCorrection& none() const { return none_; }

 private:
  struct Equations;
  struct WeightedPoints {
    std::vector<Eigen::Vector3d> p_ref;
    std::vector<double> weights;  // from 0 to 1
  };

  double speed() const;
  std::vector<Eigen::Vector3d> pointsOf(const cv::Mat1f& depth) const;
  Equations equationsOf(std::size_t slice, const Rigid3& T_ref_rig, const WeightedPoints& points,
                        std::size_t level) const;
  void weigh(WeightedPoints& points, const std::vector<Equations>& slices) const;
  double shiftBetween(const MotionCorrection& a, const MotionCorrection& b,
                      const std::vector<Eigen::Vector3d>& points) const;

  const WindowInput& input_;
  const MotionCorrectionOptions& options_;
  SliceEffort effort_;
  MotionCorrection none_;
  std::vector<ReferenceView> views_;  // of each camera, without distortion
  int finest_ = 0;
  std::vector<Rigid3> T_ref_tracked_;           // of each slice
  std::vector<bool> has_pose_;                  // of each slice
  std::vector<std::vector<EdgeLevels>> edges_;  // [slice][camera]
  double speed_m_s_ = 0;
};

}  // namespace efm
