// SPDX-License-Identifier: BSD-3-Clause
#include "test/studies/methods/depth_curve.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "mapping/depth/peak_fit.h"
#include "mapping/geometry/reference_view.h"
#include "maps/metrics/depth_metrics.h"
#include "test/studies/methods/visible_edges.h"

namespace efm::studies {
namespace {

constexpr double kFewerCandidates = 0.9;  ///< Thresholds below it relax the local contrast, too.
constexpr double kWrong = 0.1;            ///< Relative depth error of a wrong point.
constexpr double kInlierPlanes = 5;       ///< Variances are judged for points within this distance.

/// Counters over all keyframes.
struct Tally {
  std::vector<double> errors;
  double wrong = 0, beyond_plane = 0;
  double edges = 0, edges_found = 0;
  double inliers = 0, within_sigma = 0, within_2_sigma = 0;
};

double fraction(double part, double whole) { return whole > 0 ? part / whole : 0; }

PointQuality mix(const PointQuality& a, const PointQuality& b, double of_b) {
  const auto between = [of_b](double x, double y) { return (1 - of_b) * x + of_b * y; };
  return {between(a.points, b.points),
          between(a.beyond_10, b.beyond_10),
          between(a.median, b.median),
          between(a.beyond_plane, b.beyond_plane),
          between(a.recall, b.recall),
          between(a.within_sigma, b.within_sigma),
          between(a.within_2_sigma, b.within_2_sigma)};
}

std::vector<double> thresholdsOf(ExtractionMethod method) {
  if (method == ExtractionMethod::kPaper) return {30, 20, 14, 9, 7, 5, 3.5, 2.5, 1.5, 0.5};
  return {0.999, 0.998, 0.995, 0.99, 0.98, 0.95, 0.9, 0.7, 0.4, 0.1};
}

}  // namespace

DepthExtractionOptions withThreshold(DepthExtractionOptions extraction, double threshold) {
  if (extraction.extraction == ExtractionMethod::kPaper) {
    extraction.threshold_c = threshold;
  } else {
    // More points need more candidates.
    extraction.min_local_contrast *= std::clamp(threshold / kFewerCandidates, 0.3, 1.0);
    extraction.min_probability = threshold;
  }
  return extraction;
}

double PointQuality::f1() const {
  const double precision = 1 - beyond_10;
  return fraction(2 * precision * recall, precision + recall);
}

PointQuality DepthCurve::at(double points) const {
  if (points <= steps.front().points) return steps.front();
  for (std::size_t i = 1; i < steps.size(); ++i) {
    if (points > steps[i].points) continue;
    const double gap = steps[i].points - steps[i - 1].points;
    return mix(steps[i - 1], steps[i], fraction(points - steps[i - 1].points, gap));
  }
  return steps.back();
}

DepthJudge::DepthJudge(const Recording& recording, const DepthPlanesOptions& planes)
    : recording_(&recording),
      step_((1 / planes.min_depth_m - 1 / planes.max_depth_m) / (planes.num_planes - 1)) {}

const DepthJudge::Truth& DepthJudge::truthFor(const KeyframeDepthMap& keyframe) {
  const auto [place, is_new] = truths_.try_emplace(keyframe.window.t_ref_ns);
  Truth& truth = place->second;
  if (is_new) {
    truth.depth_m = truthOf(*recording_, keyframe);
    truth.edges = visibleEdges(*recording_, keyframe, truth.depth_m);
  }
  return truth;
}

PointQuality DepthJudge::judge(const std::vector<KeyframeDepthMap>& keyframes) {
  Tally tally;
  const DepthPairingOptions pairing = studyPairing();
  for (const KeyframeDepthMap& keyframe : keyframes) {
    const auto& [truth_m, edges] = truthFor(keyframe);
    const ComparedDepths depths{keyframe.map.depth, truth_m, {}};
    cv::Mat1b right = cv::Mat1b::zeros(truth_m.size());
    for (int y = 0; y < truth_m.rows; ++y) {
      for (int x = 0; x < truth_m.cols; ++x) {
        const double z = keyframe.map.depth(y, x);
        if (!(z > 0)) continue;
        const double true_z = bestTruth(depths, {x, y}, pairing);
        if (!(true_z > 0)) continue;
        const double error = std::abs(z - true_z) / true_z;
        const double planes = std::abs(1 / z - 1 / true_z) / step_;
        tally.errors.push_back(error);
        if (error > kWrong) ++tally.wrong;
        if (error <= kWrong) right(y, x) = 255;
        if (planes > 1) ++tally.beyond_plane;
        if (planes > kInlierPlanes) continue;
        const double sigmas = planes * step_ / std::sqrt(keyframe.map.variance(y, x));
        ++tally.inliers;
        if (sigmas <= 1) ++tally.within_sigma;
        if (sigmas <= 2) ++tally.within_2_sigma;
      }
    }
    cv::dilate(right, right, cv::Mat1b::ones(3, 3));
    tally.edges += cv::countNonZero(edges);
    tally.edges_found += cv::countNonZero(edges & right);
  }
  PointQuality quality;
  const auto count = static_cast<double>(tally.errors.size());
  quality.points = count;
  quality.beyond_10 = fraction(tally.wrong, count);
  quality.beyond_plane = fraction(tally.beyond_plane, count);
  quality.recall = fraction(tally.edges_found, tally.edges);
  quality.within_sigma = fraction(tally.within_sigma, tally.inliers);
  quality.within_2_sigma = fraction(tally.within_2_sigma, tally.inliers);
  if (!tally.errors.empty()) {
    quality.median = upperMedian(tally.errors);
  }
  return quality;
}

DepthCurve depthCurve(const Recording& recording, const std::vector<Window>& windows,
                      const Method& method, DepthJudge& judge) {
  DepthCurve curve{method.name, {}};
  for (const double threshold : thresholdsOf(method.options.extraction.extraction)) {
    Method with = method;
    with.options.extraction = withThreshold(method.options.extraction, threshold);
    curve.steps.push_back(judge.judge(mapWindows(recording, windows, with)));
  }
  return curve;
}

PointQuality qualityOf(const Recording& recording, const std::vector<Window>& windows,
                       const Method& method, DepthJudge& judge) {
  return judge.judge(mapWindows(recording, windows, method));
}

}  // namespace efm::studies
