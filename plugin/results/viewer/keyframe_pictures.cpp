// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/results/viewer/keyframe_pictures.h"

#include <opencv2/imgcodecs.hpp>
#include <stdexcept>
#include <utility>

#include "plugin/results/pictures/depth_picture.h"

namespace efm {
namespace {

/// Joins blocks of factor x factor pixels: the sum of their events.
cv::Mat_<cv::Vec2i> reduced(const cv::Mat_<cv::Vec2i>& events, int factor) {
  if (factor == 1) return events;
  cv::Mat_<cv::Vec2i> small =
      cv::Mat_<cv::Vec2i>::zeros(events.rows / factor, events.cols / factor);
  for (int y = 0; y < small.rows * factor; ++y) {
    for (int x = 0; x < small.cols * factor; ++x) small(y / factor, x / factor) += events(y, x);
  }
  return small;
}

std::vector<std::uint8_t> pngOf(const cv::Mat& image) {
  std::vector<std::uint8_t> bytes;
  // Half the size of OpenCV's default level, 2 ms a picture instead of 0.7.
  if (!cv::imencode(".png", image, bytes, {cv::IMWRITE_PNG_COMPRESSION, 6})) {
    throw std::runtime_error("no picture can be made of a keyframe");
  }
  return bytes;
}

}  // namespace

void KeyframePictures::add(const cv::Mat1f& depth_m, const cv::Mat_<cv::Vec2i>& events) {
  const std::size_t keyframe = keyframes_++;
  if (keyframe % stride_ != 0) return;
  const int factor = (depth_m.cols + kMaxWidth - 1) / kMaxWidth;
  KeyframePicture added = {
      pngOf(depthPicture(reducedDepth(depth_m, kMaxWidth), limits_, Palette::kBrightToDark)), {}};
  if (!events.empty()) added.events = pngOf(eventPicture(reduced(events, factor)));
  bytes_ += added.bytes();
  pictures_.emplace(keyframe, std::move(added));
  while (bytes_ > max_bytes_ && pictures_.size() > 1) {
    stride_ *= 2;
    for (auto picture = pictures_.begin(); picture != pictures_.end();) {
      if (picture->first % stride_ == 0) {
        ++picture;
        continue;
      }
      bytes_ -= picture->second.bytes();
      picture = pictures_.erase(picture);
    }
  }
}

}  // namespace efm
