// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <opencv2/core.hpp>
#include <vector>

#include "mapping/geometry/reference_view.h"

namespace efm {

/// Small pictures of a keyframe, PNG files of the same size.
struct KeyframePicture {
  std::vector<std::uint8_t> depth;
  std::vector<std::uint8_t> events;  ///< Empty where none are known.

  std::size_t bytes() const { return depth.size() + events.size(); }
};

/// Small pictures of the keyframes' depth maps and events, for the page. Memory is bounded: where
/// all pictures together exceed `max_bytes`, those of every second keyframe are removed, and from
/// then on only keyframes of the doubled stride get some. One thread at a time.
class KeyframePictures {
 public:
  static constexpr int kMaxWidth = 360;  ///< Pixels: sensors up to this width keep their size.
  static constexpr std::size_t kDefaultMaxBytes = 5'000'000;

  /// @param limits the colours run between its depths.
  explicit KeyframePictures(const DepthPlanesOptions& limits,
                            std::size_t max_bytes = kDefaultMaxBytes)
      : limits_(limits), max_bytes_(max_bytes) {}

  /// Adds the next keyframe. Keyframes are numbered from 0.
  /// @param events `KeyframeDepthMap::view_events`: of the depth map's size, or empty.
  void add(const cv::Mat1f& depth_m, const cv::Mat_<cv::Vec2i>& events);

  /// The pictures by the numbers of their keyframes.
  const std::map<std::size_t, KeyframePicture>& pictures() const { return pictures_; }
  const DepthPlanesOptions& limits() const { return limits_; }

 private:
  DepthPlanesOptions limits_;
  std::size_t max_bytes_;
  std::size_t keyframes_ = 0;
  std::size_t stride_ = 1;
  std::size_t bytes_ = 0;
  std::map<std::size_t, KeyframePicture> pictures_;
};

}  // namespace efm
