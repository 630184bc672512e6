// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <opencv2/core.hpp>

#include "mapping/depth/depth_extraction.h"
#include "mapping/dsi/dsi_columns.h"

namespace efm::test {

/// Returns whether two continuous images have the same bits.
inline bool same(const cv::Mat& a, const cv::Mat& b) {
  return a.size() == b.size() && a.type() == b.type() &&
         std::equal(a.datastart, a.dataend, b.datastart);
}

inline bool same(const DsiPeaks& a, const DsiPeaks& b) {
  return same(a.confidence, b.confidence) && same(a.plane, b.plane) && same(a.before, b.before) &&
         same(a.after, b.after);
}

inline bool same(const DepthMap& a, const DepthMap& b) {
  return same(a.depth, b.depth) && same(a.confidence, b.confidence) && same(a.variance, b.variance);
}

}  // namespace efm::test
