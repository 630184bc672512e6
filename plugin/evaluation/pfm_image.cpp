// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/evaluation/pfm_image.h"

#include <fmt/format.h>

#include <string>

#include "mapping/base/text.h"
#include "maps/io/point_record.h"
#include "plugin/evaluation/npy_image.h"

namespace efm {
namespace {

int side(const WordLine& line, std::size_t word) {
  const std::uint64_t pixels = line.count(word);
  if (pixels < 1 || pixels > kMaxImageSide) {
    line.refuse(fmt::format("{} pixels: expected from 1 to 65535", pixels));
  }
  return static_cast<int>(pixels);
}

double scaleOf(const WordLine& line) {
  double scale = 0;
  if (line.words.size() == 1) scale = parseFinite(line.words[0]).value_or(0);
  if (scale == 0) {
    line.refuse("expected one number, the scale, below 0 where the data are little endian");
  }
  return scale;
}

}  // namespace

bool looksLikePfm(std::string_view bytes) {
  return bytes.size() > 2 && bytes[0] == 'P' && (bytes[1] == 'f' || bytes[1] == 'F') &&
         (bytes[2] == '\n' || bytes[2] == '\r' || bytes[2] == ' ');
}

cv::Mat1f parsePfm(std::string_view bytes) {
  TextScanner cursor(bytes);
  const WordLine kind = wordLine(cursor, "Pf");
  if (kind.words.size() != 1 || kind.words[0] != "Pf") {
    kind.refuse("expected Pf alone, a grey float map");
  }
  const WordLine sides = wordLine(cursor, "width and height");
  if (sides.words.size() != 2) sides.refuse("expected width and height");
  const int width = side(sides, 0);
  const int height = side(sides, 1);
  const bool big_endian = scaleOf(wordLine(cursor, "the scale")) > 0;

  cv::Mat1f image(height, width);
  const std::size_t expected = image.total() * sizeof(float);
  if (cursor.left() != expected) {
    cursor.refuse(fmt::format("{} bytes follow: expected {} for {}x{} float32", cursor.left(),
                              expected, width, height));
  }
  const char* at = cursor.take(expected).data();
  for (float& value : image) {
    value = static_cast<float>(numberAt(at, NumberType::kFloat32, big_endian));
    at += sizeof(float);
  }
  cv::flip(image, image, 0);
  return image;
}

}  // namespace efm
