// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/geometry/radial_distortion.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

namespace efm {
namespace {

/// Coefficients of 1, s, s^2 ...
using Polynomial = std::vector<double>;

double valueOf(const Polynomial& polynomial, double s) {
  double value = 0;
  for (auto c = polynomial.rbegin(); c != polynomial.rend(); ++c) value = value * s + *c;
  return value;
}

/// The places in (0, end) where the polynomial changes its sign, ascending. Between two of its
/// extremes it does so once at most.
std::vector<double> signChanges(const Polynomial& polynomial, double end) {
  if (polynomial.size() < 2) return {};
  Polynomial derivative;
  for (std::size_t i = 1; i < polynomial.size(); ++i) {
    derivative.push_back(static_cast<double>(i) * polynomial[i]);
  }
  std::vector<double> borders = signChanges(derivative, end);
  borders.push_back(end);
  std::vector<double> changes;
  double low = 0;
  for (const double border : borders) {
    const bool positive = valueOf(polynomial, low) > 0;
    double left = low;
    double right = border;
    low = border;
    if ((valueOf(polynomial, right) > 0) == positive) continue;
    for (double middle = 0.5 * (left + right); left < middle && middle < right;
         middle = 0.5 * (left + right)) {
      ((valueOf(polynomial, middle) > 0) == positive ? left : right) = middle;
    }
    changes.push_back(left);
  }
  return changes;
}

}  // namespace

RadialDistortion::RadialDistortion(const std::array<double, 4>& coefficients, double max_rho)
    : k_(coefficients), max_rho_(max_rho) {
  const Polynomial slope = {1, 3 * k_[0], 5 * k_[1], 7 * k_[2], 9 * k_[3]};
  const std::vector<double> folds = signChanges(slope, max_rho * max_rho);
  if (!folds.empty()) max_rho_ = std::sqrt(folds.front());
}

RadialInverse::RadialInverse(const RadialDistortion& distortion, double max_r)
    : distortion_(distortion), max_r_(std::min(max_r, distortion.maxR())) {
  constexpr std::size_t kIntervals = 1024;
  nodes_per_r_ = static_cast<double>(kIntervals) / max_r_;
  rho_ = {0};
  while (rho_.size() <= kIntervals) {
    const double r = static_cast<double>(rho_.size()) / nodes_per_r_;
    rho_.push_back(solve(r, rho_.back(), distortion_.maxRho(), rho_.back()));
  }
}

double RadialInverse::guess(double r) const {
  const double position = std::min(r, max_r_) * nodes_per_r_;
  const std::size_t node = std::min(static_cast<std::size_t>(position), rho_.size() - 2);
  const double fraction = position - static_cast<double>(node);
  return rho_[node] + fraction * (rho_[node + 1] - rho_[node]);
}

double RadialInverse::at(double r) const {
  if (!(r <= distortion_.maxR())) return std::numeric_limits<double>::quiet_NaN();
  if (r > max_r_) return solve(r, rho_.back(), distortion_.maxRho(), rho_.back());
  const std::size_t node = std::min(static_cast<std::size_t>(r * nodes_per_r_), rho_.size() - 2);
  double rho = guess(r);
  rho -= (distortion_.rAt(rho) - r) / distortion_.slopeAt(rho * rho);
  const bool found = rho >= rho_[node] && rho <= rho_[node + 1] &&
                     std::abs(distortion_.rAt(rho) - r) <= 1e-14 * r;  // by far the most
  return found ? rho : solve(r, rho_[node], rho_[node + 1], guess(r));
}

/// Newton's method, and bisection where it would leave the interval, in which r grows with rho.
double RadialInverse::solve(double r, double low, double high, double start) const {
  constexpr int kMaxSteps = 100;
  double rho = start;
  for (int step = 0; step < kMaxSteps; ++step) {
    const double error = distortion_.rAt(rho) - r;
    (error > 0 ? high : low) = rho;
    double next = rho - error / distortion_.slopeAt(rho * rho);
    if (!(next >= low && next <= high)) next = 0.5 * (low + high);
    if (std::abs(next - rho) <= 1e-15 * rho) return next;
    rho = next;
  }
  return rho;
}

}  // namespace efm
