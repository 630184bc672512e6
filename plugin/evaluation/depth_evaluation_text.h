// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "plugin/evaluation/depth_evaluation.h"
#include "plugin/evaluation/stereo_baseline.h"

namespace efm {

/// For people: a line per map, the mean of the maps and all points; then precision, recall and F1
/// over the thresholds; then what was not compared, and how bad-pix was reckoned or why not.
std::string evaluationTable(const DepthEvaluation& evaluation,
                            const std::optional<StereoBase>& base = std::nullopt);

/// For programs; its keys are in `depthEvaluationKeys`.
std::string evaluationJson(const DepthEvaluation& evaluation,
                           const std::optional<StereoBase>& base = std::nullopt);

/// What the keys of the JSON mean, for the program's help.
std::string depthEvaluationKeys();

}  // namespace efm
