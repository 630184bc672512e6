// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>

#include "mapping/geometry/reference_view.h"

namespace efm {

/// A network with one hidden layer that gives a probability:
/// z = (x - mean) / sd, limited to -5 to 5; p = 1 / (1 + exp(-(w2 . tanh(z w1 + b1) + b2))).
/// scripts/fit_probability.py fits the weights.
template <std::size_t kInputs, std::size_t kHidden>
struct Network {
  using Inputs = std::array<float, kInputs>;
  using Hidden = std::array<float, kHidden>;

  Inputs mean, sd;
  std::array<Hidden, kInputs> w1;
  Hidden b1, w2;
  float b2;

  float probabilityOf(const Inputs& x) const;
};

/// The inputs for a candidate's depth. A step: see `planesPerStep`.
///  0. ln(local contrast)
///  1. ln(1.01 - second peak as a fraction of the peak), the second peak at most 0.999
///  2. ln(weighted fraction of agreeing neighbours + 0.05)
///  3. ln(1 + number of other candidates in 9x9 pixels whose first depth agrees)
///  4. ln(spread of the depths in 9x9 pixels / step + 0.1)
///  5. ln(width of the peak / step, at most 50, + 0.1)
///  6. ln(steps between this depth and one that is 10 % off)
using CandidateInputs = Network<7, 16>::Inputs;

/// Returns the probability that a candidate's depth is within 10 % of the true depth of its pixel
/// or of one of the eight pixels around it. On average over simulated recordings and a real one,
/// this share of depths is right (docs/evaluation.md). It supposes that poses and calibration are
/// right.
float probabilityOf(const CandidateInputs& inputs);

/// The inputs for a neighbour's depth, from the candidates around the pixel:
///  0. ln(confidence as a fraction of the mean confidence + 0.02)
///  1. ln(sum of the probabilities of the candidates that agree with the median + 0.05)
///  2. ln(that of the others + 0.05)
///  3. ln(median distance of their first depths from the median / step + 0.1)
///  4. ln(largest probability of a candidate among the eight pixels around + 0.02)
///  5. ln(steps between this depth and one that is 10 % off)
using NeighbourInputs = Network<6, 8>::Inputs;
float probabilityOf(const NeighbourInputs& inputs);

/// Returns the steps between a depth and one that is 10 % off. Infinite with one plane.
/// @param position of the depth, planes. @param step_planes see `planesPerStep`.
float stepsOfTenPercent(double position, const DepthPlanes& planes, double step_planes);

}  // namespace efm
