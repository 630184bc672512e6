// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include <vector>

#include "mapping/depth/depth_map.h"
#include "mapping/depth/depth_probability.h"
#include "mapping/geometry/reference_view.h"

namespace efm {

/// What the neighbours of candidates use of them: one value per pixel of the mask.
struct CandidateDepths {
  const SparseMask* mask = nullptr;
  std::vector<float> positions;      ///< First depths, planes.
  std::vector<float> contrasts;      ///< Local contrast, above 0.
  std::vector<float> probabilities;  ///< That these depths are right.
  std::vector<double> variances;     ///< Of these depths, planes^2.
};

/// The depths of neighbours: one value per pixel.
struct NeighbourDepths {
  std::vector<PlanePosition> positions;
  std::vector<NeighbourInputs> inputs;
};

/// Returns depths for pixels near the candidates. An edge is three to five pixels wide, and its
/// ridge, the candidates, one or two. The depth of a pixel is the median of the first depths of the
/// candidates in the 9x9 pixels around it, weighted by local contrast.
/// @param pixels have a confidence above 0 and a candidate in 9x9.
/// @param step_planes see `planesPerStep`. @param near_planes depths agree that differ by less.
/// Runs on the threads of the caller's task arena.
NeighbourDepths neighbourDepths(const SparseMask& pixels, const CandidateDepths& candidates,
                                const cv::Mat1f& confidence, const DepthPlanes& planes,
                                double step_planes, float near_planes);

}  // namespace efm
