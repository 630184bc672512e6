// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/evaluation/depth_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>
#include <string>
#include <string_view>

#include "mapping/base/atomic_file.h"
#include "mapping/base/named_choice.h"
#include "mapping/base/text.h"
#include "maps/io/npy_header.h"
#include "plugin/evaluation/npy_image.h"
#include "plugin/evaluation/pfm_image.h"

namespace efm {
namespace {

bool beginsWith(std::string_view bytes, std::string_view start) {
  return bytes.substr(0, start.size()) == start;
}

bool looksLikeTiff(std::string_view bytes) {
  using namespace std::string_view_literals;
  return beginsWith(bytes, "II*\0"sv) || beginsWith(bytes, "MM\0*"sv);
}

bool looksLikePng(std::string_view bytes) { return beginsWith(bytes, "\x89PNG\r\n\x1a\n"); }

std::string kindOf(const cv::Mat& image) {
  constexpr const char* kDepths[] = {"8-bit",  "signed 8-bit", "16-bit", "signed 16-bit",
                                     "32-bit", "float32",      "float64"};
  const int depth = image.depth();
  return fmt::format("{}, {} channel{}", depth < 7 ? kDepths[depth] : "unknown", image.channels(),
                     image.channels() == 1 ? "" : "s");
}

cv::Mat decoded(const std::string& bytes, int flags) {
  cv::Mat image;
  try {
    image = cv::imdecode(cv::Mat(1, static_cast<int>(bytes.size()), CV_8U,
                                 const_cast<char*>(bytes.data())),  // it only reads
                         flags);
  } catch (const cv::Exception&) {
    image.release();
  }
  if (image.empty()) throw std::runtime_error("the image is damaged or cut short");
  return image;
}

cv::Mat1f parseTiff(const std::string& bytes) {
  cv::Mat image = decoded(bytes, cv::IMREAD_UNCHANGED);
  if (image.type() != CV_32FC1) {
    throw std::runtime_error("a TIFF image, " + kindOf(image) +
                             ": must be a float32 image of one channel");
  }
  return image;
}

cv::Mat1f parsePng(const std::string& bytes, std::optional<double> scale) {
  const cv::Mat image = decoded(bytes, cv::IMREAD_UNCHANGED);
  if (image.type() != CV_16UC1) {
    throw std::runtime_error("a PNG image, " + kindOf(image) +
                             ": expected 16-bit, 1 channel, or a float32 TIFF");
  }
  if (!scale) {
    throw std::runtime_error("a 16-bit PNG needs a scale, --scale (1000: millimetres)");
  }
  const double units_per_m = *scale >= 1 ? *scale : 1 / *scale;
  cv::Mat1f depth_m(image.size());
  std::transform(image.begin<std::uint16_t>(), image.end<std::uint16_t>(), depth_m.begin(),
                 [&](std::uint16_t units) { return static_cast<float>(units / units_per_m); });
  return depth_m;
}

cv::Mat1f parseDepth(const std::string& bytes, std::optional<double> png_scale) {
  if (looksLikeTiff(bytes)) return parseTiff(bytes);
  if (looksLikePng(bytes)) return parsePng(bytes, png_scale);
  if (looksLikePfm(bytes)) return parsePfm(bytes);
  if (looksLikeNpy(bytes)) return parseNpy(bytes);
  throw std::runtime_error(
      (bytes.empty() ? "it is empty" : "it begins with " + inQuotes(bytes.substr(0, 8))) +
      ": expected a TIFF, PFM, NPY or PNG image");
}

}  // namespace

cv::Mat1f readDepthFile(const std::filesystem::path& file, std::optional<double> png_scale) {
  if (png_scale) {
    requireOption(*png_scale > 0 && std::isfinite(*png_scale), "scale", *png_scale, "above 0");
  }
  try {
    return parseDepth(readBytes(file), png_scale);
  } catch (const std::exception& error) {
    throw std::runtime_error("cannot read the depth map " + file.string() + ": " + error.what());
  }
}

cv::Mat1b readMaskFile(const std::filesystem::path& file) {
  try {
    const std::string bytes = readBytes(file);
    if (bytes.empty()) throw std::runtime_error("it is empty");
    // The maximum of the colours: OpenCV's conversion to grey rounds a dark blue to black.
    cv::Mat channels = decoded(bytes, cv::IMREAD_ANYCOLOR | cv::IMREAD_ANYDEPTH);
    cv::Mat1b mask(channels.size(), uchar{0});
    for (int c = 0; c < channels.channels(); ++c) {
      cv::Mat one;
      cv::extractChannel(channels, one, c);
      mask |= one > 0;
    }
    return mask;
  } catch (const std::exception& error) {
    throw std::runtime_error("cannot read the mask " + file.string() + ": " + error.what());
  }
}

}  // namespace efm
