// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <opencv2/core.hpp>
#include <vector>

#include "mapping/geometry/depth_planes.h"
#include "mapping/geometry/reference_view.h"
#include "mapping/geometry/rigid3.h"
#include "test/studies/frames/posed_frames.h"

namespace efm::studies {

struct FrameDepthOptions {
  DepthPlanesOptions planes = {0.44, 2.8, 192, PlaneSpacing::kInverse};
  /// Frames from nearer and from farther than this are not used, metres: near ones look alike over
  /// every plane, far ones see other things.
  double min_baseline_m = 0.02;
  double max_baseline_m = 0.3;
  int max_frames = 16;  ///< Of those that are left, evenly chosen; at least 2.
  /// Standard deviations of the Gaussian windows in pixels: a pixel takes its depth from the first
  /// one that is sure. Wide ones serve edges along the motion, which only their neighbours place.
  std::vector<double> window_sigmas_px = {1.5, 3.5};
  /// Least correlation of the peak, up to 1.
  double min_score = 0.75;
  /// A pixel takes part only where the grey values change by this much per pixel, and by at least
  /// `ridge_share` of the largest change within `shadow_px`: windows see edges farther away, which
  /// may be the outline of something in front.
  double min_gradient = 1.5;
  double ridge_share = 0.5;
  int shadow_px = 4;
  /// What lies between two sure pixels of one row or column, at most this many pixels apart and of
  /// the same depth (within `separation`), is sure too: a patch of even grey on a surface.
  int max_gap_px = 16;
  /// The peak must stand out from every depth that differs by more than this share...
  double separation = 0.05;
  /// ...by this much correlation: this refuses flat peaks and second ones alike.
  double min_margin = 0.08;
  /// The depth must come out again in a second view, within this share...
  double max_disagreement = 0.02;
  /// ...which stands where a frame was taken, about this far away (metres).
  double check_baseline_m = 0.03;

  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

/// Depth from ordinary frames, in a reference view.
struct FrameDepth {
  cv::Mat1f depth;   ///< z-depth in metres; 0 where it is not sure.
  cv::Mat1f likely;  ///< The best depth of every pixel, sure or not; 0 where too few frames look.
  cv::Mat1f score;   ///< Correlation at that depth, -1 to 1.
  cv::Mat1f margin;  ///< By which it stands out, see `separation`.
  cv::Mat1f grey;    ///< The key frame as the view sees it.
};

/// Plane-sweep stereo of many views with known poses (Collins, CVPR 1996): every frame is warped
/// to the view over each depth plane and correlated (ZNCC) with the frame at `key`, warped alike;
/// per pixel and plane the better half of the frames counts, so that occlusions do no harm
/// (Kang, Szeliski and Chai, CVPR 2001).
/// @throws std::invalid_argument where the options are not valid; std::runtime_error where no pixel
/// of the view is seen by frames enough.
FrameDepth frameDepth(const PosedFrames& sequence, std::size_t key, const ReferenceView& view,
                      const Rigid3& T_world_ref, const FrameDepthOptions& options = {});

}  // namespace efm::studies
