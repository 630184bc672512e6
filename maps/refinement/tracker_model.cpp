// SPDX-License-Identifier: BSD-3-Clause
#include "maps/refinement/tracker_model.h"

#include <algorithm>

namespace efm {
namespace {

constexpr double kCautiousFraction = 0.25;
/// From about 25 keyframes.
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

void TrackerModel::update() {
  if (adapt_) errors_ = estimateTrackerErrors({samples_.begin(), samples_.end()}, expected_);
}

bool TrackerModel::increaseDrift() {
  if (drift_factor_ >= kMaxDriftFactor) return false;
  drift_factor_ *= kDriftStep;
  return true;
}

}  // namespace efm
