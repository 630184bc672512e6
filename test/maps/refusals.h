// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <stdexcept>
#include <string>

namespace efm::test {

/// Expects that `validate` refuses default options with this value of a field, and that the message
/// contains the text.
template <typename Options, typename Value>
void expectRefused(Value Options::*field, std::common_type_t<Value> value,
                   const std::string& text) {
  Options options;
  options.*field = value;
  EXPECT_THAT([&] { options.validate(); },
              testing::ThrowsMessage<std::invalid_argument>(testing::HasSubstr(text)));
}

}  // namespace efm::test
