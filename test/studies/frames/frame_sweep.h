// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <opencv2/core.hpp>
#include <vector>

#include "mapping/geometry/reference_view.h"
#include "mapping/geometry/rigid3.h"
#include "test/studies/frames/posed_frames.h"

namespace efm::studies {

/// See FrameDepthOptions.
struct FrameSweepOptions {
  double min_baseline_m = 0;
  double max_baseline_m = 1;
  int max_frames = 16;
  std::vector<double> window_sigmas_px = {1.5};
};

/// The frames around a view and their correlation over a depth plane (Collins, CVPR 1996). Queries
/// are thread-safe.
class FrameSweep {
 public:
  /// Min number of frames that see a pixel.
  static constexpr int kMinFrames = 2;

  /// @param sequence outlives the sweep.
  /// @param key index of the frame that the others are compared with.
  FrameSweep(const PosedFrames& sequence, std::size_t key, const ReferenceView& view,
             const Rigid3& T_world_ref, const FrameSweepOptions& options);

  const ReferenceView& view() const { return view_; }

  /// Correlation (ZNCC) with the key frame for a plane at this depth, for each size of the window:
  /// per pixel the mean of the better half of the frames; -1 where fewer than two see it.
  std::vector<cv::Mat1f> scoresAt(double depth_m) const;

 private:
  /// A frame and the masks of the windows that are inside of the raw image.
  struct Source {
    const PosedFrame* frame = nullptr;
    std::vector<cv::Mat1b> seen;  // per size of the window
  };
  /// A frame warped to the view over one plane.
  struct WarpedFrame {
    cv::Mat1f image;
    std::vector<cv::Mat1b> seen;  // per size of the window: 255 where all of it is seen, else 0
  };

  Source sourceOf(const PosedFrame& frame) const;
  WarpedFrame warp(const Source& source, double depth_m) const;
  cv::Mat1f correlate(const WarpedFrame& key, const std::vector<WarpedFrame>& others,
                      std::size_t window) const;

  ReferenceView frame_view_;
  ReferenceView view_;
  Rigid3 T_world_ref_;
  std::vector<double> sigmas_px_;
  Source key_;
  std::vector<Source> others_;
};

}  // namespace efm::studies
