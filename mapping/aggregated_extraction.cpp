// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/aggregated_extraction.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "mapping/kept_pixels.h"
#include "mapping/local_agreement.h"
#include "mapping/ray_aggregation.h"

namespace efm {
namespace {

constexpr double kNear = 2.5;      ///< Places within which depths agree.
constexpr double kMedianNear = 2;  ///< Places by which a depth may differ from the median.

/// By how much each pixel exceeds its surroundings, as a share of the mean confidence of those that
/// have any.
cv::Mat1f excessOf(const cv::Mat1f& confidence, int window) {
  cv::Mat1f surroundings;
  cv::GaussianBlur(confidence, surroundings, {window, window}, 0, 0, cv::BORDER_REPLICATE);
  const double mean = cv::mean(confidence, confidence > 0)[0];
  if (!(mean > 0)) return cv::Mat1f::zeros(confidence.size());
  return (confidence - surroundings) / mean;
}

/// Pixels worth looking at.
cv::Mat1b standOut(const cv::Mat1f& excess, double min_excess) {
  cv::Mat1b mask = cv::Mat1b::zeros(excess.size());
  const cv::Rect inner = insideFrame(excess.size());
  if (inner.empty()) return mask;
  cv::compare(excess(inner), min_excess, mask(inner), cv::CMP_GT);
  return mask;
}

/// What is left of a pixel's excess.
double qualityOf(double excess, const AggregatedPeak& peak, const LocalAgreement& around,
                 double place) {
  const double unambiguous = std::sqrt(std::max(0.0, 1.0 - peak.ambiguity));
  const double off_median = std::abs(peak.position - around.median);
  return excess * unambiguous * peak.own * peak.own *
         std::exp(-off_median / (kMedianNear * place)) * around.share;
}

/// Variance of a position, planes^2.
double varianceOf(const AggregatedPeak& peak, const LocalAgreement& around) {
  constexpr double kScale = 0.045;
  constexpr double kLeastSpread = 0.03;
  return kScale * std::sqrt(double{peak.width_sq}) * (around.spread + kLeastSpread);
}

}  // namespace

DepthMap extractAggregated(const SweptDsi& dsi, const DepthPlanes& planes,
                           const DepthExtractionOptions& options) {
  const cv::Mat1f& confidence = dsi.peaks.confidence;
  const cv::Mat1f excess = excessOf(confidence, options.threshold_kernel);
  const KeptPixels looked_at(standOut(excess, options.min_excess));
  const std::vector<AggregatedPeak> peaks = aggregateRays(looked_at, dsi.rays, confidence);

  std::vector<float> positions(looked_at.size());
  std::vector<float> weights(looked_at.size());
  looked_at.forEach([&](std::size_t i, cv::Point at) {
    positions[i] = peaks[i].position;
    weights[i] = excess(at);
  });
  const double place = planesOfOnePlace(planes.size());
  const std::vector<LocalAgreement> around = localAgreement(
      looked_at, confidence.size(), positions, weights, static_cast<float>(kNear * place));

  const bool has_inner_planes = planes.size() > 2;
  cv::Mat1b mask = cv::Mat1b::zeros(confidence.size());
  std::vector<PlanePosition> found;
  looked_at.forEach([&](std::size_t i, cv::Point at) {
    if (has_inner_planes && peaks[i].at_end) return;
    if (!(qualityOf(weights[i], peaks[i], around[i], place) > options.min_quality)) return;
    mask(at) = 255;
    found.push_back({around[i].median, varianceOf(peaks[i], around[i])});
  });
  const KeptPixels kept(mask);
  DepthMap map = depthMapOf(kept, found, confidence, planes);
  if (options.dilate) dilate(kept, mask, map);
  return map;
}

}  // namespace efm
