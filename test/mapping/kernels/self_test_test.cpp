// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/kernels/self_test.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "mapping/dsi/voting_kernel.h"

namespace efm::kernels {
namespace {

TEST(SelfTest, EveryKernelOfThisProcessorPasses) {
  for (const VotingKernel kernel : availableKernels()) {
    for (const std::uint32_t seed : {1U, 2U, 3U}) {
      EXPECT_THAT(selfTest(kernel, seed), ::testing::IsEmpty()) << nameOf(kernel) << ", " << seed;
    }
  }
}

}  // namespace
}  // namespace efm::kernels
