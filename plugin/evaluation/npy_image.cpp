// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/evaluation/npy_image.h"

#include <fmt/format.h>

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "mapping/options/quoted_text.h"
#include "mapping/options/text_parsing.h"
#include "maps/io/point_record.h"

namespace efm {
namespace {

constexpr std::string_view kMagic = "\x93NUMPY";

std::runtime_error wrong(const std::string& what) {
  return std::runtime_error("the array's header: " + what);
}

std::string_view withoutBlanks(std::string_view text) {
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
  return text;
}

/// The dictionary, and the first byte of the data.
struct Header {
  std::string_view dictionary;
  std::size_t data_begin = 0;
};

Header headerOf(std::string_view bytes) {
  constexpr std::size_t kVersion = 6;
  if (bytes.size() < kVersion + 4) throw wrong("the file ends inside it");
  const int version = static_cast<unsigned char>(bytes[kVersion]);
  if (version < 1 || version > 3) {
    throw wrong(fmt::format("version {}: expected 1, 2 or 3", version));
  }
  const std::size_t length_bytes = version == 1 ? 2 : 4;
  const std::size_t begin = kVersion + 2 + length_bytes;
  if (bytes.size() < begin) throw wrong("the file ends inside it");
  std::size_t length = 0;
  for (std::size_t k = length_bytes; k-- > 0;) {
    length = (length << 8) | static_cast<unsigned char>(bytes[kVersion + 2 + k]);
  }
  if (length > bytes.size() - begin) throw wrong("the file ends inside it");
  return {bytes.substr(begin, length), begin + length};
}

/// The text behind 'key': in the dictionary.
std::string_view valueOf(std::string_view dictionary, const std::string& key) {
  const std::size_t name = dictionary.find("'" + key + "'");
  const std::size_t colon =
      name == std::string_view::npos ? name : dictionary.find(':', name + key.size() + 2);
  if (colon == std::string_view::npos) throw wrong("there is no '" + key + "'");
  return withoutBlanks(dictionary.substr(colon + 1));
}

struct NumberLayout {
  NumberType type = NumberType::kFloat32;
  bool big_endian = false;
};

NumberLayout layoutOf(std::string_view descr) {
  const std::string_view type = descr.substr(0, 5);
  for (const bool big_endian : {false, true}) {
    if (type == (big_endian ? "'>f4'" : "'<f4'")) return {NumberType::kFloat32, big_endian};
    if (type == (big_endian ? "'>f8'" : "'<f8'")) return {NumberType::kFloat64, big_endian};
  }
  throw wrong("descr = " + inQuotes(descr.substr(0, descr.find(','))) +
              ": expected float32 or float64 ('<f4', '>f4', '<f8' or '>f8')");
}

cv::Size sizeOf(std::string_view shape) {
  const std::size_t end = shape.find(')');
  const auto refuse = [&] {
    return wrong(
        "shape = " + inQuotes(shape.substr(0, end == std::string_view::npos ? 40 : end + 1)) +
        ": expected (rows, columns), each from 1 to 65535");
  };
  if (shape.empty() || shape.front() != '(' || end == std::string_view::npos) throw refuse();
  std::vector<std::uint64_t> sides;
  std::string_view rest = shape.substr(1, end - 1);
  while (!withoutBlanks(rest).empty()) {
    const std::size_t comma = rest.find(',');
    const std::string_view word = withoutBlanks(rest.substr(0, comma));
    const std::optional<std::uint64_t> value = parseNumber<std::uint64_t>(word);
    if (!value) throw refuse();
    sides.push_back(*value);
    rest = comma == std::string_view::npos ? std::string_view() : rest.substr(comma + 1);
  }
  if (sides.size() != 2) throw refuse();
  for (const std::uint64_t pixels : sides) {
    if (pixels < 1 || pixels > kMaxImageSide) throw refuse();
  }
  return {static_cast<int>(sides[1]), static_cast<int>(sides[0])};
}

}  // namespace

bool looksLikeNpy(std::string_view bytes) { return bytes.substr(0, kMagic.size()) == kMagic; }

cv::Mat1f parseNpy(std::string_view bytes) {
  if (!looksLikeNpy(bytes)) throw wrong("it does not begin as a NumPy array does");
  const Header header = headerOf(bytes);
  const NumberLayout layout = layoutOf(valueOf(header.dictionary, "descr"));
  const std::string_view order = valueOf(header.dictionary, "fortran_order");
  if (order.substr(0, 5) != "False") {
    throw wrong("fortran_order = " + inQuotes(order.substr(0, order.find(','))) +
                ": expected False, rows one after the other");
  }
  const cv::Size size = sizeOf(valueOf(header.dictionary, "shape"));

  const std::string_view data = bytes.substr(header.data_begin);
  const std::size_t step = sizeOf(layout.type);
  const std::size_t expected =
      static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height) * step;
  if (data.size() != expected) {
    throw std::runtime_error(
        fmt::format("{} bytes follow the array's header: expected {} for {}x{} float{}",
                    data.size(), expected, size.width, size.height, 8 * step));
  }
  cv::Mat1f image(size);
  const char* at = data.data();
  for (float& value : image) {
    value = static_cast<float>(numberAt(at, layout.type, layout.big_endian));
    at += step;
  }
  return image;
}

}  // namespace efm
