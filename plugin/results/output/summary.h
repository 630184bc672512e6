// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>

#include "plugin/results/output/map_output.h"
#include "plugin/results/output/report.h"

namespace efm {

/// The result of a run in plain words, for the user: a line per fact, under 20 lines. A fact that
/// is not known or does not apply has no line.
/// @param kind `kDepth`: of one keyframe.
/// @param folder with the results.
std::string summaryOf(const MapReport& report, OutputKind kind,
                      const std::filesystem::path& folder);

}  // namespace efm
