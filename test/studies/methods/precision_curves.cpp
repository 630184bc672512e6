// SPDX-License-Identifier: BSD-3-Clause
#include "test/studies/methods/precision_curves.h"

#include <cmath>
#include <stdexcept>

#include "plugin/results/pictures/curve_plot.h"

namespace efm::studies {
namespace {

using Fraction = double (PrecisionRecall::*)(std::size_t) const;

cv::Mat3b drawFraction(const std::vector<NamedPrecision>& all, const char* title,
                       Fraction fraction) {
  CurvePlot plot;
  plot.title = title;
  plot.size = {480, 400};
  plot.x = {"allowed error [m]", AxisScale::kLogarithmic, {}, {}};
  plot.y = {"%", AxisScale::kLinear, 0, {}};
  for (const NamedPrecision& one : all) {
    Curve curve{one.name, {}, CurveStyle::kMarkedLine, {}};
    for (std::size_t i = 0; i < one.counts.steps.size(); ++i) {
      curve.points.emplace_back(one.counts.steps[i].threshold_m, 100 * (one.counts.*fraction)(i));
    }
    plot.curves.push_back(curve);
  }
  return drawCurves(plot);
}

std::vector<double> percentAt(const std::vector<NamedPrecision>& all, double threshold_m,
                              Fraction fraction) {
  std::vector<double> percents;
  for (const NamedPrecision& one : all) {
    percents.push_back(100 * (one.counts.*fraction)(stepOf(one.counts, threshold_m)));
  }
  return percents;
}

}  // namespace

std::vector<double> studyThresholds() {
  return {0.01, 0.02, 0.03, 0.04, 0.06, 0.08, 0.12, 0.16, 0.25, 0.4, 0.6, 1};
}

PrecisionRecall precisionOf(const Recording& recording,
                            const std::vector<KeyframeDepthMap>& keyframes,
                            const DepthPairingOptions& pairing) {
  PrecisionRecall sum = precisionRecall({cv::Mat1f(), cv::Mat1f(), {}}, studyThresholds(), pairing);
  for (const KeyframeDepthMap& keyframe : keyframes) {
    sum.add(precisionRecall({keyframe.map.depth, truthOf(recording, keyframe), {}},
                            studyThresholds(), pairing));
  }
  return sum;
}

cv::Mat3b drawPrecision(const std::vector<NamedPrecision>& all) {
  cv::Mat3b picture;
  cv::hconcat(std::vector<cv::Mat>{drawFraction(all, "Precision", &PrecisionRecall::precision),
                                   drawFraction(all, "Recall", &PrecisionRecall::recall),
                                   drawFraction(all, "F1", &PrecisionRecall::f1)},
              picture);
  return picture;
}

TextTable precisionTable(const std::vector<NamedPrecision>& all,
                         const std::vector<double>& thresholds_m) {
  TextTable table;
  table.head = {""};
  for (const char* what : {"precision", "recall", "F1"}) {
    for (const double threshold_m : thresholds_m) {
      table.head.push_back(std::string(what) + " " + formatNumber(100 * threshold_m, 0) +
                           " cm [%]");
    }
  }
  for (const NamedPrecision& one : all) {
    std::vector<std::string> row = {one.name};
    for (const Fraction fraction :
         {&PrecisionRecall::precision, &PrecisionRecall::recall, &PrecisionRecall::f1}) {
      for (const double threshold_m : thresholds_m) {
        row.push_back(
            formatNumber(100 * (one.counts.*fraction)(stepOf(one.counts, threshold_m)), 1));
      }
    }
    table.rows.push_back(row);
  }
  return table;
}

std::vector<double> precisionAt(const std::vector<NamedPrecision>& all, double threshold_m) {
  return percentAt(all, threshold_m, &PrecisionRecall::precision);
}

std::vector<double> recallAt(const std::vector<NamedPrecision>& all, double threshold_m) {
  return percentAt(all, threshold_m, &PrecisionRecall::recall);
}

std::size_t stepOf(const PrecisionRecall& counts, double threshold_m) {
  for (std::size_t i = 0; i < counts.steps.size(); ++i) {
    if (std::abs(counts.steps[i].threshold_m - threshold_m) < 1e-9) return i;
  }
  throw std::logic_error("no allowed error of " + std::to_string(threshold_m) + " m");
}

}  // namespace efm::studies
