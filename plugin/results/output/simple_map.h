// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "plugin/session/map_snapshot.h"

namespace efm {

/// Returns keyframes as MRPT's archive of a `CSimpleMap`: per keyframe its view's pose, and one
/// observation "keyframe" with its points in the view and their confidences as intensities. These
/// are the versions that MRPT 2.5 writes, and later ones read. Made without MRPT, whose libraries
/// take longer to load than a short map takes to write.
std::string simpleMapArchive(const std::vector<StoredKeyframe>& keyframes);

/// Writes the archive as MRPT does: compressed as gzip, level 1.
/// @throws std::runtime_error if the file cannot be written.
void writeSimpleMap(const std::filesystem::path& file,
                    const std::vector<StoredKeyframe>& keyframes);

}  // namespace efm
