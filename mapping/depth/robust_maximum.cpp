// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/depth/robust_maximum.h"

#include <algorithm>

namespace efm {

void RobustMaximum::add(double value) {
  values_.insert(std::upper_bound(values_.begin(), values_.end(), value), value);
}

std::optional<double> RobustMaximum::value() const {
  if (values_.empty()) return std::nullopt;
  const std::size_t rank = (values_.size() * 95 + 99) / 100;  // rounded up, from 1
  return values_[rank - 1];
}

}  // namespace efm
