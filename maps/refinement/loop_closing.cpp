// SPDX-License-Identifier: BSD-3-Clause
#include "maps/refinement/loop_closing.h"

#include <cmath>

#include "mapping/base/option.h"

namespace efm {
namespace {

/// One of 10 points is enough to measure an overlap.
constexpr std::size_t kOverlapStride = 10;
/// Fewer pairs may match by chance.
constexpr std::size_t kMinLoopPairs = 100;
/// Maximum, in standard deviations. Pairs of a place differ by their noise; pairs of different
/// places by up to the maximum distance of neighbours.
constexpr double kMaxMedianError = 1.0;
/// Maximum distance from the candidate, in standard deviations: 1 of 10^5 correct loops is farther.
constexpr double kMaxLoopPriorSigmas = 5.5;
/// Factor of the first distance of neighbours, because drift adds up along a loop.
constexpr double kFirstDistanceFactor = 3;
/// Systematic errors of the pose of a loop, beyond the noise of its pairs: common errors of depths,
/// and edges that depend on the viewpoint.
constexpr double kSystematicM = 0.005;
constexpr double kSystematicRad = 0.1 * kRadiansPerDegree;
/// Variance of unobservable directions of a registration: far above each limit.
constexpr double kOpenVariance = 1e6;
/// Maximum difference between the two registrations, as a multiple of the maximum sigmas.
constexpr double kBothWaysSigmas = 1.5;

double maxSigma(const Eigen::Matrix3d& covariance) { return std::sqrt(maxEigenvalue(covariance)); }

/// Returns the factor with the systematic errors added to its covariance.
RelativePoseFactor withSystematicError(RelativePoseFactor factor) {
  MotionEstimate motion = motionOf(factor, kOpenVariance);
  motion.covariance.diagonal().head<3>().array() += kSystematicM * kSystematicM;
  motion.covariance.diagonal().tail<3>().array() += kSystematicRad * kSystematicRad;
  factor.T_from_to = motion.T_from_to;
  factor.sqrt_information = sqrtInformation(motion.covariance);
  factor.offset.setZero();
  return factor;
}

bool isCertain(const RelativePoseFactor& factor, const LoopOptions& options) {
  const Matrix6d covariance = motionOf(factor, kOpenVariance).covariance;
  return maxSigma(covariance.topLeftCorner<3, 3>()) <= options.loop_max_sigma_m &&
         maxSigma(covariance.bottomRightCorner<3, 3>()) <= options.loop_max_sigma_rad;
}

/// Registers one keyframe with another one, whose frame is the world.
Registration registerWith(const RegistrationCloud& cloud, const RegistrationCloud& other,
                          const Rigid3& T_other_ref, const Matrix6d& covariance,
                          const KeyframeRegistrationOptions& options) {
  return registerKeyframe(1, cloud, {{0, &other, Rigid3{}}},
                          {T_other_ref, sqrtInformation(covariance)}, options);
}

bool isPlausible(const Registration& registration, const LoopOptions& options) {
  return !registration.factors.empty() && registration.inliers >= kMinLoopPairs &&
         registration.inlierRatio() >= options.loop_min_inliers &&
         registration.median_error <= kMaxMedianError &&
         registration.from_prior <= kMaxLoopPriorSigmas &&
         isCertain(registration.factors.front(), options);
}

}  // namespace

double viewOverlap(const RegistrationCloud& of, const RegistrationCloud& in,
                   const Rigid3& T_in_of) {
  std::size_t checked = 0;
  std::size_t in_view = 0;
  for (std::size_t i = 0; i < of.numQueryPoints(); i += kOverlapStride) {
    ++checked;
    if (in.isInView(T_in_of * of.points()[i].p_ref.cast<double>())) ++in_view;
  }
  return checked > 0 ? static_cast<double>(in_view) / static_cast<double>(checked) : 0;
}

LoopCheck verifyLoop(const LoopCandidate& candidate, const RegistrationCloud& older,
                     const RegistrationCloud& newer, const Matrix6d& covariance,
                     const LoopOptions& options, const KeyframeRegistrationOptions& registration) {
  KeyframeRegistrationOptions wider = registration;
  wider.first_distance_px *= kFirstDistanceFactor;
  const Registration there = registerWith(newer, older, candidate.T_older_newer, covariance, wider);
  LoopCheck check;
  check.failed_solves = there.failed_solves;
  if (!isPlausible(there, options)) return check;
  const Registration back =
      registerWith(older, newer, there.T_world_ref.inverse(), covariance, registration);
  check.failed_solves += back.failed_solves;
  if (!isPlausible(back, options)) return check;
  const Vector6d difference = differenceOf(there.T_world_ref * back.T_world_ref);
  if (difference.head<3>().norm() > kBothWaysSigmas * options.loop_max_sigma_m ||
      difference.tail<3>().norm() > kBothWaysSigmas * options.loop_max_sigma_rad) {
    return check;
  }
  RelativePoseFactor factor = withSystematicError(there.factors.front());
  factor.from = candidate.older;
  factor.to = candidate.newer;
  factor.robust = true;
  check.factor = factor;
  return check;
}

}  // namespace efm
