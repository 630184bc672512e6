// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace efm {

/// The known name that was probably meant by a mistyped one: the one with the fewest letters
/// missing, added, replaced or swapped with the next one; the first of several. At most a third of
/// the longer name's letters, and at least one, may differ. Capitals, '-' and '_' do not count.
std::optional<std::string> nearestName(std::string_view typed,
                                       const std::vector<std::string>& known);

/// What an error about an unknown name says of the known ones: "did you mean rms? One of: min, rms"
/// or "expected one of min, rms". A long list is left out where one of its names is near.
std::string expectedName(std::string_view typed, const std::vector<std::string>& known);

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
