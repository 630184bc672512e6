// SPDX-License-Identifier: BSD-3-Clause
#include "maps/refinement/tracker_errors.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

#include "mapping/geometry/angle.h"
#include "mapping/options/option_check.h"

namespace efm {
namespace {

/// No tracker is exact, and covariances must not vanish.
constexpr double kLeastM = 1e-4;
constexpr double kLeastRad = 1e-5;

/// Samples share keyframes: so many say as much as one of its own.
constexpr double kSamplesAsOne = 2;
/// Degrees of freedom of Student's distribution: a registration that failed is no noise.
constexpr double kFreedom = 10;

/// How each error may depart from what was expected: the standard deviation of its logarithm.
struct Departure {
  double TrackerErrors::*field;
  double log_sigma;
};
const std::array<Departure, 4> kDepartures = {{{&TrackerErrors::noise_m, std::log(10)},
                                               {&TrackerErrors::noise_rad, std::log(10)},
                                               {&TrackerErrors::drift_m, std::log(2)},
                                               {&TrackerErrors::drift_rad, std::log(2)}}};
using LogFactors = std::array<double, kDepartures.size()>;

Matrix6d covarianceOf(double variance_m2, double variance_rad2) {
  Matrix6d covariance = Matrix6d::Zero();
  covariance.diagonal().head<3>().setConstant(variance_m2 + kLeastM * kLeastM);
  covariance.diagonal().tail<3>().setConstant(variance_rad2 + kLeastRad * kLeastRad);
  return covariance;
}

double logLikelihood(const std::vector<MotionSample>& samples, const TrackerErrors& errors) {
  double sum = 0;
  for (const MotionSample& sample : samples) {
    const Matrix6d covariance = sample.covariance + errors.noiseCovariance(sample.from) +
                                errors.noiseCovariance(sample.to) +
                                errors.driftCovariance(sample.path_length_m);
    const Eigen::LLT<Matrix6d> llt(covariance);
    const double squared = llt.matrixL().solve(sample.difference).squaredNorm();
    sum -= llt.matrixLLT().diagonal().array().log().sum() +
           0.5 * (kFreedom + 6) * std::log1p(squared / kFreedom);
  }
  return sum / kSamplesAsOne;
}

TrackerErrors departed(TrackerErrors errors, const LogFactors& log_factors) {
  for (std::size_t i = 0; i < log_factors.size(); ++i) {
    errors.*kDepartures[i].field *= std::exp(log_factors[i]);
  }
  return errors;
}

}  // namespace

void TrackerErrors::validate() const {
  const auto require = [](const char* name, double value, double unit = 1) {
    requireOption(value >= 0 && value <= 1e3 * unit, name, value / unit, "from 0 to 1000");
  };
  require("tracker_noise_m", noise_m);
  require("tracker_noise_deg", noise_rad, kRadiansPerDegree);
  require("tracker_drift", drift_m);
  require("tracker_drift_deg_per_m", drift_rad, kRadiansPerDegree);
}

Matrix6d TrackerErrors::noiseCovariance(const PoseNoise& times) const {
  const double sigma_m = times.noise_m * noise_m;
  const double sigma_rad = times.noise_rad * noise_rad;
  return covarianceOf(sigma_m * sigma_m, sigma_rad * sigma_rad);
}

Matrix6d TrackerErrors::driftCovariance(double path_length_m) const {
  // A random walk on short ways; on long ones what goes on in one direction is more.
  const double squared_way = path_length_m * std::max(path_length_m, 1.0);
  return covarianceOf(drift_m * drift_m * squared_way, drift_rad * drift_rad * squared_way);
}

TrackerErrors estimateTrackerErrors(const std::vector<MotionSample>& samples,
                                    const TrackerErrors& expected) {
  LogFactors log_factors{};
  const auto value = [&] {
    double penalty = 0;
    for (std::size_t i = 0; i < log_factors.size(); ++i) {
      penalty += 0.5 * std::pow(log_factors[i] / kDepartures[i].log_sigma, 2);
    }
    return logLikelihood(samples, departed(expected, log_factors)) - penalty;
  };
  // Up the hill, an error at a time, in finer and finer steps.
  constexpr int kSweeps = 3;
  double best = value();
  for (const double step : {2.0, 1.0, 0.5, 0.25}) {
    bool moved = true;
    for (int sweep = 0; sweep < kSweeps && moved; ++sweep) {
      moved = false;
      for (double& log_factor : log_factors) {
        for (const double change : {-step, step}) {
          log_factor += change;
          const double changed = value();
          if (changed > best) {
            best = changed;
            moved = true;
            break;
          }
          log_factor -= change;
        }
      }
    }
  }
  return departed(expected, log_factors);
}

}  // namespace efm
