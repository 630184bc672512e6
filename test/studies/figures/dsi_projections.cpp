// SPDX-License-Identifier: BSD-3-Clause
#include "test/studies/figures/dsi_projections.h"

#include <opencv2/imgproc.hpp>

namespace efm::studies {

DsiProjections::DsiProjections(const DepthPlanes& planes, const ReferenceView& view)
    : front_(view.height, view.width, 0.0F),
      top_(planes.size(), view.width, 0.0F),
      side_(view.height, planes.size(), 0.0F) {}

void DsiProjections::addPlane(int plane, const float* values) {
  const cv::Mat1f slice(front_.rows, front_.cols, const_cast<float*>(values));
  cv::Mat1f row;
  cv::Mat1f column;
  cv::reduce(slice, row, 0, cv::REDUCE_MAX);
  cv::reduce(slice, column, 1, cv::REDUCE_MAX);
  const std::lock_guard<std::mutex> lock(mutex_);
  front_ = cv::max(front_, slice);
  row.copyTo(top_.row(top_.rows - 1 - plane));
  column.copyTo(side_.col(plane));
}

cv::Mat3b DsiProjections::picture() const {
  constexpr int kGapPx = 3;
  double largest = 0;
  cv::minMaxLoc(front_, nullptr, &largest);
  const auto coloured = [&](const cv::Mat1f& values) {
    cv::Mat1b grey;
    values.convertTo(grey, CV_8U, largest > 0 ? 255 / largest : 0);
    cv::Mat3b colours;
    cv::applyColorMap(grey, colours, cv::COLORMAP_PARULA);
    return colours;
  };
  cv::Mat3b sheet(front_.rows + kGapPx + top_.rows, front_.cols + kGapPx + side_.cols,
                  cv::Vec3b(255, 255, 255));
  coloured(front_).copyTo(sheet(cv::Rect(0, 0, front_.cols, front_.rows)));
  coloured(top_).copyTo(sheet(cv::Rect(0, front_.rows + kGapPx, top_.cols, top_.rows)));
  coloured(side_).copyTo(sheet(cv::Rect(front_.cols + kGapPx, 0, side_.cols, side_.rows)));
  return sheet;
}

}  // namespace efm::studies
