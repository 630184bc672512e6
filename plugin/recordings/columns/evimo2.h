// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <vector>

#include "plugin/recordings/streams/recording_parts.h"

namespace efm {

/// EVIMO2 v2 (Burner et al., 2022) as NumPy arrays, a folder per camera and sequence:
///   dataset_events_t.npy    N times in seconds, real
///   dataset_events_xy.npy   N x 2, pixel
///   dataset_events_p.npy    N polarities, 0 or 1; the Samsung camera's are the other way around
///   dataset_info.npz        K (3 x 3), D (k1 k2 p1 p2: radtan); `meta` is a pickled Python object
///   dataset_depth.npz       optional: the size of its arrays is the sensor's, else 640x480
///   poses.txt               optional, not part of the data set: T_world_cam, from `meta`
/// Of several folders, each is a camera. They have no calibration together, because the data set
/// has no transform between them outside of Python objects.

/// Whether the folder has a dataset_events_t.npy.
bool looksLikeEvimo2(const std::filesystem::path& folder);

/// @throws std::runtime_error naming the file that is missing or wrong.
RecordingParts openEvimo2(const std::vector<std::filesystem::path>& folders,
                          const ReaderOptions& options);

}  // namespace efm
