// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/obs/CObservation.h>

#include <vector>

#include "plugin/session/health_checks.h"

namespace efm {

/// Counts the events or the pose of an observation. @return false for other observations.
bool addObservation(const mrpt::obs::CObservation& observation, RecordingStatistics& statistics);

/// Prints a line per warning to stderr: "event-fusion: warning: NAME: text".
void printWarnings(const std::vector<Warning>& warnings);

/// For --strict: prints an error if there are warnings. @return whether there are.
bool failStrictly(const std::vector<Warning>& warnings);

}  // namespace efm
