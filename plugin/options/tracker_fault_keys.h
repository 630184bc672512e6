// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "plugin/options/option_value.h"
#include "tracking_stub/faults/tracker_faults.h"

namespace efm {

/// A tracker's faults as text, in metres, degrees and seconds; what each key means is said where it
/// is stored. `seed` is that of all draws.

/// Sets what "key=value" says.
/// @throws std::invalid_argument naming the key, its value and what was expected.
void setTrackerFault(std::string_view assignment, TrackerFaults& faults);

/// All keys with their values, which read back the same but for the rounding of degrees; without
/// those that are not given.
std::vector<std::pair<std::string, OptionValue>> listTrackerFaults(const TrackerFaults& faults);

/// "noise_m, noise_deg, ...".
std::string knownTrackerFaults();

/// For who cannot say how long a keyframe is.
/// @throws std::invalid_argument where noise per keyframe is asked for, but not for how long.
void requireKeyframeLength(const TrackerFaults& faults);

}  // namespace efm
