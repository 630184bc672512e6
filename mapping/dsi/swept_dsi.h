// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "mapping/dsi/dsi_columns.h"
#include "mapping/dsi/dsi_peaks.h"

namespace efm {

/// What is kept of a DSI.
struct SweptDsi {
  DsiPeaks peaks;
  DsiRays rays;  ///< Where asked for.
};

}  // namespace efm
