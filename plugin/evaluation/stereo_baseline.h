// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace efm {

/// A rectified stereo pair: the disparity of a depth Z is focal_px * baseline_m / Z pixels.
struct StereoBaseline {
  double focal_px = 0;    ///< Above 0.
  double baseline_m = 0;  ///< Above 0.
  std::string source;     ///< The file of both values, or "as given". For tables.

  double focalBaseline() const { return focal_px * baseline_m; }
};

/// Reads the stereo pair from the report.json of the run that wrote the estimate, in `estimate` or
/// up to three folders above it. Otherwise reads it from the camchain.yaml of the truth's dataset,
/// in `truth` or up to two folders above it: camera 0's fx and its distance to camera 1.
/// @return nothing if neither file has it.
/// @throws std::runtime_error naming a camchain.yaml that cannot be read.
std::optional<StereoBaseline> findStereoBaseline(const std::filesystem::path& estimate,
                                                 const std::filesystem::path& truth);

}  // namespace efm
