// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/open/rawlog_signature.h"

#include <algorithm>
#include <exception>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

#include "mapping/base/text.h"
#include "plugin/recordings/open/gz_stream.h"
#include "plugin/recordings/streams/file_content.h"

namespace efm {
namespace {

bool isNameCharacter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
         c == ':' || c == '<' || c == '>' || c == ',';
}

/// Whether these are the first bytes of an object: the length of its class's name, the name, the
/// content. The length is a byte with the top bit set, or (before MRPT 0.5.5) four bytes, the
/// lowest first. A truncated file may have fewer bytes.
bool beginsAnObject(std::string_view bytes) {
  constexpr std::size_t kShortestName = 3;
  constexpr std::size_t kLongestName = 120;
  constexpr unsigned kTopBit = 0x80;
  const unsigned first = static_cast<unsigned char>(bytes.front());
  const bool short_form = (first & kTopBit) != 0;
  const std::size_t length = first & ~kTopBit;
  if (length < kShortestName || length > kLongestName) return false;
  bytes.remove_prefix(1);
  if (!short_form) {
    const std::string_view zeros = bytes.substr(0, 3);
    if (!std::all_of(zeros.begin(), zeros.end(), [](char c) { return c == '\0'; })) return false;
    bytes.remove_prefix(zeros.size());
  }
  const std::string_view name = bytes.substr(0, length);
  return std::all_of(name.begin(), name.end(), isNameCharacter);
}

}  // namespace

std::optional<std::string> whyNoRawlog(const std::filesystem::path& file) {
  constexpr std::size_t kBytes = 128;
  constexpr std::size_t kShown = 24;
  GzInputStream stream(file);
  std::string bytes(kBytes, '\0');
  try {
    bytes.resize(stream.Read(bytes.data(), bytes.size()));
  } catch (const std::exception&) {
    return std::nullopt;  // damaged: the reader reports it
  }
  if (bytes.empty()) return "it is empty";
  if (beginsAnObject(bytes)) return std::nullopt;
  return "it begins with " + inQuotes(bytes.substr(0, kShown));
}

void requireRawlog(const std::filesystem::path& file) {
  std::optional<std::string> why = whyNoRawlog(file);
  if (!why) return;
#ifndef EFM_WITH_ARCHIVES
  if (isCompressed(file)) {
    *why += "; this build does not read other compressed files, EFM_READ_ARCHIVES";
  }
#endif
  throw std::runtime_error(
      file.string() + ": not a rawlog (" + *why +
      "): expected a rawlog, or a recording in another format (docs/recordings.md)");
}

}  // namespace efm
