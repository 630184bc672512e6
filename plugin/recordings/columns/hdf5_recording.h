// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <vector>

#include "plugin/recordings/streams/recording_parts.h"

namespace efm {

/// Opens HDF5 files with events (see hdf5_events.h), poses or both, and folders with them (see
/// hdf5_files.h). A folder may have camchain.yaml and poses.txt, too. Poses are
///   /davis/left/pose, /davis/left/pose_ts   MVSEC: T_world_cam0, seconds
///   /Cn_T_C0, /ts                           M3ED: T_cam0_world, microseconds
/// M3ED has the calibration in the file: calib/ beside the events of a camera.
/// @throws std::runtime_error naming the file and the data set that is missing or wrong.
RecordingParts openHdf5(const std::vector<std::filesystem::path>& sources,
                        const ReaderOptions& options);

}  // namespace efm
