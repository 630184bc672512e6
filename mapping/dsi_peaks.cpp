// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/dsi_peaks.h"

#include <algorithm>

namespace efm {
namespace {

constexpr float kNoValue = -1;

template <typename Value>
cv::Mat_<Value> imageOf(const std::vector<Value>& values, const ReferenceView& view) {
  cv::Mat_<Value> image(view.height, view.width);
  std::copy(values.begin(), values.end(), image.begin());
  return image;
}

}  // namespace

RunningPeaks::RunningPeaks(std::size_t pixels)
    : best_(pixels, kNoValue),
      before_(pixels, kNoValue),
      after_(pixels, kNoValue),
      plane_(pixels, -1),
      previous_(pixels, kNoValue) {}

void RunningPeaks::take(int plane, const std::vector<float>& values) {
  if (first_.empty()) {
    first_ = values;
    first_plane_ = plane;
  }
  for (std::size_t i = 0; i < values.size(); ++i) {
    const float value = values[i];
    if (value > best_[i]) {
      best_[i] = value;
      before_[i] = previous_[i];
      after_[i] = kNoValue;
      plane_[i] = plane;
    } else if (plane_[i] == plane - 1) {
      after_[i] = value;
    }
    previous_[i] = value;
  }
}

void RunningPeaks::append(const RunningPeaks& next) {
  for (std::size_t i = 0; i < best_.size(); ++i) {
    if (next.best_[i] > best_[i]) {
      best_[i] = next.best_[i];
      before_[i] = next.plane_[i] == next.first_plane_ ? previous_[i] : next.before_[i];
      after_[i] = next.after_[i];
      plane_[i] = next.plane_[i];
    } else if (plane_[i] == next.first_plane_ - 1) {
      after_[i] = next.first_[i];
    }
  }
  previous_ = next.previous_;
}

DsiPeaks RunningPeaks::images(const ReferenceView& view) const {
  return {imageOf(best_, view), imageOf(plane_, view), imageOf(before_, view),
          imageOf(after_, view)};
}

}  // namespace efm
