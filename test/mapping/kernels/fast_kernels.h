// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "mapping/dsi/dsi_grid.h"

namespace efm::test {

/// Returns the kernels of this processor, without the plain kernel (the reference of the tests).
inline std::vector<VotingKernel> fastKernels() {
  std::vector<VotingKernel> kernels;
  for (const VotingKernel kernel : availableKernels()) {
    if (kernel != VotingKernel::kPlain) kernels.push_back(kernel);
  }
  return kernels;
}

/// Returns the name of a test case if the parameter is a kernel.
inline std::string nameOfKernel(const ::testing::TestParamInfo<VotingKernel>& test) {
  return std::string(nameOf(test.param));
}

/// The mass that a fast kernel may put into wrong voxels, as a fraction of all mass. A coordinate
/// is rounded to 1/4096 px in the binning and again in the vote: together by 1/3 of 1/4096 px on
/// average. A shift of d px in x and in y moves at most 4 d of a vote's weights. Weights are
/// rounded to 1/1024, by a quarter of 1/1024 on average: first the two row weights (moves two
/// quarters), then the four pixel weights (four quarters). The sum is 1.8e-3 for single votes, less
/// if votes overlap.
inline constexpr double kFastErrorOverMass = 4.0 / 3 / 4096 + 1.5 / 1024;

/// The same fraction for the plain kernel. Its votes are off by the rounding of float coordinates:
/// 4e-6 px at about 40 px.
inline constexpr double kPlainErrorOverMass = 1e-4;

/// The largest error of a fast kernel under any fusion rule. Rules with products multiply the error
/// of a small input by the other inputs.
inline constexpr double kMostErrorOverMass = 1e-3;

inline double errorOverMassOf(VotingKernel kernel) {
  return kernel == VotingKernel::kPlain ? kPlainErrorOverMass : kMostErrorOverMass;
}

}  // namespace efm::test
