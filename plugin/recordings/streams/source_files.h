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

/// @throws std::runtime_error naming the cure, where a text is UTF-16 or has CR alone for line
/// ends.
inline void requireTextLines(std::string_view text, const std::string& file) {
  const auto is_wide = [&](std::size_t i) {  // the characters at i and i + 2, NULs beside them
    return text.size() > 3 && text[i] >= '\t' && text[i + 2] >= '\t' && text[1 - i] == '\0' &&
           text[3 - i] == '\0';
  };
  const std::string_view mark = text.substr(0, 2);
  std::string code = is_wide(0) ? "UTF-16LE" : is_wide(1) ? "UTF-16BE" : "";
  if (mark == "\xff\xfe" || mark == "\xfe\xff") code = "UTF-16";
  if (!code.empty()) {
    throw std::runtime_error(fmt::format(
        "{}: a text in {}: expected UTF-8 (iconv -f {} -t UTF-8 <FILE >NEW)", file, code, code));
  }
  using std::string_view_literals::operator""sv;
  if (text.find('\r') == text.npos || text.find_first_of("\n\0"sv) != text.npos) return;
  throw std::runtime_error(
      file + ": its lines end with CR alone: expected LF or CR LF (tr '\\r' '\\n' <FILE >NEW)");
}

/// @throws std::runtime_error where it is a pipe.
inline void requireNoPipe(const std::filesystem::path& path) {
  if (!std::filesystem::is_fifo(path)) return;
  throw std::runtime_error(path.string() +
                           ": a pipe: expected a file, as it is read more than once "
                           "(cat <PIPE >FILE writes one)");
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
