// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <opencv2/core.hpp>
#include <vector>

#include "mapping/geometry/reference_view.h"
#include "mapping/geometry/rigid3.h"
#include "test/studies/frames/posed_frames.h"

namespace efm::studies {

struct FrameDepthOptions {
  DepthPlanesOptions planes = {0.44, 2.8, 192, PlaneSpacing::kInverse};
  /// Range of distances from the view to a used frame, metres. A near frame fits every plane; a far
  /// frame sees other objects.
  double min_baseline_m = 0.02;
  double max_baseline_m = 0.3;
  int max_frames = 16;  ///< Max number of used frames, evenly chosen; at least 2.
  /// Standard deviations of the Gaussian windows in pixels. A pixel gets the depth of the first
  /// window that is sure. Wide windows are for edges along the motion: only their surroundings have
  /// a depth.
  std::vector<double> window_sigmas_px = {1.5, 3.5};
  /// Min correlation of the peak, up to 1.
  double min_score = 0.75;
  /// A pixel is used only with this min gradient of grey values, and with at least `ridge_fraction`
  /// of the max gradient within `shadow_px`. Windows contain farther edges, too, and these may be
  /// outlines of objects in front.
  double min_gradient = 1.5;
  double ridge_fraction = 0.5;
  int shadow_px = 4;
  /// Pixels between two sure pixels of a row or column are sure if the two are at most this far
  /// apart and have the same depth (within `separation`): an even patch of a surface.
  int max_gap_px = 16;
  /// A depth is another one if it differs by more than this fraction.
  double separation = 0.05;
  /// Min difference between the correlations of the peak and of every other depth. It excludes flat
  /// peaks and second peaks.
  double min_margin = 0.08;
  /// Max relative difference to the depth of a second view.
  double max_disagreement = 0.02;
  /// Distance of the second view, metres. It is the view of a frame.
  double check_baseline_m = 0.03;

  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

/// Depth from frames, in a reference view.
struct FrameDepth {
  cv::Mat1f depth;   ///< z-depth in metres; 0 where it is not sure.
  cv::Mat1f likely;  ///< The best depth of every pixel, sure or not; 0 with too few frames.
  cv::Mat1f score;   ///< Correlation at that depth, -1 to 1.
  cv::Mat1f margin;  ///< Difference to the correlation of every other depth, see `separation`.
  cv::Mat1f grey;    ///< The key frame, seen from the view.
};

/// Plane-sweep stereo of many views with known poses (Collins, CVPR 1996): every frame is warped
/// to the view over each depth plane and correlated (ZNCC) with the frame at `key`, warped alike;
/// per pixel and plane the better half of the frames counts, against occlusions
/// (Kang, Szeliski and Chai, CVPR 2001).
/// @throws std::invalid_argument where the options are not valid; std::runtime_error where no pixel
/// of the view is in enough frames.
FrameDepth frameDepth(const PosedFrames& sequence, std::size_t key, const ReferenceView& view,
                      const Rigid3& T_world_ref, const FrameDepthOptions& options = {});

}  // namespace efm::studies
