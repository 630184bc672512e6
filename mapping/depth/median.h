// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>
#include <vector>

namespace efm {

/// Of n values in order the one with index n / 2: the larger middle one where n is even.
/// @param values at least one; they are reordered. Cost: linear on average.
template <typename Value, typename Less = std::less<Value>>
const Value& upperMedian(std::vector<Value>& values, Less less = {}) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end(), less);
  return *middle;
}

}  // namespace efm
