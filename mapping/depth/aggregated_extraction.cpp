// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/depth/aggregated_extraction.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cassert>
#include <cmath>

#include "mapping/depth/depth_probability.h"
#include "mapping/depth/neighbour_depths.h"
#include "mapping/depth/peak_fit.h"
#include "mapping/depth/surroundings.h"
#include "mapping/dsi/dsi_grid.h"
#include "mapping/kernels/kernels.h"

namespace efm {
namespace {

constexpr float kSigma_px = 1.5F;
constexpr double kMinFraction = 1.0 / 99;  // the smallest step, of the range of planes

/// Finds the peak of a sum of columns.
class PeakFinder {
 public:
  PeakFinder(int planes, double step_planes)
      : planes_(planes),
        step_planes_(step_planes),
        base_(std::max(1, static_cast<int>(step_planes / (isWide() ? 1 : 4)))) {}

  AggregatedPeak find(const std::vector<float>& sum) const {
    const auto top = std::max_element(sum.begin(), sum.begin() + planes_);
    const auto plane = static_cast<int>(top - sum.begin());
    const float before = plane >= base_ ? sum[static_cast<std::size_t>(plane - base_)] : -1;
    const float after = plane < planes_ - base_ ? sum[static_cast<std::size_t>(plane + base_)] : -1;
    AggregatedPeak peak;
    peak.at_end = before < 0 || after < 0;
    peak.position = static_cast<float>(plane + base_ * peakPosition(0, before, *top, after));
    peak.width_sq = static_cast<float>(base_ * base_) * peakWidthSquared(before, *top, after);
    // The distances decrease: each round adds the planes between two distances.
    float second = 0;
    int left = 0;
    int right = planes_;
    for (std::size_t i = peak.second_peak.size(); i-- > 0;) {
      const double steps = AggregatedPeak::kMinSteps + static_cast<double>(i);
      const auto distance = static_cast<int>(std::lround(steps * step_planes_));
      second = std::max({second, maximumOf(sum, left, plane - distance),
                         maximumOf(sum, plane + distance + 1, right)});
      left = std::max(left, plane - distance);
      right = std::min(right, plane + distance + 1);
      peak.second_peak[i] = *top > 0 ? second / *top : 1;
    }
    return peak;
  }

 private:
  /// Returns whether a step is more than a hundredth of the range: the parallax is small.
  bool isWide() const { return step_planes_ > 1.001 * kMinFraction * (planes_ - 1); }
  static float maximumOf(const std::vector<float>& sum, int begin, int end) {
    return begin >= end ? 0 : *std::max_element(sum.begin() + begin, sum.begin() + end);
  }

  int planes_;
  double step_planes_;
  /// Distance in planes from the peak to the other two values of its parabola. With over 800
  /// planes, or little parallax, values on adjacent planes differ by less than one step of a byte.
  int base_;
};

}  // namespace

double planesPerStep(int planes, double range_px) {
  constexpr double kStepPx = 0.125;
  constexpr double kMaxFraction = 1.0 / 24;
  const double intervals = planes - 1;
  if (intervals < 2) return 1;
  const double step = intervals * std::clamp(kStepPx / range_px, kMinFraction, kMaxFraction);
  // At least one plane, but less if planes are closer than a quarter of a pixel.
  const double px_per_plane = range_px / intervals;
  return std::max(step, std::min(1.0, 4 * px_per_plane));
}

std::vector<AggregatedPeak> aggregateColumns(const SparseMask& candidates,
                                             const DsiColumns& columns, double step_planes) {
  const PeakFinder finder(columns.planes(), step_planes);
  std::vector<AggregatedPeak> peaks(candidates.size());
  const auto weights = PixelNeighbours::gaussian(kSigma_px);
  tbb::parallel_for(tbb::blocked_range<int>(0, candidates.rows()), [&](const auto& rows) {
    PixelNeighbours neighbours(candidates);
    std::vector<float> sum(static_cast<std::size_t>(columns.planes()) + kernels::kColumnPadding);
    for (int y = rows.begin(); y < rows.end(); ++y) {
      for (std::size_t i = candidates.rowBegin(y); i < candidates.rowBegin(y + 1); ++i) {
        const cv::Point pixel(candidates.column(i), y);
        assert(columns.has(pixel));
        std::fill(sum.begin(), sum.end(), 0.0F);
        neighbours.forEach(pixel, [&](std::size_t, cv::Point offset) {
          columns.addTo(sum.data(), pixel + offset,
                        weights[static_cast<std::size_t>(offset.dot(offset))]);
        });
        peaks[i] = finder.find(sum);
      }
    }
  });
  return peaks;
}

namespace {

/// Sigma of the Gaussian weight of other pixels, by their distance.
constexpr float kDistanceSigma_px = 2;

}  // namespace

std::vector<LocalAgreement> localAgreement(const SparseMask& mask,
                                           const std::vector<float>& positions,
                                           const std::vector<float>& weights, float near) {
  auto by_distance = PixelNeighbours::gaussian(kDistanceSigma_px);
  by_distance[0] = 0;  // the pixel itself
  std::vector<LocalAgreement> agreement(mask.size());
  tbb::parallel_for(tbb::blocked_range<int>(0, mask.rows()), [&](const auto& rows) {
    PixelNeighbours neighbours(mask);
    Surroundings around;
    for (int y = rows.begin(); y < rows.end(); ++y) {
      for (std::size_t i = mask.rowBegin(y); i < mask.rowBegin(y + 1); ++i) {
        around.clear();
        float agreeing = 0;
        float others = 0;
        neighbours.forEach({mask.column(i), y}, [&](std::size_t j, cv::Point offset) {
          around.add(positions[j], weights[j]);
          const float weight =
              weights[j] * by_distance[static_cast<std::size_t>(offset.dot(offset))];
          others += weight;
          if (!(std::abs(positions[j] - positions[i]) < near)) return;
          agreeing += weight;
          agreement[i].agreeing += j == i ? 0 : 1;
        });
        agreement[i].median = around.weightedMedian();
        agreement[i].spread = around.medianDistance(agreement[i].median);
        agreement[i].agreeing_fraction = others > 0 ? agreeing / others : 0;
      }
    }
  });
  return agreement;
}

cv::Mat1f localContrast(const cv::Mat1f& confidence, int window) {
  cv::Mat1f surroundings;
  cv::GaussianBlur(confidence, surroundings, {window, window}, 0, 0, cv::BORDER_REPLICATE);
  const double mean = cv::mean(confidence, confidence > 0)[0];
  if (!(mean > 0)) return cv::Mat1f::zeros(confidence.size());
  return (confidence - surroundings) / mean;
}

namespace {

// A step: see `planesPerStep`.
constexpr double kAgreementSteps = 2.5;  ///< Depths within this distance agree.
constexpr double kPeakWidths = 1.6;      ///< Half size of a peak, in median widths of all peaks.

cv::Mat1b aboveContrast(const cv::Mat1f& contrast, double min_contrast) {
  cv::Mat1b mask = cv::Mat1b::zeros(contrast.size());
  const cv::Rect inner = insideFrame(contrast.size());
  if (inner.empty()) return mask;
  cv::compare(contrast(inner), min_contrast, mask(inner), cv::CMP_GT);
  return mask;
}

/// Returns the distance where the peaks of the keyframe end: with a short baseline, peaks are wide.
/// @return an index into `AggregatedPeak::second_peak`.
std::size_t peakEnd(const std::vector<AggregatedPeak>& peaks, double step_planes) {
  if (peaks.empty()) return 0;
  std::vector<float> widths_sq;
  for (const AggregatedPeak& peak : peaks) widths_sq.push_back(peak.width_sq);
  const double steps =
      std::clamp(std::round(kPeakWidths * std::sqrt(upperMedian(widths_sq)) / step_planes),
                 double{AggregatedPeak::kMinSteps}, double{AggregatedPeak::kMaxSteps});
  return static_cast<std::size_t>(steps) - AggregatedPeak::kMinSteps;
}

/// Returns the variance of a position, planes^2. It grows with the width of the peak and with the
/// spread of the depths around it; its minimum is about (0.1 planes)^2. It is fitted to the errors
/// of the simulated presets up to VGA: on new seeds of these presets, 54 to 82 % of the depths lie
/// within one standard deviation of the truth and 83 to 94 % within two.
double varianceOf(const AggregatedPeak& peak, const LocalAgreement& around) {
  constexpr double kMinSigma = 0.09;
  constexpr double kWidthTimesSpread = 0.0143;
  constexpr double kMinSpread = 0.03;
  return kMinSigma * kMinSigma + kWidthTimesSpread * peak.width_sq * (around.spread + kMinSpread);
}

CandidateInputs inputsOf(float contrast, float second_peak, const AggregatedPeak& peak,
                         const LocalAgreement& around, const DepthPlanes& planes,
                         double step_planes) {
  const auto step = static_cast<float>(step_planes);
  return {std::log(contrast),
          std::log(1.01F - std::min(second_peak, 0.999F)),
          std::log(around.agreeing_fraction + 0.05F),
          std::log(1.0F + static_cast<float>(around.agreeing)),
          std::log(around.spread / step + 0.1F),
          std::log(std::min(std::sqrt(peak.width_sq) / step, 50.0F) + 0.1F),
          std::log(stepsOfTenPercent(around.median, planes, step_planes))};
}

/// Returns the pixels that may get a depth from the candidates around them: those that touch a
/// candidate, and candidates without a depth of their own.
cv::Mat1b neighbourMask(const SparseMask& candidates, const std::vector<PlanePosition>& depths,
                        const cv::Mat1f& confidence) {
  cv::Mat1b touching = cv::Mat1b::zeros(confidence.size());
  candidates.forEach([&](std::size_t, cv::Point at) {
    touching(cv::Rect(at.x - 1, at.y - 1, 3, 3)) = 255;  // candidates lie inside the frame
  });
  candidates.forEach([&](std::size_t i, cv::Point at) {
    if (depths[i].probability > 0) touching(at) = 0;
  });
  cv::Mat1b mask = cv::Mat1b::zeros(confidence.size());
  const cv::Rect inner = insideFrame(confidence.size());
  if (!inner.empty()) cv::Mat(touching & (confidence > 0))(inner).copyTo(mask(inner));
  return mask;
}

/// The probability of a candidate at an end plane or with a flat column. It is not kept, but its
/// neighbours use it.
constexpr float kProbabilityWithoutPeak = 0.01F;
constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
/// From this second peak on, as a fraction of the peak, a column is flat.
constexpr float kFlatColumn = 0.98F;

template <typename Inputs>
std::vector<PixelEvidence<Inputs>> evidenceOf(const SparseMask& mask,
                                              const std::vector<PlanePosition>& positions,
                                              const std::vector<Inputs>& inputs,
                                              const DepthPlanes& planes) {
  std::vector<PixelEvidence<Inputs>> evidence;
  mask.forEach([&](std::size_t i, cv::Point at) {
    const auto& [position, variance, probability] = positions[i];
    const double sigma = std::sqrt(variance) * planes.inverseDepthStepAt(position);
    const double depth_m = planes.depthAt(position);
    evidence.push_back({at.x, at.y, static_cast<float>(depth_m),
                        static_cast<float>(depth_m * depth_m * sigma), probability, inputs[i]});
  });
  return evidence;
}

}  // namespace

DepthMap extractAggregated(const SweptDsi& dsi, const DepthPlanes& planes,
                           const DepthExtractionOptions& options, double parallax_px_m) {
  const cv::Mat1f& confidence = dsi.peaks.confidence;
  const cv::Mat1f contrast = localContrast(confidence, options.threshold_kernel);
  const SparseMask candidates(aboveContrast(contrast, options.min_local_contrast));
  const double range_px =
      parallax_px_m * (1 / planes.depth(0) - 1 / planes.depth(planes.size() - 1));
  const double step_planes = planesPerStep(planes.size(), range_px);
  const std::vector<AggregatedPeak> peaks = aggregateColumns(candidates, dsi.columns, step_planes);

  std::vector<float> positions(candidates.size());
  std::vector<float> weights(candidates.size());
  candidates.forEach([&](std::size_t i, cv::Point at) {
    positions[i] = peaks[i].position;
    weights[i] = contrast(at);
  });
  const std::size_t second = peakEnd(peaks, step_planes);
  const auto near = static_cast<float>(kAgreementSteps * step_planes);
  const std::vector<LocalAgreement> around = localAgreement(candidates, positions, weights, near);

  const bool has_inner_planes = planes.size() > 2;
  // Depths are unobservable if all planes lie within a pixel of parallax.
  const bool all_alike = has_inner_planes && range_px < 1;
  PixelCounts counts;
  counts.candidates = candidates.size();
  std::vector<CandidateInputs> inputs(candidates.size());
  std::vector<PlanePosition> depths(candidates.size());
  CandidateDepths seen{&candidates, std::move(positions), std::move(weights),
                       std::vector<float>(candidates.size()),
                       std::vector<double>(candidates.size())};
  tbb::parallel_for(std::size_t{0}, candidates.size(), [&](std::size_t i) {
    const float second_peak = peaks[i].second_peak[second];
    inputs[i] = inputsOf(seen.contrasts[i], second_peak, peaks[i], around[i], planes, step_planes);
    const bool at_end = has_inner_planes && peaks[i].at_end;
    const bool has_peak = !at_end && second_peak < kFlatColumn;
    const bool has_depth = has_peak && around[i].agreeing > 0;
    const float probability = has_inner_planes ? probabilityOf(inputs[i]) : kUnknown;
    seen.probabilities[i] = has_peak ? probability : kProbabilityWithoutPeak;
    seen.variances[i] = varianceOf(peaks[i], around[i]);
    depths[i] = {around[i].median, seen.variances[i], has_depth ? seen.probabilities[i] : 0};
  });
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (has_inner_planes && peaks[i].at_end) {
      ++(2 * peaks[i].position < float(planes.size()) ? counts.at_nearest : counts.at_farthest);
    } else if (all_alike || depths[i].probability <= options.min_probability) {
      ++counts.ambiguous;
    }
  }
  DepthMap map = emptyDepthMap(confidence);
  map.pixels = counts;
  if (all_alike) return map;
  addDepths(candidates, depths, planes, options.min_probability, map);
  DepthEvidence evidence;
  if (options.keep_evidence) evidence.candidates = evidenceOf(candidates, depths, inputs, planes);
  if (options.neighbours && has_inner_planes) {
    const SparseMask pixels(neighbourMask(candidates, depths, confidence));
    const NeighbourDepths beside =
        neighbourDepths(pixels, seen, confidence, planes, step_planes, near);
    map.pixels.neighbours =
        addDepths(pixels, beside.positions, planes, options.min_probability, map);
    if (options.keep_evidence) {
      evidence.neighbours = evidenceOf(pixels, beside.positions, beside.inputs, planes);
    }
  }
  if (options.keep_evidence) map.evidence = std::make_shared<DepthEvidence>(std::move(evidence));
  return map;
}

}  // namespace efm
