// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include "plugin/evaluation/trajectory_evaluation.h"

namespace efm {

/// Draws both trajectories, with the estimate aligned, and the absolute errors over time. The view
/// is along the axis of the truth's smallest extent: from above if two are equal.
cv::Mat3b evaluationPlot(const TrajectoryEvaluation& evaluation);

}  // namespace efm
