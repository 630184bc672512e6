// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include "plugin/evaluation/trajectory_evaluation.h"

namespace efm {

/// Both trajectories, the estimate aligned, seen along the axis that the truth extends least along
/// (from above, where it is upright); beside them the absolute errors over time.
cv::Mat3b evaluationPlot(const TrajectoryEvaluation& evaluation);

}  // namespace efm
