// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "mapping/dsi_peaks.h"
#include "mapping/dsi_rays.h"

namespace efm {

/// What is kept of a DSI.
struct SweptDsi {
  DsiPeaks peaks;
  DsiRays rays;  ///< Where asked for.
};

}  // namespace efm
