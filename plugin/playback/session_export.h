// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "mapping/events/window.h"
#include "maps/cloud/map_point.h"
#include "plugin/session/map_snapshot.h"

namespace efm {

/// A box in the world, metres. Points on its surface belong to it.
struct Box {
  Eigen::Vector3d min_m, max_m;
};

/// Returns the session file that a path names: a file with the topic /efm/keyframe, or the
/// session.mcap of a folder. std::nullopt: it is neither.
std::optional<std::filesystem::path> sessionAt(const std::filesystem::path& path);

/// A map to make again from session files, without the recording.
struct SessionExport {
  /// One after the other: the keyframes of the next session follow those of the one before it, and
  /// the options are those of the first one.
  std::vector<std::filesystem::path> sessions;
  /// "map.voxel_size_m=0.02": options of [map], and a higher depth.min_probability.
  std::vector<std::string> sets;
  TimeLimits limits;       ///< Keyframes whose t_ref is outside are left out.
  std::optional<Box> box;  ///< Points outside are left out.
  bool refined = true;     ///< false: the poses are the tracker's.
};

/// Makes the map again: that of a new run with these options, bit for bit. A refinement is that of
/// the stored poses.
/// @throws std::invalid_argument naming a wrong option; std::runtime_error naming a file that
/// cannot be read.
MapSnapshot mapOf(const SessionExport& what);

/// Writes the map of sessions. The ending of `out` decides: .pcd, .ply, .simplemap, as `map` writes
/// them. @return the map. @throws as `mapOf`, and for an unknown ending.
MapSnapshot exportSession(const SessionExport& what, const std::filesystem::path& out);

}  // namespace efm
