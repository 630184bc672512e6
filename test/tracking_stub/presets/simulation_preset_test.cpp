// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/presets/presets.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

std::string errorOf(const SimulationOptions& options) {
  return messageOf([&] { options.validate(); });
}

TEST(SimulationPreset, AnUnknownNameIsAnErrorThatListsTheKnownOnes) {
  SimulationOptions options;
  options.preset = "attic";
  EXPECT_THAT(errorOf(options),
              AllOf(HasSubstr("preset"), HasSubstr("'attic'"), HasSubstr("desk_stereo")));
  EXPECT_THROW(makeSimulation(options), std::invalid_argument);
}

TEST(SimulationPreset, TheDurationIsCheckedAndUsed) {
  SimulationOptions options;
  for (const double bad : {0.0, -1.0, 601.0, std::nan("")}) {
    options.duration_s = bad;
    EXPECT_THAT(errorOf(options), AllOf(HasSubstr("duration_s"), HasSubstr("0.001 to 600")));
  }
  options.duration_s = 0.25;
  EXPECT_EQ(makeSimulation(options).duration_ns, 250'000'000);
}

}  // namespace
}  // namespace efm
