// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace efm::bench {

/// What a run was measured on and with: pairs of a name and a text.
using Conditions = std::vector<std::pair<std::string, std::string>>;

/// The processor with its cores and caches, the compiler and its flags.
Conditions describeMachine();

/// The processes that ran or wanted to, on average over the last minute.
std::string loadAverage();

}  // namespace efm::bench
