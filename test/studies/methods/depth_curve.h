// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "test/studies/methods/method_comparison.h"

namespace efm::studies {

/// The quality of points. Fractions are 0 to 1. The truth is the best within a pixel.
struct PointQuality {
  double points = 0;
  double beyond_10 = 0;     ///< Fraction with a depth error over 10 %.
  double median = 0;        ///< Median |Z - Z_true| / Z_true.
  double beyond_plane = 0;  ///< Fraction more than a plane step from the truth.
  double recall = 0;        ///< Fraction of the visible edges with a right point within a pixel.
  /// Fractions of the points within five plane steps that are within one and within two standard
  /// deviations of the truth.
  double within_sigma = 0;
  double within_2_sigma = 0;

  double f1() const;  ///< Of recall and precision, the fraction within 10 %.
};

/// The quality of a method for a series of thresholds, from few points to many.
struct DepthCurve {
  std::string name;
  std::vector<PointQuality> steps;

  /// Interpolated at a number of points; the nearest end outside of the curve.
  PointQuality at(double points) const;
};

/// Judges depth maps of a recording by its truth.
class DepthJudge {
 public:
  /// @param planes their step is the unit of `beyond_plane`.
  DepthJudge(const Recording& recording, const DepthPlanesOptions& planes);

  /// @param keyframes of one view and any method. The truth of a reference time is computed once.
  PointQuality judge(const std::vector<KeyframeDepthMap>& keyframes);

 private:
  struct Truth {
    cv::Mat1f depth_m;
    cv::Mat1b edges;
  };

  const Truth& truthFor(const KeyframeDepthMap& keyframe);

  const Recording* recording_;
  std::map<std::int64_t, Truth> truths_;  // by reference time
  double step_;                           // of inverse depth, 1/m
};

/// The extraction with another threshold: `threshold_c` of `kPaper`, `min_probability` of
/// `kAggregated`.
DepthExtractionOptions withThreshold(DepthExtractionOptions extraction, double threshold);

/// The curve over the thresholds of the method's extraction.
DepthCurve depthCurve(const Recording& recording, const std::vector<Window>& windows,
                      const Method& method, DepthJudge& judge);

/// The quality with the method's own threshold.
PointQuality qualityOf(const Recording& recording, const std::vector<Window>& windows,
                       const Method& method, DepthJudge& judge);

}  // namespace efm::studies
