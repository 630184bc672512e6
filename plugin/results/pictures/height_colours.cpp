// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/results/pictures/height_colours.h"

#include <algorithm>
#include <cstddef>

#include "plugin/results/pictures/palette.h"

namespace efm {

std::vector<PointColour> coloursByHeight(const MapCloud& cloud, const Eigen::Vector3d& upward) {
  if (cloud.empty()) return {};
  std::vector<double> sorted;
  for (const MapPoint& point : cloud) sorted.push_back(upward.dot(positionIn(cloud, point)));
  std::sort(sorted.begin(), sorted.end());
  const std::size_t hundredth = sorted.size() / 100;
  const double low = sorted[hundredth];
  const double range = std::max(sorted[sorted.size() - 1 - hundredth] - low, 1e-9);

  cv::Mat1b levels(1, 256);
  for (int level = 0; level < 256; ++level) levels(level) = cv::saturate_cast<uchar>(255 - level);
  const cv::Mat3b table = coloured(levels, Palette::kBrightToDark);
  std::vector<PointColour> colours;
  for (const MapPoint& point : cloud) {
    const double height = (upward.dot(positionIn(cloud, point)) - low) / range;
    const cv::Vec3b& bgr = table(static_cast<int>(255 * std::clamp(height, 0.0, 1.0)));
    colours.push_back({bgr[2], bgr[1], bgr[0]});
  }
  return colours;
}

}  // namespace efm
