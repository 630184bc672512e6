// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "test/studies/recordings/recording_cache.h"

namespace efm::studies {

/// What every study is given.
struct StudyRun {
  bool quick = false;              ///< Tiny: shows that everything runs, its numbers mean nothing.
  std::filesystem::path data;      ///< Real calibrations and trajectories.
  std::filesystem::path pictures;  ///< Where pictures go.
  RecordingCache* recordings = nullptr;

  /// The one of two settings that this run wants.
  template <typename Value>
  Value pick(Value in_full, Value in_quick) const {
    return quick ? in_quick : in_full;
  }
};

}  // namespace efm::studies
