// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "mapping/depth/depth_extraction.h"

namespace efm {

/// `ExtractionMethod::kPaper`: see `extractDepth`.
/// @throws std::invalid_argument where the options are not valid.
DepthMap extractAsPaper(const DsiPeaks& peaks, const DepthPlanes& planes,
                        const DepthExtractionOptions& options,
                        std::optional<double> sequence_maximum = std::nullopt);

}  // namespace efm
