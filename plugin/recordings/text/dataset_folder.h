// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <vector>

#include "plugin/recordings/streams/recording_parts.h"

namespace efm {

/// The project's own text layout, which `event-fusion simulate` writes:
///   camchain.yaml     the rig
///   camN/events.txt   t x y p, for each camera of the rig; empty for a silent camera; other names
///                     and columns: `eventFileIn`, `findEventColumns`
///   poses.txt         or groundtruth.txt: t tx ty tz qx qy qz qw, T_world_cam0 (`readPoseText`)
///   depth/index.txt   the truth, optional: t file, depth maps of camera 0 (see TimedFile)
/// Other files are ignored. Events of a camera that camchain.yaml does not have are an error.

/// Returns whether the folder has a camchain.yaml, or events in cam0.
bool looksLikeDatasetFolder(const std::filesystem::path& folder);

/// Opens a folder. The cameras are those of camchain.yaml, else cam0, cam1, … without gaps.
RecordingParts openDatasetFolder(const std::vector<std::filesystem::path>& folders,
                                 const ReaderOptions& options);

/// Adds the folder's calibration (camchain.yaml) and poses (poses.txt or groundtruth.txt), if the
/// parts have none.
void addFolderFiles(const std::filesystem::path& folder, const ReaderOptions& options,
                    RecordingParts& parts);

/// Reads a list of files, in its order: a line is `t file`, with t in decimal seconds and the file
/// relative to the list's folder. A # begins a comment.
std::vector<TimedFile> timedFilesIn(const std::filesystem::path& list);

/// Returns the depth maps in depth/index.txt, one line `t file` each; none without this file.
std::vector<TimedFile> truthOfFolder(const std::filesystem::path& folder);

/// The text layout of the UZH event camera dataset (Mueggler et al., IJRR 2017), one camera:
///   events.txt        t x y p; other names and columns: `eventFileIn`, `findEventColumns`
///   groundtruth.txt   t px py pz qx qy qz qw, T_world_cam
///   calib.txt         fx fy cx cy k1 k2 p1 p2 k3
///   images.txt        t file, optional: the size of the first existing image is the sensor's.

/// Returns whether the folder has events.
bool looksLikeUzhFolder(const std::filesystem::path& folder);

/// @throws std::runtime_error naming the file (and line) that is missing or wrong.
RecordingParts openUzhFolder(const std::vector<std::filesystem::path>& folders,
                             const ReaderOptions& options);

}  // namespace efm
