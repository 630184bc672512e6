// SPDX-License-Identifier: BSD-3-Clause
#include "test/studies/methods/outstanding_points.h"

#include <algorithm>
#include <functional>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace efm::studies {

cv::Mat1b mostOutstanding(const DepthMap& map, const cv::Mat1b& among, int count) {
  cv::Mat1f mean;
  cv::GaussianBlur(map.confidence, mean, {5, 5}, 0);
  const cv::Mat1f contrast = map.confidence - mean;
  std::vector<float> values;
  for (int y = 0; y < among.rows; ++y) {
    for (int x = 0; x < among.cols; ++x) {
      if (among(y, x) != 0) values.push_back(contrast(y, x));
    }
  }
  if (static_cast<int>(values.size()) <= count) return among;
  if (count == 0) return cv::Mat1b::zeros(among.size());
  const auto last = values.begin() + count - 1;
  std::nth_element(values.begin(), last, values.end(), std::greater<>());
  return among & (contrast >= *last);
}

cv::Mat1f only(const cv::Mat1f& depth, const cv::Mat1b& mask) {
  cv::Mat1f some = cv::Mat1f::zeros(depth.size());
  depth.copyTo(some, mask);
  return some;
}

}  // namespace efm::studies
