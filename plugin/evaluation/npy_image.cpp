// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/evaluation/npy_image.h"

#include <fmt/format.h>

#include <cstdint>
#include <stdexcept>

#include "maps/io/npy_header.h"

namespace efm {
namespace {

cv::Size imageSizeOf(const NpyHeader& header) {
  bool is_image = header.shape.size() == 2;
  for (const std::uint64_t side : header.shape) {
    is_image = is_image && side >= 1 && side <= kMaxImageSide;
  }
  if (!is_image) {
    throw std::runtime_error(
        fmt::format("the array's header: shape = '({})': expected (rows, columns), each from 1 to "
                    "65535",
                    fmt::join(header.shape, ", ")));
  }
  return {static_cast<int>(header.shape[1]), static_cast<int>(header.shape[0])};
}

}  // namespace

cv::Mat1f parseNpy(std::string_view bytes) {
  const NpyHeader header = parseNpyHeader(bytes);
  requirePlainRows(header);
  if (header.type != NumberType::kFloat32 && header.type != NumberType::kFloat64) {
    throw std::runtime_error(
        fmt::format("the array's header: descr = '{}': expected float32 or float64", header.descr));
  }
  const cv::Size size = imageSizeOf(header);
  const std::string_view data = bytes.substr(header.data_begin);
  const std::size_t step = sizeOf(header.type);
  if (data.size() != header.bytes()) {
    throw std::runtime_error(
        fmt::format("{} bytes follow the array's header: expected {} for {}x{} float{}",
                    data.size(), header.bytes(), size.width, size.height, 8 * step));
  }
  cv::Mat1f image(size);
  const char* at = data.data();
  for (float& value : image) {
    value = static_cast<float>(numberAt(at, header.type, header.big_endian));
    at += step;
  }
  return image;
}

}  // namespace efm
