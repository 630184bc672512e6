// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <opencv2/core.hpp>

#include "plugin/cloud_evaluation.h"
#include "plugin/depth_evaluation.h"
#include "plugin/trajectory_evaluation.h"

namespace efm {

/// One picture of an evaluation.

/// Estimate, truth and error of one map (of several that with the median number of points) side by
/// side; below, precision, recall and F1 over the threshold and, of several maps, their errors over
/// time. Reads the files of that map again.
/// @throws std::runtime_error as `evaluateDepth` does.
cv::Mat3b evaluationPlot(const DepthEvaluation& evaluation, const DepthEvaluationOptions& options);

/// Accuracy, completeness and F1 over the distance.
cv::Mat3b evaluationPlot(const CloudEvaluation& evaluation);

/// Both trajectories, the estimate aligned, seen along the axis that the truth extends least along
/// (from above, where it is upright); beside them the absolute errors over time.
cv::Mat3b evaluationPlot(const TrajectoryEvaluation& evaluation);

/// Writes a picture as PNG.
/// @throws std::runtime_error naming the file where its extension is not .png or it cannot be
/// written.
void writePlot(const std::filesystem::path& file, const cv::Mat3b& picture);

}  // namespace efm
