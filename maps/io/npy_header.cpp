// SPDX-License-Identifier: BSD-3-Clause
#include "maps/io/npy_header.h"

#include <optional>
#include <stdexcept>
#include <string>

#include "mapping/options/quoted_text.h"
#include "mapping/options/text_parsing.h"

namespace efm {
namespace {

constexpr std::string_view kNpyMagic = "\x93NUMPY";

std::runtime_error wrongNpyHeader(const std::string& what) {
  return std::runtime_error("the array's header: " + what);
}

/// The dictionary, and the first byte of the data.
struct NpyDictionary {
  std::string_view text;
  std::size_t data_begin = 0;
};

NpyDictionary npyDictionaryOf(std::string_view bytes) {
  constexpr std::size_t kVersion = 6;
  if (!looksLikeNpy(bytes)) throw wrongNpyHeader("it does not begin as a NumPy array does");
  if (bytes.size() < kVersion + 4) throw wrongNpyHeader("the file ends inside it");
  const int version = static_cast<unsigned char>(bytes[kVersion]);
  if (version < 1 || version > 3) {
    throw wrongNpyHeader("version " + std::to_string(version) + ": expected 1, 2 or 3");
  }
  const std::size_t length_bytes = version == 1 ? 2 : 4;
  const std::size_t begin = kVersion + 2 + length_bytes;
  if (bytes.size() < begin) throw wrongNpyHeader("the file ends inside it");
  std::size_t length = 0;
  for (std::size_t k = length_bytes; k-- > 0;) {
    length = (length << 8) | static_cast<unsigned char>(bytes[kVersion + 2 + k]);
  }
  if (length > bytes.size() - begin) throw wrongNpyHeader("the file ends inside it");
  return {bytes.substr(begin, length), begin + length};
}

/// The text behind 'key': in the dictionary.
std::string_view npyValueOf(std::string_view dictionary, const std::string& key) {
  const std::size_t name = dictionary.find("'" + key + "'");
  const std::size_t colon =
      name == std::string_view::npos ? name : dictionary.find(':', name + key.size() + 2);
  if (colon == std::string_view::npos) throw wrongNpyHeader("there is no '" + key + "'");
  return trimmed(dictionary.substr(colon + 1));
}

void setNpyType(std::string_view descr, NpyHeader& header) {
  constexpr struct {
    std::string_view name;
    NumberType type;
  } kTypes[] = {
      {"i1", NumberType::kInt8},    {"u1", NumberType::kUint8},   {"b1", NumberType::kUint8},
      {"i2", NumberType::kInt16},   {"u2", NumberType::kUint16},  {"i4", NumberType::kInt32},
      {"u4", NumberType::kUint32},  {"i8", NumberType::kInt64},   {"u8", NumberType::kUint64},
      {"f4", NumberType::kFloat32}, {"f8", NumberType::kFloat64},
  };
  if (descr.size() >= 5 && descr[0] == '\'' && descr[4] == '\'') {
    const char order = descr[1];
    for (const auto& [name, type] : kTypes) {
      if (descr.substr(2, 2) != name) continue;
      if (order != '<' && order != '>' && !(order == '|' && sizeOf(type) == 1)) break;
      header.descr = descr.substr(1, 3);
      header.type = type;
      header.big_endian = order == '>';
      return;
    }
  }
  throw wrongNpyHeader("descr = " + inQuotes(descr.substr(0, descr.find(','))) +
                       (descr.substr(0, 3) == "'|O" ? ", Python objects" : "") +
                       ": expected numbers ('<f4', '<f8', '|u1', '<u2', '<i8')");
}

std::vector<std::uint64_t> npyShapeOf(std::string_view text) {
  const std::size_t end = text.find(')');
  const auto refuse = [&] {
    return wrongNpyHeader(
        "shape = " + inQuotes(text.substr(0, end == std::string_view::npos ? 40 : end + 1)) +
        ": expected a list of sizes, with at most 2^53 numbers in all");
  };
  if (text.empty() || text.front() != '(' || end == std::string_view::npos) throw refuse();
  constexpr std::uint64_t kMaxCount = std::uint64_t{1} << 53;
  std::vector<std::uint64_t> shape;
  std::uint64_t count = 1;
  for (const std::string_view word : splitWords(text.substr(1, end - 1), " ,")) {
    const std::optional<std::uint64_t> size = parseNumber<std::uint64_t>(word);
    if (!size || *size > kMaxCount || (*size > 0 && count > kMaxCount / *size)) throw refuse();
    count *= *size;
    shape.push_back(*size);
  }
  return shape;
}

}  // namespace

std::uint64_t NpyHeader::count() const {
  std::uint64_t count = 1;
  for (const std::uint64_t size : shape) count *= size;
  return count;
}

bool looksLikeNpy(std::string_view bytes) { return bytes.substr(0, kNpyMagic.size()) == kNpyMagic; }

NpyHeader parseNpyHeader(std::string_view bytes) {
  const NpyDictionary dictionary = npyDictionaryOf(bytes);
  NpyHeader header;
  header.data_begin = dictionary.data_begin;
  setNpyType(npyValueOf(dictionary.text, "descr"), header);
  const std::string_view order = npyValueOf(dictionary.text, "fortran_order");
  header.shape = npyShapeOf(npyValueOf(dictionary.text, "shape"));
  if (order.substr(0, 5) != "False" && header.shape.size() > 1) {
    throw wrongNpyHeader("fortran_order = " + inQuotes(order.substr(0, order.find(','))) +
                         ": expected False, rows one after the other");
  }
  return header;
}

}  // namespace efm
