// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>
#include <vector>

namespace efm::bench {

/// The command line of the benchmarks and of the studies.
struct ProgramArguments {
  bool quick = false;
  std::map<std::string, std::string> values;  ///< By option: "--out".
  std::vector<std::string> names;             ///< Of groups or studies; empty for all.

  std::string value(const std::string& option, const std::string& otherwise = "") const;
  /// Whether this group or study must run.
  bool includes(const std::string& name) const;
};

/// A command line that a program accepts.
struct ArgumentRules {
  std::vector<std::string> options;  ///< Options with a value.
  std::vector<std::string> names;    ///< Known groups or studies.
  std::string usage;
};

/// @throws std::invalid_argument with the usage where a word is not known or a value is missing.
ProgramArguments readArguments(const std::vector<std::string>& words, const ArgumentRules& rules);

}  // namespace efm::bench
