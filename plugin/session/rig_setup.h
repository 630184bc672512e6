// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "plugin/calibration/calibration_file.h"

namespace efm {

/// What is said of the rig beside the recording, in place of what that says itself.
struct RigOptions {
  std::filesystem::path calibration;          ///< Empty: from the recording.
  std::filesystem::path hand_eye;             ///< Empty: from the recording.
  std::vector<std::int64_t> time_offsets_ns;  ///< One per camera; empty: none.
  std::string pose_source;                    ///< The label of its sensor; empty: the best.
};

/// The same, with its files read. Applying it twice is as good as once: it replaces.
struct RigSetup {
  std::optional<Calibration> calibration;
  std::optional<Rigid3> T_body_rig;  ///< From the tracked body to the rig.
};

/// @throws std::runtime_error naming a file that cannot be read or is not understood.
RigSetup readRigSetup(const RigOptions& options);

}  // namespace efm
