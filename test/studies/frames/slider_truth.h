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

/// What the ordinary frames of a recording say of a reference view.
struct SliderTruth {
  FrameDepth frames;  ///< With the frame nearest in time, 0 to 255.
  EdgeKinds edges;    ///< Of that frame as the view sees it.
};

/// Depth and edges of `slider_depth` (Mueggler et al., IJRR 2017) from its real frames and the true
/// poses, for the reference view of a keyframe of its events. The slider passes 0.3 m and more,
/// the events of a keyframe a few centimetres: the frames know depth far better.
/// @throws std::runtime_error where the folder cannot be read.
SliderTruth sliderTruth(const std::filesystem::path& folder, const ReferenceView& view,
                        const Rigid3& T_world_ref, std::int64_t t_ref_ns,
                        const FrameDepthOptions& options = {});

/// How good a depth map of the slider's events is. Errors are |Z - Z_true| / Z_true, the truth the
/// best within a pixel; shares are 0 to 1.
struct SliderScore {
  std::uint64_t points = 0;
  std::uint64_t with_truth = 0;     ///< Points that the frames have a truth for: errors are theirs.
  double median_error = 0;          ///< Share of the depth.
  double beyond_10 = 0;             ///< Share of points with an error over 10 %.
  double vertical_beyond_10 = 0;    ///< Of those on vertical edges.
  double horizontal_beyond_10 = 0;  ///< Of those on horizontal edges.
  double on_horizontal = 0;         ///< Share of all points that lie on horizontal edges.
  double vertical_covered = 0;      ///< Share of vertical edge pixels with a point within a pixel.
};

/// @param depth_m z-depth in metres in the truth's view; 0 where there is none.
/// @throws std::invalid_argument where the sizes differ.
SliderScore scoreOnSlider(const cv::Mat1f& depth_m, const SliderTruth& truth);

}  // namespace efm::studies
