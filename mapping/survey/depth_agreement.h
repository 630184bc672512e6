// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "mapping/keyframes/fusion_mapper.h"
#include "mapping/survey/window_sample.h"

namespace efm {

/// Two measurements of the same depths: from the motion of the reference camera alone, and from all
/// cameras within a short time, pixel by pixel. Calibration and poses decide both.
struct DepthAgreement {
  /// Median of (depth by motion) / (depth by the rig). Right poses and baselines give 1; positions
  /// in the wrong unit give its factor.
  double scale = 1;
  /// The fraction of the pixels whose ratio is within 15 % of that median.
  double agreeing = 0;
};

/// @return nothing for one camera, and where too few pixels have both depths: the camera hardly
///   moves.
/// @throws std::invalid_argument where the options do not fit the rig.
std::optional<DepthAgreement> depthAgreement(const Rig& rig,
                                             const std::vector<WindowSample>& samples,
                                             const FusionMapperOptions& options);

}  // namespace efm
