// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/sweep/plane_choice.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>

namespace efm {

int coarseStep(const DepthPlanes& planes, const ReferenceView& view, double range_px) {
  // Measured: the widest at which edges keep their errors. At 346, 640 and 1280 pixels 1.9, 2.5 and
  // 3.6 pixels: larger views have wider edges.
  const double peak_px = 0.1 * std::sqrt(static_cast<double>(view.width));
  constexpr double kMost = 3;  // larger steps find more planes with edges
  const double step_px = range_px / std::max(1, planes.size() - 1);
  return static_cast<int>(std::clamp(peak_px / std::max(step_px, 1e-9), 1.0, kMost));
}

PlaneSet coarsePlanes(int planes, int step) {
  PlaneSet coarse(static_cast<std::size_t>(planes));
  for (std::size_t plane = 0; plane < coarse.size(); plane += static_cast<std::size_t>(step)) {
    coarse[plane] = true;
  }
  coarse.back() = true;
  return coarse;
}

PlaneSet planesAtEdges(const PlaneSet& coarse, const RunningPeaks& peaks, cv::Size tile,
                       int window) {
  constexpr double kMinShare = 0.01;  // of the contrast in the tile
  const cv::Mat1f confidence(tile.height, tile.width,
                             const_cast<float*>(peaks.confidence().data()));
  const cv::Mat1f surroundings = surroundingsOf(confidence, window);
  std::vector<double> contrast(coarse.size());  // by plane
  auto plane = peaks.planes().begin();
  for (int y = 0; y < tile.height; ++y) {
    for (int x = 0; x < tile.width; ++x, ++plane) {
      const double above = double{confidence(y, x)} - double{surroundings(y, x)};
      if (above > 0 && confidence(y, x) > 0) contrast[static_cast<std::size_t>(*plane)] += above;
    }
  }
  const double least = kMinShare * std::accumulate(contrast.begin(), contrast.end(), 0.0);
  PlaneSet fine(coarse.size());
  std::size_t before = 0;  // the coarse plane before
  for (std::size_t at = 1; at < coarse.size(); ++at) {
    if (!coarse[at]) continue;
    if (contrast[before] > least || contrast[at] > least) {
      for (std::size_t between = before + 1; between < at; ++between) fine[between] = true;
    }
    before = at;
  }
  return fine;
}

}  // namespace efm
