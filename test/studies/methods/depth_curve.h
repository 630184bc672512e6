// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "test/studies/methods/method_comparison.h"

namespace efm::studies {

/// How good some points are. Shares are 0 to 1; the truth is the best within a pixel.
struct PointQuality {
  double points = 0;
  double beyond_10 = 0;       ///< Share with a depth error over 10 %.
  double median = 0;          ///< Median |Z - Z_true| / Z_true.
  double beyond_plane = 0;    ///< Share more than a plane step from the truth.
  double recall = 0;          ///< Share of the visible edges with a right point within a pixel.
  double within_sigma = 0;    ///< Of the points within five plane steps: within one
  double within_2_sigma = 0;  ///< and two standard deviations of the truth.

  double f1() const;  ///< Of precision, the share within 10 %, and recall.
};

/// A method's keyframes of some windows with one threshold after the other, from few points to
/// many.
struct DepthCurve {
  std::string name;
  std::vector<PointQuality> steps;

  /// At a number of points, between two steps; of the nearest end where there are not so many.
  PointQuality at(double points) const;
};

/// What the methods' depth maps of a recording's windows are held against.
class DepthJudge {
 public:
  /// @param planes whose step is the unit.
  DepthJudge(const Recording& recording, const DepthPlanesOptions& planes);

  /// @param keyframes of one view, whatever their methods: the truth of a reference time is made
  /// once.
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

/// The extraction with another threshold: `threshold_c` of `kPaper`, `min_quality` of
/// `kAggregated`.
DepthExtractionOptions withThreshold(DepthExtractionOptions extraction, double threshold);

/// Over the thresholds of its extraction: `threshold_c` of `kPaper`, `min_quality` of
/// `kAggregated`.
DepthCurve depthCurve(const Recording& recording, const std::vector<Window>& windows,
                      const Method& method, DepthJudge& judge);

/// With the method's own threshold.
PointQuality asItIs(const Recording& recording, const std::vector<Window>& windows,
                    const Method& method, DepthJudge& judge);

}  // namespace efm::studies
