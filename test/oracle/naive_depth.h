// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "mapping/depth/depth_extraction.h"

namespace efm::oracle {

/// The steps of `efm::extractDepth` written down one after the other, each over the whole image.
DepthMap extractDepth(const DsiPeaks& peaks, const DepthPlanes& planes,
                      const DepthExtractionOptions& options,
                      std::optional<double> sequence_maximum = std::nullopt);

}  // namespace efm::oracle
