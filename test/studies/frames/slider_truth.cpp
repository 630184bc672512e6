// SPDX-License-Identifier: BSD-3-Clause
#include "test/studies/frames/slider_truth.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "mapping/depth/peak_fit.h"
#include "maps/metrics/depth_metrics.h"
#include "test/studies/frames/posed_frames.h"

namespace efm::studies {
namespace {

/// The pixels of one kind.
cv::Mat1f ofKind(const cv::Mat1f& depth_m, const EdgeKinds& edges, EdgeKind kind) {
  cv::Mat1f some(depth_m.size(), 0.0F);
  for (int y = 0; y < depth_m.rows; ++y) {
    for (int x = 0; x < depth_m.cols; ++x) {
      if (depth_m(y, x) > 0 && edges.kindNear(x, y) == kind) some(y, x) = depth_m(y, x);
    }
  }
  return some;
}

std::vector<double> relativeErrors(const cv::Mat1f& depth_m, const cv::Mat1f& truth_m) {
  DepthPairingOptions pairing;
  pairing.tolerance_px = 1;
  std::vector<double> errors;
  for (const DepthPair& pair : pairDepths({depth_m, truth_m}, pairing)) {
    errors.push_back(std::abs(pair.estimate_m / pair.truth_m - 1));
  }
  return errors;
}

double fractionBeyond(const std::vector<double>& errors, double limit) {
  const auto beyond =
      std::count_if(errors.begin(), errors.end(), [&](double error) { return error > limit; });
  return errors.empty() ? 0 : static_cast<double>(beyond) / static_cast<double>(errors.size());
}

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  return upperMedian(values);
}

double fraction(int part, int whole) {
  return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : 0;
}

}  // namespace

SliderTruth sliderTruth(const std::filesystem::path& folder, const ReferenceView& view,
                        const Rigid3& T_world_ref, std::int64_t t_ref_ns,
                        const FrameDepthOptions& options) {
  const PosedFrames frames = readUzhFrames(folder);
  const std::size_t key = frames.nearestTo(t_ref_ns);
  SliderTruth truth;
  truth.frames = frameDepth(frames, key, view, T_world_ref, options);
  truth.edges = edgeKinds(truth.frames.grey);
  return truth;
}

SliderScore scoreOnSlider(const cv::Mat1f& depth_m, const SliderTruth& truth) {
  const cv::Mat1f& truth_m = truth.frames.depth;
  const std::vector<double> errors = relativeErrors(depth_m, truth_m);
  const cv::Mat1f on_vertical = ofKind(depth_m, truth.edges, EdgeKind::kVertical);
  const cv::Mat1f on_horizontal = ofKind(depth_m, truth.edges, EdgeKind::kHorizontal);
  const cv::Mat1b points = depth_m > 0;
  cv::Mat1b near_point;
  cv::dilate(points, near_point, cv::Mat1b(3, 3, 1));

  SliderScore score;
  score.points = static_cast<std::uint64_t>(cv::countNonZero(points));
  score.with_truth = errors.size();
  score.median_error = median(errors);
  score.beyond_10 = fractionBeyond(errors, 0.1);
  score.vertical_beyond_10 = fractionBeyond(relativeErrors(on_vertical, truth_m), 0.1);
  score.horizontal_beyond_10 = fractionBeyond(relativeErrors(on_horizontal, truth_m), 0.1);
  score.on_horizontal = fraction(cv::countNonZero(on_horizontal), cv::countNonZero(points));
  score.vertical_covered = fraction(cv::countNonZero(truth.edges.vertical_lines & near_point),
                                    cv::countNonZero(truth.edges.vertical_lines));
  return score;
}

}  // namespace efm::studies
