// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "plugin/recordings/columns/npy_array.h"
#include "plugin/recordings/streams/recording_parts.h"

namespace efm {

/// Opens the events of a camera in columns of NumPy arrays. Polarity is 0 or 1, or -1 or 1. If the
/// arrays are not compressed, `seek` uses bisection.
/// @param table columns t, x, y and p.
/// @throws std::runtime_error naming an array whose length differs from t's, or whose unit of time
/// is not certain.
std::unique_ptr<EventStream> openArrayEvents(EventTable table, const ReaderOptions& options);

/// Events in NumPy arrays (.npy), a file per camera: a structured array with the fields x, y, p and
/// t, as Metavision's software saves it (then t is in microseconds). `ef.events` in Python makes
/// such an array of others.

/// Reads a radtan lens from K (3 x 3) and D (k1 k2 p1 p2 k3) of an archive, without the sensor's
/// size.
CameraModel lensIn(const std::filesystem::path& archive);

/// Returns whether a file is a NumPy array, also compressed, or an archive of arrays. Never throws.
bool looksLikeNumpy(const std::filesystem::path& file);

/// Returns names and shapes of a file's arrays, for errors: "t (100), x (100)".
std::string arraysIn(const std::filesystem::path& file);

/// @throws std::runtime_error naming the file, its content and the expected content.
RecordingParts openEventArrays(const std::vector<std::filesystem::path>& files,
                               const ReaderOptions& options);

/// EVIMO2 v2 (Burner et al., 2022) as NumPy arrays, a folder per camera and sequence:
///   dataset_events_t.npy    N times in seconds, real
///   dataset_events_xy.npy   N x 2, pixel
///   dataset_events_p.npy    N polarities, 0 or 1; inverted for the Samsung camera
///   dataset_info.npz        K (3 x 3), D (k1 k2 p1 p2: radtan); `meta` is a pickled Python object
///   dataset_depth.npz       optional: its arrays have the sensor's size; without it 640x480
///   poses.txt               optional, not part of the data set: T_world_cam, from `meta`
/// Each of several folders is a camera. Several cameras have no common calibration, because the
/// data set stores the transforms between them only in Python objects.

/// Returns whether the folder has a dataset_events_t.npy.
bool looksLikeEvimo2(const std::filesystem::path& folder);

/// @throws std::runtime_error naming the file that is missing or wrong.
RecordingParts openEvimo2(const std::vector<std::filesystem::path>& folders,
                          const ReaderOptions& options);

}  // namespace efm
