// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/dsi/dsi_peaks.h"

#include <cassert>

#include "mapping/kernels/peaks.h"

namespace efm {
namespace {

constexpr float kNoValue = -1;

}  // namespace

DsiPeaks unwrittenPeaks(const ReferenceView& view, bool confidence_alone) {
  const cv::Size size(view.width, view.height);
  if (confidence_alone) return {cv::Mat1f(size), {}, {}, {}};
  return {cv::Mat1f(size), cv::Mat1i(size), cv::Mat1f(size), cv::Mat1f(size)};
}

RunningPeaks::RunningPeaks(std::size_t pixels, VotingKernel kernel)
    : functions_(&kernels::peakFunctions(kernel)),
      best_(pixels, kNoValue),
      before_(pixels, kNoValue),
      after_(pixels, kNoValue),
      plane_(pixels, -1),
      previous_(pixels, kNoValue) {}

void RunningPeaks::add(int plane, const PlaneValues& values) {
  assert(values.size() == best_.size());
  functions_->add({best_.data(), plane_.data(), before_.data(), after_.data(), previous_.data()},
                  plane, values.data(), values.size());
}

void RunningPeaks::writeTo(DsiPeaks& images, const cv::Rect& tile) const {
  efm::writeTo(images.confidence(tile), best_);
  if (images.plane.empty()) return;
  efm::writeTo(images.plane(tile), plane_);
  efm::writeTo(images.before(tile), before_);
  efm::writeTo(images.after(tile), after_);
}

}  // namespace efm
