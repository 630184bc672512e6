// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <opencv2/core.hpp>

#include "mapping/depth/depth_extraction.h"
#include "mapping/geometry/reference_view.h"
#include "mapping/geometry/rigid3.h"
#include "test/studies/frames/edge_kinds.h"
#include "test/studies/frames/frame_depth.h"

namespace efm::studies {

/// The truth of a reference view from the frames of a recording.
struct SliderTruth {
  FrameDepth frames;  ///< Its key frame is the nearest in time.
  EdgeKinds edges;    ///< Of the key frame, seen from the view.
};

/// Depth and edges of `slider_depth` (Mueggler et al., IJRR 2017) from its real frames and the true
/// poses, in the reference view of a keyframe. The frames have baselines of 0.3 m, the events of a
/// keyframe a few centimetres: depth from the frames is much more accurate.
/// @throws std::runtime_error where the folder cannot be read.
SliderTruth sliderTruth(const std::filesystem::path& folder, const ReferenceView& view,
                        const Rigid3& T_world_ref, std::int64_t t_ref_ns,
                        const FrameDepthOptions& options = {});

/// The quality of a depth map of the slider's events. Errors are |Z - Z_true| / Z_true with the
/// best truth within a pixel. Fractions are 0 to 1.
struct SliderScore {
  std::uint64_t points = 0;
  std::uint64_t with_truth = 0;     ///< Points with a truth. Errors are of these.
  double median_error = 0;          ///< Fraction of the depth.
  double beyond_10 = 0;             ///< Fraction of points with an error over 10 %.
  double vertical_beyond_10 = 0;    ///< Of points on vertical edges.
  double horizontal_beyond_10 = 0;  ///< Of points on horizontal edges.
  double on_horizontal = 0;         ///< Fraction of points on horizontal edges.
  double vertical_covered = 0;  ///< Fraction of vertical edge pixels with a point within a pixel.
};

/// @param depth_m z-depth in metres in the truth's view; 0 where there is none.
/// @throws std::invalid_argument where the sizes differ.
SliderScore scoreOnSlider(const cv::Mat1f& depth_m, const SliderTruth& truth);

}  // namespace efm::studies
