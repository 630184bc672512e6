// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include "plugin/evaluation/depth_evaluation.h"

namespace efm {

/// Estimate, truth and error of one map (of several that with the median number of points) side by
/// side; below, precision, recall and F1 over the threshold and, of several maps, their errors over
/// time. Reads the files of that map again.
/// @throws std::runtime_error as `evaluateDepth` does.
cv::Mat3b evaluationPlot(const DepthEvaluation& evaluation, const DepthEvaluationOptions& options);

}  // namespace efm
