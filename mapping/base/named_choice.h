// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "mapping/base/nearest_name.h"

namespace efm {

/// One enumerator and its name in option files and messages.
template <typename Enum>
struct NamedChoice {
  Enum value;
  std::string_view name;
};

/// The name of an enumerator. `table` has all of them.
template <typename Enum, std::size_t N>
std::string_view nameIn(const NamedChoice<Enum> (&table)[N], Enum value) {
  for (const auto& choice : table) {
    if (choice.value == value) return choice.name;
  }
  throw std::logic_error("an enumerator has no name");
}

/// The enumerator with a name.
/// @throws std::invalid_argument naming the value, and the nearest of the known names.
template <typename Enum, std::size_t N>
Enum valueIn(const NamedChoice<Enum> (&table)[N], std::string_view name) {
  std::vector<std::string> known;
  for (const auto& choice : table) {
    if (choice.name == name) return choice.value;
    known.emplace_back(choice.name);
  }
  throw std::invalid_argument("'" + std::string(name) +
                              "' is unknown: " + expectedName(name, known));
}

}  // namespace efm
