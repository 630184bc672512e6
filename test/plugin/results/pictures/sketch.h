// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <string>

namespace efm::test {

/// Returns the letter of a colour: # + . from dark to light grey, r y g c b m.
inline char letterOf(const cv::Scalar& bgr) {
  const auto [low, high] = std::minmax({bgr[0], bgr[1], bgr[2]});
  if (high - low < 40) return high < 110 ? '#' : high < 200 ? '+' : '.';
  const double limit = 0.5 * (low + high);
  const int bits = (bgr[2] > limit ? 4 : 0) + (bgr[1] > limit ? 2 : 0) + (bgr[0] > limit ? 1 : 0);
  return " bgcrmy"[bits];
}

/// Returns a picture as lines of letters. A letter is the mean colour of a block of pixels without
/// its white pixels; a block with almost no drawing is blank. The last line has the number of all
/// pixels that are not white and their mean position, so that a small shift shows.
inline std::string sketchOf(const cv::Mat3b& picture, int block_px) {
  std::string sketch = "\n";
  double ink = 0;
  cv::Point2d at;
  for (int top = 0; top < picture.rows; top += block_px) {
    std::string line;
    for (int left = 0; left < picture.cols; left += block_px) {
      const cv::Rect block = cv::Rect(left, top, block_px, block_px) & cv::Rect({}, picture.size());
      cv::Scalar sum;
      double drawn = 0;
      for (int y = block.y; y < block.br().y; ++y) {
        for (int x = block.x; x < block.br().x; ++x) {
          const cv::Vec3b& pixel = picture(y, x);
          if (std::min({pixel[0], pixel[1], pixel[2]}) > 240) continue;
          sum += cv::Scalar(pixel[0], pixel[1], pixel[2]);
          ++drawn;
          at += cv::Point2d(x, y);
        }
      }
      ink += drawn;
      line += drawn < 0.08 * block.area() ? ' ' : letterOf(sum * (1 / drawn));
    }
    line.erase(line.find_last_not_of(' ') + 1);
    sketch += line + "\n";
  }
  const auto tenths = [](double value) {
    const auto rounded = std::lround(10 * value);
    return std::to_string(rounded / 10) + "." + std::to_string(rounded % 10);
  };
  ink = std::max(ink, 1.0);
  return sketch + std::to_string(std::lround(ink)) + " px at " + tenths(at.x / ink) + ", " +
         tenths(at.y / ink) + "\n";
}

}  // namespace efm::test
