// SPDX-License-Identifier: BSD-3-Clause
#include "test/studies/frames/frame_sweep.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <opencv2/imgproc.hpp>

namespace efm::studies {
namespace {

/// Prevents random correlation of windows without contrast. Squared grey values.
constexpr double kNoiseVariance = 1.0;
/// The correlation of a frame that sees a part of the window only.
constexpr float kUnseen = -2.0F;

cv::Mat1f blurred(const cv::Mat1f& image, double sigma_px) {
  cv::Mat1f result;
  cv::GaussianBlur(image, result, {0, 0}, sigma_px, sigma_px, cv::BORDER_REPLICATE);
  return result;
}

/// The matrix K of a view.
Eigen::Matrix3d intrinsicsOf(const ReferenceView& view) {
  Eigen::Matrix3d intrinsics = Eigen::Matrix3d::Identity();
  intrinsics.diagonal().head<2>() << view.fx, view.fy;
  intrinsics.col(2).head<2>() << view.cx, view.cy;
  return intrinsics;
}

/// The homography of the plane at a depth of frame `ref`: p_cam = R p_ref + t = (R + t n^T / d)
/// p_ref with n = (0, 0, 1).
Eigen::Matrix3d homographyOver(double depth_m, const Rigid3& T_cam_ref) {
  Eigen::Matrix3d H_cam_ref = T_cam_ref.rotation.toRotationMatrix();
  H_cam_ref.col(2) += T_cam_ref.translation / depth_m;
  return H_cam_ref;
}

float meanOfBetterHalf(std::vector<float>& values) {
  const std::size_t half = (values.size() + 1) / 2;
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(half - 1),
                   values.end(), std::greater<>());
  float sum = 0;
  for (std::size_t i = 0; i < half; ++i) sum += values[i];
  return sum / static_cast<float>(half);
}

}  // namespace

FrameSweep::FrameSweep(const PosedFrames& sequence, std::size_t key, const ReferenceView& view,
                       const Rigid3& T_world_ref, const FrameSweepOptions& options)
    : frame_view_(sequence.view),
      view_(view),
      T_world_ref_(T_world_ref),
      sigmas_px_(options.window_sigmas_px) {
  key_ = sourceOf(sequence.frames[key]);
  std::vector<std::size_t> usable;
  for (std::size_t i = 0; i < sequence.frames.size(); ++i) {
    const double baseline_m =
        (sequence.frames[i].T_world_cam.translation - T_world_ref.translation).norm();
    const bool in_range =
        baseline_m >= options.min_baseline_m && baseline_m <= options.max_baseline_m;
    if (i != key && in_range) usable.push_back(i);
  }
  const auto wanted = static_cast<std::size_t>(options.max_frames);
  const std::size_t count = std::min(wanted, usable.size());
  for (std::size_t k = 0; k < count; ++k) {
    others_.push_back(sourceOf(sequence.frames[usable[k * usable.size() / count]]));
  }
}

std::vector<cv::Mat1f> FrameSweep::scoresAt(double depth_m) const {
  const WarpedFrame key = warp(key_, depth_m);
  std::vector<WarpedFrame> others;
  for (const Source& other : others_) others.push_back(warp(other, depth_m));
  std::vector<cv::Mat1f> scores;
  for (std::size_t w = 0; w < sigmas_px_.size(); ++w) scores.push_back(correlate(key, others, w));
  return scores;
}

FrameSweep::Source FrameSweep::sourceOf(const PosedFrame& frame) const {
  Source source{&frame, {}};
  for (const double sigma_px : sigmas_px_) {
    const int side = 2 * static_cast<int>(std::lround(2 * sigma_px)) + 1;
    cv::Mat1b seen;
    cv::erode(frame.seen, seen, cv::Mat1b(side, side, 1), {-1, -1}, 1, cv::BORDER_CONSTANT, 0);
    source.seen.push_back(seen);
  }
  return source;
}

FrameSweep::WarpedFrame FrameSweep::warp(const Source& source, double depth_m) const {
  const Eigen::Matrix3d H_frame_view =
      intrinsicsOf(frame_view_) *
      homographyOver(depth_m, source.frame->T_world_cam.inverse() * T_world_ref_) *
      intrinsicsOf(view_).inverse();
  cv::Matx33d pixel_map;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) pixel_map(r, c) = H_frame_view(r, c);
  }
  const cv::Size size(view_.width, view_.height);
  WarpedFrame warped;
  cv::warpPerspective(source.frame->image, warped.image, pixel_map, size,
                      cv::INTER_CUBIC | cv::WARP_INVERSE_MAP, cv::BORDER_REPLICATE);
  for (const cv::Mat1b& whole : source.seen) {
    cv::Mat1b seen;
    cv::warpPerspective(whole, seen, pixel_map, size, cv::INTER_NEAREST | cv::WARP_INVERSE_MAP,
                        cv::BORDER_CONSTANT, 0);
    warped.seen.push_back(seen);
  }
  return warped;
}

/// @param window index of its size.
cv::Mat1f FrameSweep::correlate(const WarpedFrame& key, const std::vector<WarpedFrame>& others,
                                std::size_t window) const {
  const double sigma_px = sigmas_px_[window];
  const cv::Mat1f mean = blurred(key.image, sigma_px);
  const cv::Mat1f variance =
      blurred(key.image.mul(key.image), sigma_px) - cv::Mat1f(mean.mul(mean));
  std::vector<cv::Mat1f> correlations;
  for (const WarpedFrame& other : others) {
    const cv::Mat1f other_mean = blurred(other.image, sigma_px);
    const cv::Mat1f other_variance =
        blurred(other.image.mul(other.image), sigma_px) - cv::Mat1f(other_mean.mul(other_mean));
    const cv::Mat1f covariance =
        blurred(key.image.mul(other.image), sigma_px) - cv::Mat1f(mean.mul(other_mean));
    const cv::Mat1b seen = key.seen[window] & other.seen[window];
    cv::Mat1f correlation;
    cv::sqrt(
        (cv::max(variance, 0) + kNoiseVariance).mul(cv::max(other_variance, 0) + kNoiseVariance),
        correlation);
    correlation = covariance / correlation;
    correlation.setTo(kUnseen, ~seen);
    correlations.push_back(correlation);
  }
  cv::Mat1f score(mean.size(), -1.0F);
  std::vector<float> of_pixel;
  for (int y = 0; y < mean.rows; ++y) {
    for (int x = 0; x < mean.cols; ++x) {
      of_pixel.clear();
      for (const cv::Mat1f& correlation : correlations) {
        if (correlation(y, x) > kUnseen) of_pixel.push_back(correlation(y, x));
      }
      if (of_pixel.size() < kMinFrames) continue;
      score(y, x) = meanOfBetterHalf(of_pixel);
    }
  }
  return score;
}

}  // namespace efm::studies
