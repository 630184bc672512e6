// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "plugin/recordings/calibration/calibration_file.h"

namespace efm {

/// Options of the rig, in place of the recording's own.
struct RigOptions {
  std::filesystem::path calibration;          ///< Empty: from the recording.
  std::filesystem::path hand_eye;             ///< Empty: from the recording.
  std::vector<std::int64_t> time_offsets_ns;  ///< One per camera; empty: none.
  std::string pose_source;  ///< The label of the source's sensor; empty: the best source.
};

/// The content of the files that RigOptions name.
struct RigSetup {
  std::optional<Calibration> calibration;
  std::optional<Rigid3> T_body_rig;  ///< Pose of the rig on the tracked body.
};

/// @throws std::runtime_error naming a file that cannot be read or understood.
RigSetup readRigSetup(const RigOptions& options);

}  // namespace efm
