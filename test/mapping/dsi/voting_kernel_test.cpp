// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/dsi/dsi_grid.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>
#include <string>

#include "mapping/sweep/space_sweep.h"

namespace efm {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr VotingKernel kAll[] = {VotingKernel::kPlain,  VotingKernel::kBaseline,
                                 VotingKernel::kSse4,   VotingKernel::kAvx2,
                                 VotingKernel::kAvx512, VotingKernel::kNeon};

TEST(VotingKernel, PlainIsTheFirstOfTheAvailableOnes) {
  EXPECT_EQ(availableKernels().front(), VotingKernel::kPlain);
  EXPECT_TRUE(std::is_sorted(availableKernels().begin(), availableKernels().end()));
  EXPECT_EQ(fastestKernel(), fastestOf(availableKernels()));
}

TEST(VotingKernel, TheFastestIsNeverOneThatIsSlowerThanPlain) {
  using K = VotingKernel;
  EXPECT_EQ(fastestOf({K::kPlain}), K::kPlain);
  EXPECT_EQ(fastestOf({K::kPlain, K::kBaseline}), K::kPlain);
  EXPECT_EQ(fastestOf({K::kPlain, K::kBaseline, K::kSse4}), K::kSse4);
  EXPECT_EQ(fastestOf({K::kPlain, K::kBaseline, K::kSse4, K::kAvx2}), K::kAvx2);
  EXPECT_EQ(fastestOf({K::kPlain, K::kBaseline, K::kSse4, K::kAvx2, K::kAvx512}), K::kAvx512);
  EXPECT_EQ(fastestOf({K::kPlain, K::kBaseline, K::kNeon}), K::kNeon);
}

TEST(VotingKernel, TheSweepAcceptsEveryAvailableKernelAndRefusesTheOthersByName) {
  EXPECT_EQ(SpaceSweepOptions().kernelOrFastest(), fastestKernel());
  for (const VotingKernel kernel : kAll) {
    SpaceSweepOptions options;
    options.kernel = kernel;
    if (isAvailable(kernel)) {
      EXPECT_NO_THROW(options.validate()) << nameOf(kernel);
      EXPECT_EQ(options.kernelOrFastest(), kernel);
    } else {
      EXPECT_THAT([&] { options.validate(); },
                  ThrowsMessage<std::invalid_argument>(AllOf(
                      HasSubstr("kernel = " + std::string(nameOf(kernel))), HasSubstr("plain, "),
                      HasSubstr(std::string(nameOf(fastestKernel()))))));
    }
  }
}

}  // namespace
}  // namespace efm
