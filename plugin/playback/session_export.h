// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include "plugin/playback/session_map.h"

namespace efm {

/// The files that `exportSession` writes, for messages.
inline constexpr const char* kMapFiles =
    ".pcd, .ply, .html, .simplemap, .mcap (a session), or a folder whose name ends with colmap";

/// Returns whether `exportSession` writes files of this name.
bool isMapFile(const std::filesystem::path& out);
/// @throws std::invalid_argument unless `exportSession` writes such a map to this path.
void requireMapFile(const std::filesystem::path& out, const SessionExport& what);

struct ExportedMap {
  std::size_t points = 0;
  std::string hash;  ///< `mapHash` of the points.
};

/// Writes the map of sessions. The ending of `out` decides: .pcd, .ply, .simplemap and .html as
/// `map` writes them (the page has the numbers of the run for a whole session alone); .mcap is a
/// session of the chosen keyframes, which keep the transforms as their poses; colmap, see
/// `ColmapModel`. A .pcd is made in slabs: its memory does not grow with the map.
/// @throws std::runtime_error naming a file that cannot be used or written; std::invalid_argument
/// as `requireMapFile`. Then there is no result.
ExportedMap exportSession(const SessionMap& map, const std::filesystem::path& out);

}  // namespace efm
