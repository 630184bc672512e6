// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "plugin/recordings/streams/recording_parts.h"

namespace efm {

/// Finds and opens the HDF5 files of a recording. Finding them needs no HDF5 library.

struct CameraFile {
  std::string camera;  ///< "left", "right" or the folder's "camN"; empty: unknown.
  std::filesystem::path file;
};

/// Returns the HDF5 files of a folder, as data sets are downloaded and unpacked: files in the
/// folder, in its folders with "event" in their names, and in camera folders inside these folders:
///   events/left/events.h5, events/right/events.h5              DSEC, event-fusion's export
///   NAME_events_left/events.h5, NAME_events_right/events.h5    DSEC
///   NAME-events_left.h5, NAME-events_right.h5                  TUM-VIE
///   NAME.synced.left_event.hdf5, NAME.synced.right_event.hdf5  VECtor
///   NAME_data.h5, NAME_pose_gt.h5                              M3ED
///   NAME_data.hdf5, NAME_gt.hdf5                               MVSEC
/// Maps of rectified pixels (rectify_map.h5) are left out. The files are in the order of the
/// cameras: left, right, others by name. Never throws.
std::vector<CameraFile> hdf5FilesIn(const std::filesystem::path& folder);

/// Returns whether a source is an HDF5 file, or a folder with files of `hdf5FilesIn`. Never throws.
bool looksLikeHdf5(const std::filesystem::path& source);

/// Opens HDF5 files with events (`hdf5Layouts` in hdf5_recording.cpp), poses or both, and their
/// folders (`hdf5FilesIn`). A folder may have camchain.yaml and poses.txt, too. Poses are
///   /davis/left/pose, /davis/left/pose_ts   MVSEC: T_world_cam0, seconds
///   /Cn_T_C0, /ts                           M3ED: T_cam0_world, microseconds
/// M3ED's files include the calibration: calib/ beside the events of a camera.
RecordingParts openHdf5(const std::vector<std::filesystem::path>& sources,
                        const ReaderOptions& options);

}  // namespace efm
