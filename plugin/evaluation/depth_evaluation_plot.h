// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include "plugin/evaluation/depth_evaluation.h"

namespace efm {

/// Draws estimate, truth and error of one map side by side: of several maps the one with the median
/// number of points. Below: precision, recall and F1 over the threshold and, for several maps,
/// their errors over time. Reads the files of the drawn map again.
/// @throws std::runtime_error as `evaluateDepth` does.
cv::Mat3b evaluationPlot(const DepthEvaluation& evaluation, const DepthEvaluationOptions& options);

}  // namespace efm
