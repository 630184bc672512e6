// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/base/named_choice.h"

#include <algorithm>
#include <cstddef>

namespace efm {
namespace {

std::string folded(std::string_view name) {
  std::string text(name);
  for (char& c : text) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    if (c == '-') c = '_';
  }
  return text;
}

/// Returns the distance of Damerau and Levenshtein, without editing a letter twice.
std::size_t editDistance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before_last;
  std::vector<std::size_t> last(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) last[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::vector<std::size_t> row(b.size() + 1, i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, replaced});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
        row[j] = std::min(row[j], before_last[j - 2] + 1);
      }
    }
    before_last = std::move(last);
    last = std::move(row);
  }
  return last.back();
}

}  // namespace

std::optional<std::string> nearestName(std::string_view typed,
                                       const std::vector<std::string>& known) {
  constexpr std::size_t kLongest = 64;  // longer text is no name
  if (typed.empty() || typed.size() > kLongest) return std::nullopt;
  std::optional<std::string> nearest;
  std::size_t least = kLongest;
  for (const std::string& name : known) {
    const std::size_t distance = editDistance(folded(typed), folded(name));
    const std::size_t limit = std::max<std::size_t>(1, std::max(typed.size(), name.size()) / 3);
    if (distance > limit || distance >= least) continue;
    least = distance;
    nearest = name;
  }
  return nearest;
}

std::string expectedName(std::string_view typed, const std::vector<std::string>& known) {
  constexpr std::size_t kShortList = 8;
  std::string list;
  for (const std::string& name : known) list += (list.empty() ? "" : ", ") + name;
  const std::optional<std::string> nearest = nearestName(typed, known);
  if (!nearest) return "expected one of " + list;
  const std::string question = "did you mean " + *nearest + "?";
  return known.size() > kShortList ? question : question + " One of: " + list;
}

}  // namespace efm
