// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

namespace efm {

/// Expects that a mask shows an F, upright and not mirrored: its lower right quarter is empty.
inline void expectF(const cv::Mat& mask) {
  const cv::Rect box = cv::boundingRect(mask);
  ASSERT_FALSE(box.empty());
  EXPECT_NEAR(static_cast<double>(box.height) / box.width, 2, 0.4);
  const auto quarter = [&](int right, int lower) {
    const cv::Size half(box.width / 2, box.height / 2);
    return cv::countNonZero(mask(
        {{box.x + right * (box.width - half.width), box.y + lower * (box.height - half.height)},
         half}));
  };
  EXPECT_GT(quarter(1, 0), quarter(0, 0) / 4);
  EXPECT_GT(quarter(0, 1), quarter(0, 0) / 4);
  EXPECT_LT(quarter(1, 1), quarter(0, 1) / 3) << "large dots of the middle bar reach into it";
}

}  // namespace efm
