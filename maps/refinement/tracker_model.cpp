// SPDX-License-Identifier: BSD-3-Clause
#include "maps/refinement/tracker_model.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "mapping/base/option.h"

namespace efm {
namespace {

/// The minimum standard deviations: no tracker is exact, and covariances must not be singular.
constexpr double kMinSigmaM = 1e-4;
constexpr double kMinSigmaRad = 1e-5;

/// Samples share keyframes: two samples count as one independent sample.
constexpr double kSamplesPerIndependentOne = 2;
/// Degrees of freedom of Student's t-distribution, because failed registrations are outliers.
constexpr double kFreedom = 10;

/// The prior of an error: the standard deviation of the logarithm of its ratio to the expected one.
struct Prior {
  double TrackerErrors::*field;
  double log_sigma;
};
const std::array<Prior, 4> kPriors = {{{&TrackerErrors::noise_m, std::log(10)},
                                       {&TrackerErrors::noise_rad, std::log(10)},
                                       {&TrackerErrors::drift_m, std::log(2)},
                                       {&TrackerErrors::drift_rad, std::log(2)}}};
using LogRatios = std::array<double, kPriors.size()>;

Matrix6d covarianceOf(double variance_m2, double variance_rad2) {
  Matrix6d covariance = Matrix6d::Zero();
  covariance.diagonal().head<3>().setConstant(variance_m2 + kMinSigmaM * kMinSigmaM);
  covariance.diagonal().tail<3>().setConstant(variance_rad2 + kMinSigmaRad * kMinSigmaRad);
  return covariance;
}

double logLikelihood(const std::vector<MotionSample>& samples, const TrackerErrors& errors) {
  double sum = 0;
  for (const MotionSample& sample : samples) {
    const Matrix6d covariance = sample.covariance + errors.noiseCovariance(sample.from) +
                                errors.noiseCovariance(sample.to) +
                                errors.driftCovariance(sample.path_length_m);
    const Matrix6d factor = choleskyFactor(covariance);
    const double squared =
        factor.triangularView<Eigen::Lower>().solve(sample.difference).squaredNorm();
    sum -= factor.diagonal().array().log().sum() +
           0.5 * (kFreedom + 6) * std::log1p(squared / kFreedom);
  }
  return sum / kSamplesPerIndependentOne;
}

TrackerErrors scaled(TrackerErrors errors, const LogRatios& log_ratios) {
  for (std::size_t i = 0; i < log_ratios.size(); ++i) {
    errors.*kPriors[i].field *= std::exp(log_ratios[i]);
  }
  return errors;
}

}  // namespace

Matrix6d TrackerErrors::noiseCovariance(const NoiseScale& scale) const {
  const double sigma_m = scale.translation * noise_m;
  const double sigma_rad = scale.rotation * noise_rad;
  return covarianceOf(sigma_m * sigma_m, sigma_rad * sigma_rad);
}

Matrix6d TrackerErrors::driftCovariance(double path_length_m) const {
  // Drift is a random walk on short paths. On long paths a constant drift is larger.
  const double squared_length = path_length_m * std::max(path_length_m, 1.0);
  return covarianceOf(drift_m * drift_m * squared_length, drift_rad * drift_rad * squared_length);
}

TrackerErrors estimateTrackerErrors(const std::vector<MotionSample>& samples,
                                    const TrackerErrors& expected) {
  LogRatios log_ratios{};
  const auto value = [&] {
    double penalty = 0;
    for (std::size_t i = 0; i < log_ratios.size(); ++i) {
      penalty += 0.5 * std::pow(log_ratios[i] / kPriors[i].log_sigma, 2);
    }
    return logLikelihood(samples, scaled(expected, log_ratios)) - penalty;
  };
  // Hill climbing: one error at a time, in finer and finer steps.
  constexpr int kSweeps = 3;
  double best = value();
  for (const double step : {2.0, 1.0, 0.5, 0.25}) {
    bool moved = true;
    for (int sweep = 0; sweep < kSweeps && moved; ++sweep) {
      moved = false;
      for (double& log_ratio : log_ratios) {
        for (const double change : {-step, step}) {
          log_ratio += change;
          const double changed = value();
          if (changed > best) {
            best = changed;
            moved = true;
            break;
          }
          log_ratio -= change;
        }
      }
    }
  }
  return scaled(expected, log_ratios);
}

namespace {

constexpr double kCautiousFraction = 0.25;
/// Maximum number of samples, from about 25 keyframes.
constexpr std::size_t kMaxSamples = 100;
constexpr double kDriftStep = 3;
constexpr double kMaxDriftFactor = 9;

}  // namespace

TrackerErrors TrackerModel::cautious() const {
  return {std::max(errors_.noise_m, kCautiousFraction * expected_.noise_m),
          std::max(errors_.noise_rad, kCautiousFraction * expected_.noise_rad),
          std::max(errors_.drift_m, kCautiousFraction * expected_.drift_m),
          std::max(errors_.drift_rad, kCautiousFraction * expected_.drift_rad)};
}

TrackerErrors TrackerModel::inGraph() const {
  TrackerErrors errors = errors_;
  errors.drift_m *= drift_factor_;
  errors.drift_rad *= drift_factor_;
  return errors;
}

NoiseScale TrackerModel::scaleOf(const std::optional<PoseNoise>& stated) const {
  if (!stated) return {};
  const auto ratio = [](double of_pose, double expected) {
    return expected > 0 ? of_pose / expected : 1;
  };
  return {ratio(stated->noise_m, expected_.noise_m), ratio(stated->noise_rad, expected_.noise_rad)};
}

void TrackerModel::addSample(const RelativePoseFactor& factor, const RefinedKeyframe& from,
                             const RefinedKeyframe& to) {
  constexpr double kOpenVariance = 1;  // m^2 and rad^2
  const MotionEstimate by_points = motionOf(factor, kOpenVariance);
  const Rigid3 T_from_to = from.T_odom_ref.inverse() * to.T_odom_ref;
  MotionSample sample;
  sample.covariance = by_points.covariance;
  sample.difference = differenceOf(by_points.T_from_to.inverse() * T_from_to);
  sample.path_length_m = to.path_length_m - from.path_length_m;
  sample.from = from.noise_scale;
  sample.to = to.noise_scale;
  samples_.push_back(sample);
  if (samples_.size() > kMaxSamples) samples_.pop_front();
}

bool TrackerModel::increaseDrift() {
  if (drift_factor_ >= kMaxDriftFactor) return false;
  drift_factor_ *= kDriftStep;
  return true;
}

}  // namespace efm
