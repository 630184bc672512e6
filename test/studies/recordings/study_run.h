// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "test/studies/recordings/recording_cache.h"

namespace efm::studies {

/// The input of every study.
struct StudyRun {
  bool quick = false;              ///< Tiny: tests that the study runs. Its numbers mean nothing.
  std::filesystem::path data;      ///< Real calibrations and trajectories.
  std::filesystem::path pictures;  ///< Folder of the pictures.
  RecordingCache* recordings = nullptr;

  /// The setting for this run.
  template <typename Value>
  Value pick(Value in_full, Value in_quick) const {
    return quick ? in_quick : in_full;
  }
};

}  // namespace efm::studies
