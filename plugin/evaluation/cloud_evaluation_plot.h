// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include "plugin/evaluation/cloud_evaluation.h"

namespace efm {

/// Accuracy, completeness and F1 over the distance.
cv::Mat3b evaluationPlot(const CloudEvaluation& evaluation);

}  // namespace efm
