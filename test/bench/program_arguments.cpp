// SPDX-License-Identifier: BSD-3-Clause
#include "test/bench/program_arguments.h"

#include <algorithm>
#include <stdexcept>

namespace efm::bench {
namespace {

bool contains(const std::vector<std::string>& words, const std::string& word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

}  // namespace

std::string ProgramArguments::value(const std::string& option, const std::string& otherwise) const {
  const auto found = values.find(option);
  return found != values.end() ? found->second : otherwise;
}

bool ProgramArguments::includes(const std::string& name) const {
  return names.empty() || contains(names, name);
}

ProgramArguments readArguments(const std::vector<std::string>& words, const ArgumentRules& rules) {
  ProgramArguments arguments;
  for (auto word = words.begin(); word != words.end(); ++word) {
    if (*word == "--quick") {
      arguments.quick = true;
    } else if (contains(rules.options, *word)) {
      if (word + 1 == words.end()) throw std::invalid_argument(*word + ": expected a value");
      const std::string& option = *word;
      arguments.values[option] = *++word;
    } else if (contains(rules.names, *word)) {
      arguments.names.push_back(*word);
    } else {
      throw std::invalid_argument(*word + " is not known\n" + rules.usage);
    }
  }
  return arguments;
}

}  // namespace efm::bench
