// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <vector>

#include "plugin/recordings/streams/recording_parts.h"

namespace efm {

/// Events in NumPy arrays, a file per camera:
///   .npy    N x 4 or 4 x N numbers, whose order is found from the values as that of text;
///           or a structured array with the fields t, x, y and p; Metavision's is in microseconds
///   .npz    t, x, y and p, an array of N numbers each; or one array as in a .npy file
/// Fields and arrays are known by the names that columns of text have (xs, timestamps_us, polarity
/// …), or by those that `--event-columns "t=NAME x=NAME y=NAME p=NAME"` gives; others are left out.

/// Whether it is a NumPy array, also a compressed one, or an archive of arrays alone. Never throws.
bool looksLikeNumpy(const std::filesystem::path& file);

/// @throws std::runtime_error naming the file, what it has and what was expected.
RecordingParts openEventArrays(const std::vector<std::filesystem::path>& files,
                               const ReaderOptions& options);

}  // namespace efm
