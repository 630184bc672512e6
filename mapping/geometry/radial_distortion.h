// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <vector>

namespace efm {

/// The radial part of a lens: r = rho (1 + k1 rho^2 + k2 rho^4 + k3 rho^6 + k4 rho^8), and its
/// inverse on the branch that begins at the centre. Where the polynomial falls, the model folds the
/// image over: no larger rho is on the branch.
class RadialDistortion {
 public:
  /// @param coefficients k1, k2 ...
  /// @param max_rho the branch ends here if the polynomial rises so far.
  RadialDistortion(const std::array<double, 4>& coefficients, double max_rho);

  /// r / rho, from s = rho^2.
  double ratioAt(double s) const { return 1 + s * (k_[0] + s * (k_[1] + s * (k_[2] + s * k_[3]))); }
  /// The derivative of the ratio by s.
  double ratioSlopeAt(double s) const {
    return k_[0] + s * (2 * k_[1] + s * (3 * k_[2] + s * 4 * k_[3]));
  }
  /// dr / drho, from s.
  double slopeAt(double s) const { return ratioAt(s) + 2 * s * ratioSlopeAt(s); }
  double rAt(double rho) const { return rho * ratioAt(rho * rho); }
  /// The end of the branch.
  double maxRho() const { return max_rho_; }
  double maxR() const { return rAt(max_rho_); }

 private:
  std::array<double, 4> k_;
  double max_rho_;
};

/// The inverse of a radial distortion: a table for a first guess, Newton's method for the rest.
class RadialInverse {
 public:
  /// @param max_r most r that are asked for are below it.
  RadialInverse(const RadialDistortion& distortion, double max_r);

  /// A rho with almost this r; of larger r than `max_r` that of the nearest one on the branch.
  double guess(double r) const;
  /// The rho of this r; not a number where the branch does not reach it.
  double at(double r) const;

 private:
  double solve(double r, double low, double high, double start) const;

  RadialDistortion distortion_;
  double max_r_;
  double nodes_per_r_;
  std::vector<double> rho_;  // at nodes that are evenly spaced in r
};

}  // namespace efm
