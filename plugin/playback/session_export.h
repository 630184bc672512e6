// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "mapping/events/window.h"
#include "mapping/geometry/rigid3.h"
#include "maps/cloud/map_point.h"
#include "plugin/session/event_fusion_options.h"
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
  /// Poses that replace those of the keyframes: T_world_ref, if there is exactly one at the t_ref
  /// of each keyframe (as in trajectory.txt); else those of the rig, interpolated. Empty: none.
  std::filesystem::path poses;
  std::vector<Rigid3> T_first_this;  ///< Of the second session and further ones; none: identity.
  bool store = false;                ///< Add the poses to the session as a generation.
};

/// Returns the options of the map.
/// @throws std::invalid_argument naming a wrong option; std::runtime_error naming a file that
/// cannot be used.
EventFusionOptions optionsOf(const SessionExport& what);
/// Makes the map again: that of a new run with these options, bit for bit (docs/session.md names
/// the exceptions). A refinement is that of the stored poses.
/// @param keeps_keyframes whether it has the points of each keyframe, for a simplemap.
/// @throws as `optionsOf`, and if there is no point.
MapSnapshot mapOf(const SessionExport& what, bool keeps_keyframes);

/// Returns whether `exportSession` writes files with this ending.
bool isMapFile(const std::filesystem::path& out);
/// @throws std::invalid_argument unless `exportSession` writes such a map to a file of this name.
void requireEnding(const std::filesystem::path& out, const SessionExport& what);
/// Writes the map of sessions. The ending of `out` decides: .pcd, .ply, .simplemap, as `map` writes
/// them. @return the map. @throws as `mapOf` and `requireEnding`.
MapSnapshot exportSession(const SessionExport& what, const std::filesystem::path& out);

}  // namespace efm
