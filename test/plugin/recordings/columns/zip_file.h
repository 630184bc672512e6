// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <zlib.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "test/plugin/temporary_folder.h"

namespace efm {

/// Returns the number as little-endian bytes.
template <typename Number>
std::string bytesOfNumber(Number number) {
  return {reinterpret_cast<const char*>(&number), sizeof number};
}

/// Writes a zip archive. Its files are stored without compression.
inline void writeZip(const std::filesystem::path& file,
                     const std::vector<std::pair<std::string, std::string>>& members) {
  std::string bytes;
  std::string directory;
  for (const auto& [name, content] : members) {
    const auto size = static_cast<std::uint32_t>(content.size());
    const auto crc =
        static_cast<std::uint32_t>(crc32(0, reinterpret_cast<const Bytef*>(content.data()), size));
    const std::string common = bytesOfNumber<std::uint16_t>(20) + std::string(8, '\0') +
                               bytesOfNumber(crc) + bytesOfNumber(size) + bytesOfNumber(size) +
                               bytesOfNumber(static_cast<std::uint16_t>(name.size())) +
                               bytesOfNumber<std::uint16_t>(0);
    directory += "PK\x01\x02" + bytesOfNumber<std::uint16_t>(20) + common + std::string(10, '\0') +
                 bytesOfNumber(static_cast<std::uint32_t>(bytes.size())) + name;
    bytes += "PK\x03\x04" + common + name + content;
  }
  const auto count = static_cast<std::uint16_t>(members.size());
  const auto begin = static_cast<std::uint32_t>(bytes.size());
  bytes += directory + "PK\x05\x06" + std::string(4, '\0') + bytesOfNumber(count) +
           bytesOfNumber(count) + bytesOfNumber(static_cast<std::uint32_t>(directory.size())) +
           bytesOfNumber(begin) + std::string(2, '\0');
  writeFile(file, bytes);
}

/// Writes a gzip file.
inline void writeGzip(const std::filesystem::path& file, const std::string& content) {
  gzFile stream = gzopen(file.c_str(), "wb");
  gzwrite(stream, content.data(), static_cast<unsigned>(content.size()));
  gzclose(stream);
}

/// Returns a NumPy array, format 1.0.
/// @param descr "<f8", or a list of fields.
/// @param shape "(2, 8)".
template <typename Number>
std::string npyArray(const std::string& descr, const std::string& shape,
                     const std::vector<Number>& numbers) {
  const std::string quote = descr.front() == '[' ? "" : "'";
  const std::string dictionary = "{'descr': " + quote + descr + quote +
                                 ", 'fortran_order': False, 'shape': " + shape + ", }\n";
  std::string bytes = "\x93NUMPY";
  bytes += std::string("\x01\x00", 2);
  bytes += bytesOfNumber(static_cast<std::uint16_t>(dictionary.size())) + dictionary;
  for (const Number number : numbers) bytes += bytesOfNumber(number);
  return bytes;
}

}  // namespace efm
