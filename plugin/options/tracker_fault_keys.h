// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "plugin/options/option_keys.h"
#include "tracking_stub/faults/tracker_faults.h"

namespace efm {

/// Faults of a tracker as text, in metres, degrees and seconds. The meaning of each key is in the
/// fields of TrackerFaults. `seed` is the seed of all random draws.

/// Sets one fault from "key=value".
void setTrackerFault(std::string_view assignment, TrackerFaults& faults);

/// Returns all keys with their values, without keys that have no value. Reading a value back gives
/// the same value, except for the rounding of degrees.
std::vector<std::pair<std::string, OptionValue>> listTrackerFaults(const TrackerFaults& faults);
/// Returns the same as an object.
nlohmann::ordered_json asJson(const TrackerFaults& faults);

/// Returns all keys: "noise_m, noise_deg, ...".
std::string knownTrackerFaults();

}  // namespace efm
