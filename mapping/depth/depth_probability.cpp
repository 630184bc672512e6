// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/depth/depth_probability.h"

#include <algorithm>
#include <cmath>

#include "mapping/depth/probability_weights.h"

namespace efm {

template <std::size_t kInputs, std::size_t kHidden>
float Network<kInputs, kHidden>::probabilityOf(const Inputs& x) const {
  constexpr float kLimit = 5;
  Hidden sums = b1;
  for (std::size_t i = 0; i < kInputs; ++i) {
    const float z = std::clamp((x[i] - mean[i]) / sd[i], -kLimit, kLimit);
    for (std::size_t j = 0; j < kHidden; ++j) sums[j] += z * w1[i][j];
  }
  float logit = b2;
  for (std::size_t j = 0; j < kHidden; ++j) logit += w2[j] * std::tanh(sums[j]);
  return 1 / (1 + std::exp(-logit));
}

float probabilityOf(const CandidateInputs& inputs) {
  return kCandidateNetwork.probabilityOf(inputs);
}

float probabilityOf(const NeighbourInputs& inputs) {
  return kNeighbourNetwork.probabilityOf(inputs);
}

float stepsOfTenPercent(double position, const DepthPlanes& planes, double step_planes) {
  return static_cast<float>(0.1 / planes.depthAt(position) /
                            (planes.inverseDepthStepAt(position) * step_planes));
}

}  // namespace efm
