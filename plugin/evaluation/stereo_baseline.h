// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace efm {

/// What turns a depth Z into the disparity of a rectified pair: focal_px * baseline_m / Z, pixels.
struct StereoBase {
  double focal_px = 0;    ///< Above 0.
  double baseline_m = 0;  ///< Above 0.
  std::string source;     ///< Where the two come from: for people.

  double focalBaseline() const { return focal_px * baseline_m; }
};

/// Looks for it beside depth maps: in the report.json of the run that wrote the estimate (at
/// `estimate` or up to three folders above it), else in the camchain.yaml of the truth's dataset
/// (at `truth` or up to two folders above it), where it is camera 0's fx and its distance to
/// camera 1.
/// @return nothing where neither says it.
/// @throws std::runtime_error naming a camchain.yaml that is there and not understood.
std::optional<StereoBase> findStereoBase(const std::filesystem::path& estimate,
                                         const std::filesystem::path& truth);

}  // namespace efm
