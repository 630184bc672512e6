// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace efm::bench {

/// The conditions of a run: pairs of a name and a text.
using Conditions = std::vector<std::pair<std::string, std::string>>;

/// The processor with its cores and caches, the compiler and its flags.
Conditions describeMachine();

/// Mean number of running or waiting processes over the last minute.
std::string loadAverage();

}  // namespace efm::bench
