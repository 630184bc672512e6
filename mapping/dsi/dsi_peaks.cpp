// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/dsi/dsi_peaks.h"

#include <algorithm>
#include <cassert>

#include "mapping/kernels/peaks.h"

namespace efm {
namespace {

constexpr float kNoValue = -1;

}  // namespace

DsiPeaks unwrittenPeaks(const ReferenceView& view) {
  const cv::Size size(view.width, view.height);
  return {cv::Mat1f(size), cv::Mat1i(size), cv::Mat1f(size), cv::Mat1f(size)};
}

RunningPeaks::RunningPeaks(std::size_t pixels, VotingKernel kernel)
    : functions_(&kernels::peakFunctions(kernel)),
      best_(pixels, kNoValue),
      before_(pixels, kNoValue),
      after_(pixels, kNoValue),
      plane_(pixels, -1),
      previous_(pixels, kNoValue) {}

void RunningPeaks::take(int plane, const PlaneValues& values) {
  assert(values.size() == best_.size());
  if (first_.empty()) {
    first_ = values;
    first_plane_ = plane;
  }
  functions_->take({best_.data(), plane_.data(), before_.data(), after_.data(), previous_.data()},
                   plane, values.data(), values.size());
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
  DsiPeaks images = unwrittenPeaks(view);
  writeTo(images, {0, 0, view.width, view.height});
  return images;
}

void RunningPeaks::writeTo(DsiPeaks& images, const cv::Rect& tile) const {
  efm::writeTo(images.confidence(tile), best_);
  efm::writeTo(images.plane(tile), plane_);
  efm::writeTo(images.before(tile), before_);
  efm::writeTo(images.after(tile), after_);
}

}  // namespace efm
