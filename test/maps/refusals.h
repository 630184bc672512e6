// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <string>
#include <type_traits>

#include "test/plugin/temporary_folder.h"

namespace efm::test {

/// The lowest value of a field that must be above 0.
constexpr double kAboveZero = std::numeric_limits<double>::denorm_min();

/// Expects that `validate` accepts both ends of a field's range and refuses the next values beyond
/// them, by the name of the field.
/// @param highest infinite where the range has no upper end.
template <typename Options, typename Value>
void expectRange(Value Options::*field, std::common_type_t<Value> lowest,
                 std::common_type_t<Value> highest, const std::string& name) {
  const auto errorOf = [&](Value value) {
    Options options;
    options.*field = value;
    return messageOf([&] { options.validate(); });
  };
  EXPECT_EQ(errorOf(lowest), "no error") << name;
  EXPECT_EQ(errorOf(highest), "no error") << name;
  const auto refused = testing::HasSubstr(name + " = ");
  if constexpr (std::is_floating_point_v<Value>) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    EXPECT_THAT(errorOf(std::nextafter(lowest, -kInfinity)), refused);
    if (highest < kInfinity) {
      EXPECT_THAT(errorOf(std::nextafter(highest, kInfinity)), refused);
    }
    EXPECT_THAT(errorOf(std::nan("")), refused);
  } else {
    EXPECT_THAT(errorOf(lowest - 1), refused);
    if (highest < std::numeric_limits<Value>::max()) {
      EXPECT_THAT(errorOf(highest + 1), refused);
    }
  }
}

}  // namespace efm::test
