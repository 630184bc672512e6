// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/depth/depth_probability.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "mapping/depth/probability_weights.h"

namespace efm {

template <std::size_t kInputs, std::size_t kHidden>
float Network<kInputs, kHidden>::probabilityOf(const Inputs& x) const {
  using Units = Eigen::Array<float, int{kHidden}, 1>;  // Eigen's tanh is that of a vector
  constexpr float kLimit = 5;
  Units sums = Units::Map(b1.data());
  for (std::size_t i = 0; i < kInputs; ++i) {
    const float z = std::clamp((x[i] - mean[i]) / sd[i], -kLimit, kLimit);
    sums += z * Units::Map(w1[i].data());
  }
  const float logit = b2 + (Units::Map(w2.data()) * sums.tanh()).sum();
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
