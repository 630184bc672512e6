// SPDX-License-Identifier: BSD-3-Clause
#include "test/studies/frames/frame_depth.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "mapping/base/option.h"
#include "mapping/depth/depth_extraction.h"
#include "mapping/depth/peak_fit.h"
#include "test/studies/frames/edge_kinds.h"
#include "test/studies/frames/frame_sweep.h"

namespace efm::studies {
namespace {

FrameSweepOptions sweepOptionsOf(const FrameDepthOptions& options) {
  return {options.min_baseline_m, options.max_baseline_m, options.max_frames,
          options.window_sigmas_px};
}

/// For one size of the window.
using ScoreVolume = std::vector<cv::Mat1f>;  // per plane

std::vector<ScoreVolume> sweep(const FrameSweep& frames, const DepthPlanes& planes,
                               std::size_t windows) {
  const auto count = static_cast<std::size_t>(planes.size());
  std::vector<ScoreVolume> volumes(windows);
  for (ScoreVolume& volume : volumes) volume.resize(count);
  cv::parallel_for_({0, planes.size()}, [&](const cv::Range& range) {
    for (int plane = range.start; plane < range.end; ++plane) {
      auto scores = frames.scoresAt(planes.depth(plane));
      for (std::size_t w = 0; w < scores.size(); ++w) {
        volumes[w][static_cast<std::size_t>(plane)] = scores[w];
      }
    }
  });
  return volumes;
}

/// The best plane of a pixel for one size of the window.
struct Peak {
  int plane = 0;
  float score = -1;
  float margin = 0;
  double depth_m = 0;
};

Peak peakAt(const ScoreVolume& volume, const DepthPlanes& planes, cv::Point pixel,
            double separation) {
  const auto at = [&](int plane) { return volume[static_cast<std::size_t>(plane)](pixel); };
  Peak peak;
  for (int plane = 0; plane < planes.size(); ++plane) {
    if (at(plane) > peak.score) {
      peak.plane = plane;
      peak.score = at(plane);
    }
  }
  if (peak.score <= -1) return peak;
  const int last = planes.size() - 1;
  const double position =
      peakPosition(peak.plane, peak.plane > 0 ? at(peak.plane - 1) : peak.score, peak.score,
                   peak.plane < last ? at(peak.plane + 1) : peak.score);
  const bool inside = peak.plane > 0 && peak.plane < last;
  peak.depth_m = planes.depthAt(inside ? position : peak.plane);
  if (!inside) return peak;  // the depth may be outside of the planes: no margin
  float rival = -1;
  for (int plane = 0; plane < planes.size(); ++plane) {
    if (std::abs(planes.depth(plane) / peak.depth_m - 1) > separation) {
      rival = std::max(rival, at(plane));
    }
  }
  peak.margin = peak.score - rival;
  return peak;
}

FrameDepth depthOf(const FrameSweep& frames, const FrameDepthOptions& options) {
  const DepthPlanes planes(options.planes);
  const std::vector<ScoreVolume> volumes = sweep(frames, planes, options.window_sigmas_px.size());
  const cv::Size size(frames.view().width, frames.view().height);
  FrameDepth result{cv::Mat1f(size, 0.0F), cv::Mat1f(size, 0.0F), cv::Mat1f(size, -1.0F),
                    cv::Mat1f(size, 0.0F), cv::Mat1f()};
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      for (const ScoreVolume& volume : volumes) {
        const Peak peak = peakAt(volume, planes, {x, y}, options.separation);
        if (peak.score <= -1) continue;
        result.likely(y, x) = static_cast<float>(peak.depth_m);
        result.score(y, x) = peak.score;
        result.margin(y, x) = peak.margin;
        if (peak.score < options.min_score || peak.margin < options.min_margin) continue;
        result.depth(y, x) = static_cast<float>(peak.depth_m);
        break;
      }
    }
  }
  return result;
}

/// 255 on edges of the key frame; 0 on even areas, also next to strong edges.
cv::Mat1b onEdges(const cv::Mat1f& grey, const FrameDepthOptions& options) {
  const cv::Mat1f magnitude = imageGradient(grey, 1).magnitude;
  const int side = 2 * options.shadow_px + 1;
  cv::Mat1f strongest;
  cv::dilate(magnitude, strongest, cv::Mat1b(side, side, 1));
  return (magnitude >= options.min_gradient) & (magnitude >= options.ridge_fraction * strongest);
}

/// Interpolates between two pixels of about the same depth, linearly in inverse depth.
void fillGaps(const cv::Mat1f& sure, cv::Point step, const FrameDepthOptions& options,
              cv::Mat1f& depth) {
  const cv::Rect image(0, 0, sure.cols, sure.rows);
  for (int y = 0; y < sure.rows; ++y) {
    for (int x = 0; x < sure.cols; ++x) {
      const cv::Point from(x, y);
      if (!(sure(from) > 0)) continue;
      int length = 1;
      while (length <= options.max_gap_px && image.contains(from + length * step) &&
             !(sure(from + length * step) > 0)) {
        ++length;
      }
      const cv::Point to = from + length * step;
      if (length == 1 || length > options.max_gap_px || !image.contains(to)) continue;
      const double begin = 1 / static_cast<double>(sure(from));
      const double end = 1 / static_cast<double>(sure(to));
      if (std::abs(begin / end - 1) > options.separation) continue;
      for (int k = 1; k < length; ++k) {
        const double fraction = static_cast<double>(k) / length;
        depth(from + k * step) = static_cast<float>(1 / (begin + fraction * (end - begin)));
      }
    }
  }
}

/// Whether the depth of the second view agrees at the point, within a pixel.
bool agrees(const Eigen::Vector3d& p_second, const ReferenceView& view, const cv::Mat1f& depth,
            double max_disagreement) {
  const Eigen::Vector2d pixel = view.project(p_second);
  const int column = static_cast<int>(std::lround(pixel.x()));
  const int row = static_cast<int>(std::lround(pixel.y()));
  for (int y = std::max(0, row - 1); y <= std::min(depth.rows - 1, row + 1); ++y) {
    for (int x = std::max(0, column - 1); x <= std::min(depth.cols - 1, column + 1); ++x) {
      const double ratio = static_cast<double>(depth(y, x)) / p_second.z();
      if (std::abs(ratio - 1) <= max_disagreement) return true;
    }
  }
  return false;
}

/// A frame warped to the view with the view's depth, or with the median depth where there is none.
/// At a distance of a few millimetres the depth hardly matters.
cv::Mat1f seenFrom(const ReferenceView& view, const Rigid3& T_world_ref, const PosedFrames& frames,
                   std::size_t key, const cv::Mat1f& depth_m) {
  const PosedFrame& frame = frames.frames[key];
  cv::Mat1f smooth;
  cv::medianBlur(depth_m, smooth, 5);
  std::vector<float> known;
  std::copy_if(smooth.begin(), smooth.end(), std::back_inserter(known),
               [](float z) { return z > 0; });
  if (known.empty()) throw std::runtime_error("the frames see nothing that the view sees");
  const float middle = upperMedian(known);
  const Rigid3 T_cam_ref = frame.T_world_cam.inverse() * T_world_ref;
  cv::Mat2f source(view.height, view.width);
  for (int y = 0; y < view.height; ++y) {
    for (int x = 0; x < view.width; ++x) {
      const float z = smooth(y, x) > 0 ? smooth(y, x) : middle;
      const Eigen::Vector2d pixel =
          frames.view.project(T_cam_ref * view.pointAt(x, y, static_cast<double>(z)));
      source(y, x) = {static_cast<float>(pixel.x()), static_cast<float>(pixel.y())};
    }
  }
  cv::Mat1f seen;
  cv::remap(frame.image, seen, source, cv::noArray(), cv::INTER_CUBIC, cv::BORDER_REPLICATE);
  return seen;
}

/// The frame whose distance from the view is closest to `distance_m`.
std::size_t frameAtDistance(const PosedFrames& sequence, const Rigid3& T_world_ref,
                            double distance_m) {
  const auto miss = [&](const PosedFrame& frame) {
    const double is_m = (frame.T_world_cam.translation - T_world_ref.translation).norm();
    return std::abs(is_m - distance_m);
  };
  const auto nearest =
      std::min_element(sequence.frames.begin(), sequence.frames.end(),
                       [&](const PosedFrame& a, const PosedFrame& b) { return miss(a) < miss(b); });
  return static_cast<std::size_t>(nearest - sequence.frames.begin());
}

}  // namespace

void FrameDepthOptions::validate() const {
  planes.validate();
  requireOption(min_baseline_m >= 0, "min_baseline_m", min_baseline_m, "0 or above");
  requireOption(max_baseline_m > min_baseline_m, "max_baseline_m", max_baseline_m,
                "above min_baseline_m");
  requireOption(max_frames >= FrameSweep::kMinFrames, "max_frames", max_frames, "at least 2");
  requireOption(!window_sigmas_px.empty(), "window_sigmas_px (how many)", window_sigmas_px.size(),
                "at least 1");
  for (const double sigma_px : window_sigmas_px) {
    requireOption(sigma_px > 0 && sigma_px <= 50, "window_sigmas_px", sigma_px, "above 0, to 50");
  }
  requireOption(ridge_fraction >= 0 && ridge_fraction <= 1, "ridge_fraction", ridge_fraction,
                "from 0 to 1");
  requireOption(shadow_px >= 0 && shadow_px <= 50, "shadow_px", shadow_px, "from 0 to 50");
  requireOption(max_gap_px >= 0, "max_gap_px", max_gap_px, "0 or above");
  requireOption(separation > 0 && separation < 1, "separation", separation, "between 0 and 1");
  requireOption(max_disagreement > 0, "max_disagreement", max_disagreement, "above 0");
  requireOption(check_baseline_m > 0, "check_baseline_m", check_baseline_m, "above 0");
}

FrameDepth frameDepth(const PosedFrames& sequence, std::size_t key, const ReferenceView& view,
                      const Rigid3& T_world_ref, const FrameDepthOptions& options) {
  options.validate();
  FrameDepth result =
      depthOf(FrameSweep(sequence, key, view, T_world_ref, sweepOptionsOf(options)), options);

  const std::size_t second = frameAtDistance(sequence, T_world_ref, options.check_baseline_m);
  const Rigid3& T_world_second = sequence.frames[second].T_world_cam;
  const FrameDepth checked =
      depthOf(FrameSweep(sequence, second, view, T_world_second, sweepOptionsOf(options)), options);
  const Rigid3 T_second_ref = T_world_second.inverse() * T_world_ref;
  for (int y = 0; y < view.height; ++y) {
    for (int x = 0; x < view.width; ++x) {
      if (!(result.depth(y, x) > 0)) continue;
      const Eigen::Vector3d p_second =
          T_second_ref * view.pointAt(x, y, static_cast<double>(result.depth(y, x)));
      if (!agrees(p_second, view, checked.likely, options.max_disagreement)) result.depth(y, x) = 0;
    }
  }
  result.grey = seenFrom(view, T_world_ref, sequence, key, result.likely);
  result.depth.setTo(0, ~onEdges(result.grey, options));
  const cv::Mat1f sure = result.depth.clone();
  fillGaps(sure, {1, 0}, options, result.depth);
  fillGaps(sure, {0, 1}, options, result.depth);
  return result;
}

}  // namespace efm::studies
