// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "plugin/evaluation/depth_evaluation.h"
#include "plugin/evaluation/stereo_baseline.h"

namespace efm {

/// Tables of at most 80 columns. Of several maps: a line per map with the main measures. Then a
/// line per measure, with the mean of the maps and the value of all points; precision, recall and
/// F1 over the thresholds, the maps without partner, and the focal length and baseline of bad-pix.
std::string evaluationTable(const DepthEvaluation& evaluation,
                            const std::optional<StereoBaseline>& stereo = std::nullopt);

/// `depthEvaluationKeys` describes the keys.
std::string evaluationJson(const DepthEvaluation& evaluation,
                           const std::optional<StereoBaseline>& stereo = std::nullopt);

/// The keys of the JSON, for the program's help.
std::string depthEvaluationKeys();

}  // namespace efm
