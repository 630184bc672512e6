// SPDX-License-Identifier: BSD-3-Clause
#include "maps/io/pcd_file.h"

#include <pcl/io/lzf.h>

#include <algorithm>
#include <limits>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>

#include "mapping/options/quoted_text.h"
#include "maps/io/point_record.h"
#include "maps/io/point_row.h"
#include "maps/io/text_scanner.h"

namespace efm {
namespace {

// --- Writing ---------------------------------------------------------------------------------

std::string_view nameInFile(PointCloudEncoding encoding) {
  if (encoding == PointCloudEncoding::kAscii) return "ascii";
  return encoding == PointCloudEncoding::kBinary ? "binary" : "binary_compressed";
}

void writeNumber(std::ostream& stream, std::uint32_t value) {
  for (unsigned shift = 0; shift < 32; shift += 8) {
    stream.put(static_cast<char>(value >> shift & 0xFFU));
  }
}

/// All x, then all y, z and intensities: neighbours resemble each other.
void writeCompressed(std::ostream& stream, const std::vector<PointRow>& rows) {
  std::ostringstream by_field;
  for (std::size_t field = 0; field < PointRow().size(); ++field) {
    for (const PointRow& row : rows) writeBinary(by_field, row[field]);
  }
  const std::string plain = by_field.str();
  std::string packed(plain.size() + plain.size() / 16 + 64, '\0');  // LZF's worst: 4 % more
  if (packed.size() > std::numeric_limits<std::uint32_t>::max()) {
    throw std::runtime_error(std::to_string(rows.size()) +
                             " points: expected fewer, a compressed file has 32-bit sizes");
  }
  unsigned int packed_bytes = 0;
  if (!plain.empty()) {
    packed_bytes = pcl::lzfCompress(plain.data(), static_cast<unsigned int>(plain.size()),
                                    packed.data(), static_cast<unsigned int>(packed.size()));
    if (packed_bytes == 0) throw std::runtime_error("the points cannot be compressed");
  }
  writeNumber(stream, packed_bytes);
  writeNumber(stream, static_cast<std::uint32_t>(plain.size()));
  stream.write(packed.data(), static_cast<std::streamsize>(packed_bytes));
}

// --- Reading ---------------------------------------------------------------------------------

/// The lines of a header by their keys.
using HeaderLines = std::map<std::string, WordLine, std::less<>>;

HeaderLines readHeaderLines(TextScanner& cursor) {
  constexpr std::string_view kKeys =
      " VERSION FIELDS SIZE TYPE COUNT WIDTH HEIGHT VIEWPOINT POINTS DATA ";
  HeaderLines lines;
  while (lines.count("DATA") == 0) {
    const WordLine line = wordLine(cursor, "a line of a PCD header, up to DATA");
    if (line.words.empty() || line.words[0].front() == '#') continue;
    const std::string key(line.words[0] == "COLUMNS" ? "FIELDS" : line.words[0]);
    if (kKeys.find(" " + key + " ") == std::string_view::npos) {
      line.refuse(inQuotes(key) + ": expected one of" + std::string(kKeys) + "(a PCD header)");
    }
    if (!lines.emplace(key, line).second) line.refuse(key + " again: expected it once");
  }
  for (const char* key : {"FIELDS", "SIZE", "TYPE", "POINTS"}) {
    if (lines.count(key) != 0) continue;
    lines.at("DATA").refuse("DATA ends the header: expected " + std::string(key) + " before it");
  }
  return lines;
}

NumberType numberType(const WordLine& types, const WordLine& sizes, std::size_t word) {
  static const std::map<std::string, NumberType> known = {
      {"I1", NumberType::kInt8},    {"U1", NumberType::kUint8},  {"I2", NumberType::kInt16},
      {"U2", NumberType::kUint16},  {"I4", NumberType::kInt32},  {"U4", NumberType::kUint32},
      {"I8", NumberType::kInt64},   {"U8", NumberType::kUint64}, {"F4", NumberType::kFloat32},
      {"F8", NumberType::kFloat64},
  };
  const auto type = known.find(std::string(types.words[word]) + std::string(sizes.words[word]));
  if (type == known.end()) {
    types.refuse("TYPE " + inQuotes(types.words[word]) + " of SIZE " + inQuotes(sizes.words[word]) +
                 ": expected I or U of 1, 2, 4 or 8 bytes, or F of 4 or 8");
  }
  return type->second;
}

std::vector<RecordField> fieldsOf(const HeaderLines& lines) {
  constexpr std::uint64_t kMaxCount = 1U << 20U;
  const std::size_t words = lines.at("FIELDS").words.size();
  for (const char* key : {"SIZE", "TYPE", "COUNT"}) {
    const auto line = lines.find(key);
    if (line == lines.end() || line->second.words.size() == words) continue;
    line->second.refuse(std::to_string(line->second.words.size() - 1) + " values: expected " +
                        std::to_string(words - 1) + ", as many as FIELDS has");
  }
  const auto counts = lines.find("COUNT");

  std::vector<RecordField> fields;
  for (std::size_t word = 1; word < words; ++word) {
    const std::uint64_t count = counts == lines.end() ? 1 : counts->second.count(word);
    if (count < 1 || count > kMaxCount) {
      counts->second.refuse("COUNT " + std::to_string(count) + ": expected 1 to " +
                            std::to_string(kMaxCount));
    }
    fields.push_back({std::string(lines.at("FIELDS").words[word]),
                      numberType(lines.at("TYPE"), lines.at("SIZE"), word),
                      static_cast<std::size_t>(count)});
  }
  return fields;
}

std::uint64_t pointsOf(const HeaderLines& lines) {
  const WordLine& line = lines.at("POINTS");
  const std::uint64_t points = line.count(1);
  const auto width_line = lines.find("WIDTH");
  const auto height_line = lines.find("HEIGHT");
  if (width_line == lines.end() || height_line == lines.end()) return points;
  const std::uint64_t width = width_line->second.count(1);
  const std::uint64_t height = height_line->second.count(1);
  const bool agree =
      width == 0 || height == 0 ? points == 0 : points % width == 0 && points / width == height;
  if (!agree) {
    line.refuse("POINTS " + std::to_string(points) + ": expected WIDTH x HEIGHT, " +
                std::to_string(width) + " x " + std::to_string(height));
  }
  return points;
}

std::uint64_t readNumber(TextScanner& cursor) {
  std::uint64_t value = 0;
  const std::string_view bytes = cursor.take(4);
  for (std::size_t i = 4; i-- > 0;) value = value << 8U | static_cast<unsigned char>(bytes[i]);
  return value;
}

PointCloudContent readCompressed(TextScanner& cursor, std::vector<RecordField> fields,
                                 std::uint64_t points) {
  const auto is_padding = [](const RecordField& field) { return field.name == "_"; };
  fields.erase(std::remove_if(fields.begin(), fields.end(), is_padding),
               fields.end());  // not there

  if (cursor.left() < 8) cursor.refuse("expected the sizes of the compressed points, 8 bytes");
  const std::uint64_t packed_bytes = readNumber(cursor);
  const std::uint64_t plain_bytes = readNumber(cursor);
  const std::size_t record_bytes = std::max<std::size_t>(bytesOf(fields), 1);
  if (plain_bytes % record_bytes != 0 || plain_bytes / record_bytes != points) {
    cursor.refuse(std::to_string(plain_bytes) + " bytes when decompressed: expected " +
                  std::to_string(points) + " points of " + std::to_string(record_bytes) + " bytes");
  }
  constexpr std::uint64_t kBestRatio = 88;  // of LZF: 3 bytes stand for 264 at most
  if (cursor.left() < packed_bytes || plain_bytes > packed_bytes * kBestRatio) {
    cursor.refuse(std::to_string(cursor.left()) + " bytes are left: expected " +
                  std::to_string(packed_bytes) + " that decompress to " +
                  std::to_string(plain_bytes) + ": is the file cut short?");
  }
  std::string plain(static_cast<std::size_t>(plain_bytes), '\0');
  const TextScanner packed_place = cursor;
  const std::string_view packed = cursor.take(static_cast<std::size_t>(packed_bytes));
  if (!plain.empty() &&
      pcl::lzfDecompress(packed.data(), static_cast<unsigned int>(packed.size()), plain.data(),
                         static_cast<unsigned int>(plain.size())) != plain.size()) {
    packed_place.refuse(std::to_string(packed_bytes) + " compressed bytes: expected " +
                        std::to_string(plain_bytes) + " when decompressed: is the file damaged?");
  }
  TextScanner plain_cursor(plain);
  return readBinaryRecords(plain_cursor, fields, points, {false, true});
}

}  // namespace

void writePcdTo(std::ostream& stream, const std::vector<CloudPoint>& points,
                PointCloudEncoding encoding) {
  const std::vector<PointRow> rows = pointRows(points);
  stream << "# .PCD v0.7 - Point Cloud Data file format\n"
            "VERSION 0.7\nFIELDS x y z intensity\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\n"
            "WIDTH "
         << rows.size() << "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " << rows.size()
         << "\nDATA " << nameInFile(encoding) << '\n';
  if (encoding == PointCloudEncoding::kAscii) return writeText(stream, rows);
  if (encoding == PointCloudEncoding::kCompressed) return writeCompressed(stream, rows);
  for (const PointRow& row : rows) {
    for (const float value : row) writeBinary(stream, value);
  }
}

PointCloudContent parsePcd(std::string_view bytes) {
  TextScanner cursor(bytes);
  const HeaderLines lines = readHeaderLines(cursor);
  const std::vector<RecordField> fields = fieldsOf(lines);
  const std::uint64_t points = pointsOf(lines);
  const WordLine& data = lines.at("DATA");
  const std::string_view encoding = data.words.size() == 2 ? data.words[1] : std::string_view{};

  PointCloudContent content;
  if (encoding == "ascii") {
    content = readTextRecords(cursor, fields, points);
  } else if (encoding == "binary") {
    content = readBinaryRecords(cursor, fields, points, {});
  } else if (encoding == "binary_compressed") {
    content = readCompressed(cursor, fields, points);
  } else {
    data.refuse("DATA " + inQuotes(encoding) + ": expected ascii, binary or binary_compressed");
  }
  cursor.expectEnd();
  return content;
}

}  // namespace efm
