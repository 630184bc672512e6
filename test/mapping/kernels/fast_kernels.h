// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "mapping/dsi/dsi_grid.h"

namespace efm::test {

/// The kernels of this processor without the plain one, with which they are compared.
inline std::vector<VotingKernel> fastKernels() {
  std::vector<VotingKernel> kernels;
  for (const VotingKernel kernel : availableKernels()) {
    if (kernel != VotingKernel::kPlain) kernels.push_back(kernel);
  }
  return kernels;
}

/// The name of a test's case, where kernels are its parameters.
inline std::string nameOfKernel(const ::testing::TestParamInfo<VotingKernel>& test) {
  return std::string(nameOf(test.param));
}

/// The mass that a fast kernel may put into wrong voxels, as a fraction of all mass. A coordinate
/// is rounded to 1/4096 px where the ray is sorted into bins and again where it votes, on average
/// by 1/3 of that together, and a shift of d px in x and in y moves at most 4 d of a vote's
/// weights. Weights are rounded to 1/1024: first those of the two rows, by a quarter of it on
/// average, which moves two quarters, and then four times a quarter. 1.8e-3 for single votes; where
/// several meet, less.
inline constexpr double kFastErrorOverMass = 4.0 / 3 / 4096 + 1.5 / 1024;

/// The same of the plain kernel. Float coordinates of some 40 px are good to 4e-6 px, at which a
/// vote moves.
inline constexpr double kPlainErrorOverMass = 1e-4;

/// The most that a fast kernel may be off, under any rule: those that multiply weigh the error of a
/// small input by the other inputs.
inline constexpr double kMostErrorOverMass = 1e-3;

inline double errorOverMassOf(VotingKernel kernel) {
  return kernel == VotingKernel::kPlain ? kPlainErrorOverMass : kMostErrorOverMass;
}

}  // namespace efm::test
