// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/base/npy_header.h"

#include <algorithm>
#include <optional>
#include <stdexcept>

#include "mapping/base/text.h"

namespace efm {
namespace {

constexpr std::string_view kNpyMagic = "\x93NUMPY";

std::runtime_error wrongNpyHeader(const std::string& what) {
  return std::runtime_error("the array's header: " + what);
}

/// Returns the dictionary; the data follow it.
std::string_view npyDictionaryOf(std::string_view bytes) {
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
  return bytes.substr(begin, length);
}

/// Returns the text after 'key': in the dictionary.
std::string_view npyValueOf(std::string_view dictionary, const std::string& key) {
  const std::size_t name = dictionary.find("'" + key + "'");
  const std::size_t colon =
      name == std::string_view::npos ? name : dictionary.find(':', name + key.size() + 2);
  if (colon == std::string_view::npos) throw wrongNpyHeader("there is no '" + key + "'");
  return trimmed(dictionary.substr(colon + 1));
}

/// Parses a type like "<f4"; std::nullopt if it is no number.
std::optional<NpyField> npyTypeOf(std::string_view descr) {
  if (descr.size() != 3) return std::nullopt;
  const char order = descr[0];
  const char kind = descr.substr(1) == "b1" ? 'u' : descr[1];
  const auto type = numberTypeOf(kind, static_cast<std::size_t>(descr[2] - '0'));
  if (!type || !(order == '<' || order == '>' || (order == '|' && sizeOf(*type) == 1))) {
    return std::nullopt;
  }
  return NpyField{"", *type, order == '>'};
}

std::runtime_error wrongNpyType(std::string_view descr) {
  return wrongNpyHeader("descr = " + inQuotes(descr.substr(0, descr.find(','))) +
                        (descr.substr(0, 3) == "'|O" ? ", Python objects" : "") +
                        ": expected numbers ('<f4', '<f8', '|u1', '<u2', '<i8')");
}

constexpr std::size_t kMaxElementBytes = 65'536;

/// Parses the list of fields of a structured type: [('x', '<u2'), ('', '|V2'), ('p', '|i1', (3,))].
/// Nested structures and arrays are not used: only their bytes are counted.
class NpyFieldParser {
 public:
  explicit NpyFieldParser(std::string_view text) : text_(text), all_(text) {}

  void parse(NpyHeader& header) {
    header.element_bytes = list(&header.fields, 0);
    header.structured = true;
    if (header.element_bytes == 0) throw fail();
  }

 private:
  /// @param fields gets the fields that are numbers; null: they are not needed.
  /// @return the size of all fields in bytes.
  std::size_t list(std::vector<NpyField>* fields, int depth) {
    constexpr int kMaxDepth = 8;
    if (depth > kMaxDepth) throw fail();
    std::size_t bytes = 0;
    take('[');
    while (!takes(']')) {
      take('(');
      const std::string field_name = name();
      take(',');
      std::size_t size = 0;
      std::optional<NpyField> number;
      if (next() == '[') {
        size = list(nullptr, depth + 1);
      } else {
        const std::string_view type = quoted();
        number = npyTypeOf(type);
        size = number ? sizeOf(number->type) : bytesOf(type);
      }
      std::size_t count = 1;
      if (takes(',') && next() != ')') count = arraySize();
      take(')');
      if (count > kMaxElementBytes || size * count > kMaxElementBytes - bytes) throw fail();
      if (number && count == 1 && fields != nullptr) {
        fields->push_back({field_name, number->type, number->big_endian, bytes});
      }
      bytes += size * count;
      if (!takes(',') && next() != ']') throw fail();
    }
    return bytes;
  }

  /// Takes a name, or a title and a name in brackets.
  std::string name() {
    if (!takes('(')) return std::string(quoted());
    quoted();
    take(',');
    const std::string_view text = quoted();
    takes(',');
    take(')');
    return std::string(text);
  }

  std::string_view quoted() {
    const char quote = next();
    if (quote != '\'' && quote != '"') throw fail();
    const std::size_t end = text_.find(quote, 1);
    if (end == std::string_view::npos) throw fail();
    const std::string_view text = text_.substr(1, end - 1);
    text_.remove_prefix(end + 1);
    return text;
  }

  /// Returns the bytes of a type that is no number: "|V4", "<U8", "<M8[us]".
  std::size_t bytesOf(std::string_view type) const {
    if (type.size() < 3 || type[1] == 'O') throw wrongNpyType("'" + std::string(type) + "'");
    const auto bytes = parseNumber<std::size_t>(type.substr(2, type.find('[') - 2));
    if (!bytes || *bytes > kMaxElementBytes) throw fail();
    return *bytes * (type[1] == 'U' ? 4 : 1);
  }

  /// Takes the shape "3" or "(2, 3)" of a field and returns its number of elements.
  std::size_t arraySize() {
    const bool many = takes('(');
    std::size_t size = 1;
    do {
      next();
      std::size_t digits = 0;
      while (digits < text_.size() && text_[digits] >= '0' && text_[digits] <= '9') ++digits;
      const auto side = parseNumber<std::size_t>(text_.substr(0, digits));
      if (!side || *side > kMaxElementBytes) throw fail();
      text_.remove_prefix(digits);
      size = std::min(size * *side, kMaxElementBytes + 1);
    } while (many && takes(',') && next() != ')');
    if (many) take(')');
    return size;
  }

  /// Returns the next character after blanks.
  char next() {
    while (!text_.empty() && text_.front() == ' ') text_.remove_prefix(1);
    if (text_.empty()) throw fail();
    return text_.front();
  }
  bool takes(char character) {
    if (next() != character) return false;
    text_.remove_prefix(1);
    return true;
  }
  void take(char character) {
    if (!takes(character)) throw fail();
  }
  std::runtime_error fail() const {
    return wrongNpyHeader("descr = " + inQuotes(all_.substr(0, 60)) +
                          ": expected a list of fields, of at most 64 KiB in all");
  }

  std::string_view text_;
  std::string_view all_;
};

void setNpyType(std::string_view descr, NpyHeader& header) {
  if (!descr.empty() && descr.front() == '[') return NpyFieldParser(descr).parse(header);
  const std::size_t end = descr.empty() ? descr.npos : descr.find(descr.front(), 1);
  const auto type = end == descr.npos ? std::nullopt : npyTypeOf(descr.substr(1, end - 1));
  if (!type || descr.front() != '\'') throw wrongNpyType(descr);
  header.descr = descr.substr(1, end - 1);
  header.type = type->type;
  header.big_endian = type->big_endian;
  header.element_bytes = sizeOf(type->type);
}

std::vector<std::uint64_t> npyShapeOf(std::string_view text, std::size_t element_bytes) {
  const std::size_t end = text.find(')');
  const auto reject = [&] {
    return wrongNpyHeader(
        "shape = " + inQuotes(text.substr(0, end == std::string_view::npos ? 40 : end + 1)) +
        ": expected a list of sizes, with at most 2^53 numbers in all");
  };
  if (text.empty() || text.front() != '(' || end == std::string_view::npos) throw reject();
  constexpr std::uint64_t kMaxCount = std::uint64_t{1} << 53;
  std::vector<std::uint64_t> shape;
  std::uint64_t count = std::max<std::size_t>(1, element_bytes / 8);  // in units of 8 bytes
  for (const std::string_view word : splitWords(text.substr(1, end - 1), " ,")) {
    const std::optional<std::uint64_t> size = parseNumber<std::uint64_t>(word);
    if (!size || *size > kMaxCount || (*size > 0 && count > kMaxCount / *size)) throw reject();
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
  const std::string_view dictionary = npyDictionaryOf(bytes);
  NpyHeader header;
  header.data_begin = static_cast<std::size_t>(dictionary.end() - bytes.begin());
  setNpyType(npyValueOf(dictionary, "descr"), header);
  header.fortran_order = npyValueOf(dictionary, "fortran_order").substr(0, 5) != "False";
  header.shape = npyShapeOf(npyValueOf(dictionary, "shape"), header.element_bytes);
  return header;
}

void requirePlainRows(const NpyHeader& header) {
  if (header.structured) {
    throw wrongNpyHeader("a structured array: expected numbers ('<f4', '<f8', '|u1', '<u2')");
  }
  if (header.fortran_order && header.shape.size() > 1) {
    throw wrongNpyHeader("fortran_order = 'True': expected False, rows one after the other");
  }
}

}  // namespace efm
