// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/evaluation/pfm_image.h"

#include <charconv>
#include <cmath>
#include <string>

#include "mapping/options/quoted_text.h"
#include "maps/io/text_scanner.h"
#include "plugin/evaluation/image_numbers.h"

namespace efm {
namespace {

int side(const WordLine& line, std::size_t word) {
  const std::uint64_t pixels = line.count(word);
  if (pixels < 1 || pixels > kMaxImageSide) {
    line.refuse(std::to_string(pixels) + " pixels: expected from 1 to 65535");
  }
  return static_cast<int>(pixels);
}

double scaleOf(const WordLine& line) {
  double scale = 0;
  if (line.words.size() == 1) {
    const std::string_view word = line.words[0];
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), scale);
    if (error != std::errc() || end != word.data() + word.size()) scale = 0;
  }
  if (scale == 0 || !std::isfinite(scale)) {
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
  const NumberLayout layout{scaleOf(wordLine(cursor, "the scale")) > 0, false};

  const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  if (cursor.left() != pixels * layout.bytes()) {
    cursor.refuse(std::to_string(cursor.left()) + " bytes follow: expected " +
                  std::to_string(pixels * layout.bytes()) + " for " + std::to_string(width) + "x" +
                  std::to_string(height) + " float32");
  }
  const std::string_view data = cursor.take(cursor.left());
  cv::Mat1f image(height, width);
  std::size_t index = 0;
  for (int y = height - 1; y >= 0; --y) {
    for (int x = 0; x < width; ++x) image(y, x) = numberAt(data, index++, layout);
  }
  return image;
}

}  // namespace efm
