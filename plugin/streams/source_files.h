// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fmt/format.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

namespace efm {

/// Whether it is a regular file, or a link to one. Never throws.
inline bool isFile(const std::filesystem::path& path) {
  std::error_code ignored;
  return std::filesystem::is_regular_file(path, ignored);
}

/// Whether a regular file begins with these bytes. Never throws.
inline bool beginsWith(const std::filesystem::path& file, std::string_view start) {
  if (!isFile(file)) return false;
  std::ifstream stream(file, std::ios::binary);
  std::string found(start.size(), '\0');
  return stream.read(found.data(), static_cast<std::streamsize>(found.size())) && found == start;
}

/// @param what the format, for the error.
/// @throws std::runtime_error where there are several sources.
inline const std::filesystem::path& onlySource(const std::vector<std::filesystem::path>& sources,
                                               const char* what) {
  if (sources.size() == 1) return sources.front();
  throw std::runtime_error(fmt::format("{}: {} sources: expected one, {}", sources.at(1).string(),
                                       sources.size(), what));
}

}  // namespace efm
