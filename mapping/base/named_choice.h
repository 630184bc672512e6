// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace efm {

/// Returns the known name nearest to a mistyped name: with the fewest letters missing, added,
/// replaced or swapped with the next letter; the first of several. At most a third of the longer
/// name's letters, and at least one, may differ. Upper and lower case, '-' and '_' do not count.
std::optional<std::string> nearestName(std::string_view typed,
                                       const std::vector<std::string>& known);

/// Returns the part of an error message that lists the known names: "did you mean rms? One of: min,
/// rms" or "expected one of min, rms". Leaves out a list of more than 8 names if one is near.
std::string expectedName(std::string_view typed, const std::vector<std::string>& known);

/// An enumerator and its name in option files and messages.
template <typename Enum>
struct NamedChoice {
  Enum value;
  std::string_view name;
};

/// All enumerators of an enumeration: a specialisation is a table of NamedChoice.
template <typename Enum>
inline constexpr int kNamesOf = 0;

/// Returns the name of an enumerator. `table` has all enumerators.
template <typename Enum, std::size_t N>
std::string_view nameIn(const NamedChoice<Enum> (&table)[N], Enum value) {
  for (const auto& choice : table) {
    if (choice.value == value) return choice.name;
  }
  throw std::logic_error("an enumerator has no name");
}

/// Returns the enumerator with a name. @throws std::invalid_argument if the name is unknown.
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

/// Returns the name of an enumerator, in option files and messages.
template <typename Enum>
std::string_view nameOf(Enum value) {
  return nameIn(kNamesOf<Enum>, value);
}
/// Returns the enumerator with a name. @throws std::invalid_argument if the name is unknown.
template <typename Enum>
Enum fromName(std::string_view name) {
  return valueIn(kNamesOf<Enum>, name);
}

}  // namespace efm
