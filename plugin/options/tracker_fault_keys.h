// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "plugin/options/option_keys.h"
#include "tracking_stub/faults/tracker_faults.h"

namespace efm {

/// A tracker's faults as text, in metres, degrees and seconds; the fields of TrackerFaults say the
/// meaning of each key. `seed` is the seed of all random draws.

/// Sets one fault from "key=value".
void setTrackerFault(std::string_view assignment, TrackerFaults& faults);

/// All keys with their values, except keys without a value. Values read back the same, except for
/// the rounding of degrees.
std::vector<std::pair<std::string, OptionValue>> listTrackerFaults(const TrackerFaults& faults);

/// "noise_m, noise_deg, ...".
std::string knownTrackerFaults();

}  // namespace efm
