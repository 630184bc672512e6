// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

namespace efm {

struct TimedFile {
  std::int64_t t_ns = 0;
  std::filesystem::path file;
};

/// The files that a text lists, in its order: `t file` a line, t in decimal seconds, files beside
/// it; # begins a comment, empty lines count for nothing.
/// @throws std::runtime_error naming the list where it cannot be read, or its line that is not
/// understood.
std::vector<TimedFile> timedFilesIn(const std::filesystem::path& list);

}  // namespace efm
