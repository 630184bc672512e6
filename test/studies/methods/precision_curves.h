// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "maps/metrics/depth_metrics.h"
#include "test/studies/methods/method_comparison.h"
#include "test/studies/report/study_section.h"

namespace efm::studies {

/// Precision and recall with a name.
struct NamedPrecision {
  std::string name;
  PrecisionRecall counts;
};

/// Allowed errors of 1 cm to 1 m.
std::vector<double> studyThresholds();

/// Over all keyframes together, compared with every pixel of the truth.
PrecisionRecall precisionOf(const Recording& recording,
                            const std::vector<KeyframeDepthMap>& keyframes,
                            const DepthPairingOptions& pairing);

/// Plots of precision, recall and F1 over the allowed error.
cv::Mat3b drawPrecision(const std::vector<NamedPrecision>& all);

/// Precision, recall and F1 of each at some allowed errors, percent.
TextTable precisionTable(const std::vector<NamedPrecision>& all,
                         const std::vector<double>& thresholds_m);

/// Of each, in percent, at an allowed error.
std::vector<double> precisionAt(const std::vector<NamedPrecision>& all, double threshold_m);
std::vector<double> recallAt(const std::vector<NamedPrecision>& all, double threshold_m);

/// The index of an allowed error.
/// @throws std::logic_error for another error.
std::size_t stepOf(const PrecisionRecall& counts, double threshold_m);

}  // namespace efm::studies
