// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "mapping/geometry/reference_view.h"

namespace efm {

/// Depth maps of keyframes evenly over a run, and a sheet of them. Memory is bounded: at most
/// `kMaxKept` small depth maps; where these are full, every second one is removed, and from then on
/// only keyframes of the doubled stride are kept. One thread at a time.
class KeyframeSheet {
 public:
  static constexpr std::size_t kMaxShown = 12;
  static constexpr std::size_t kMaxKept = 2 * kMaxShown;
  static constexpr int kMaxWidth = 360;  ///< Pixels: wider depth maps are reduced.

  /// Adds the next keyframe.
  void add(std::int64_t t_ref_ns, const cv::Mat1f& depth_m);

  /// Up to `kMaxShown` depth maps with their times in seconds, and one colour bar in metres.
  /// @param limits the colours run between its depths.
  /// @throws std::logic_error if there is no keyframe.
  cv::Mat3b draw(const DepthPlanesOptions& limits) const;

 private:
  struct Kept {
    std::int64_t t_ref_ns = 0;
    cv::Mat1f depth_m;
  };

  std::vector<Kept> kept_;
  std::size_t keyframes_ = 0;
  std::size_t stride_ = 1;
};

}  // namespace efm
