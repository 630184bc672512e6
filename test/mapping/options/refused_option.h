// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <stdexcept>

namespace efm::test {

/// Expects that `validate` refuses options with one change, and that the error has the message.
template <typename Options, typename Change>
void expectRefused(const char* message, Change change, Options options = {}) {
  change(options);
  EXPECT_THAT([&] { options.validate(); },
              ::testing::ThrowsMessage<std::invalid_argument>(::testing::HasSubstr(message)));
}

}  // namespace efm::test
