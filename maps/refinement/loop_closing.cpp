// SPDX-License-Identifier: BSD-3-Clause
#include "maps/refinement/loop_closing.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>

#include "mapping/geometry/angle.h"
#include "mapping/options/option_check.h"

namespace efm {
namespace {

/// Every so manieth point says enough of an overlap.
constexpr std::size_t kOverlapStride = 10;
/// Fewer are chance.
constexpr std::size_t kLeastInliers = 100;
/// Pairs of the same place differ by their noise; of places that are not the same, by as much as
/// neighbours may.
constexpr double kLargestMedianError = 1.0;
/// From where the candidate was expected, in standard deviations: 1 in 10^5 loops is farther.
constexpr double kFarthestFromPrior = 5.5;
/// How much farther than others a loop's neighbours may be at first: drift adds up along it.
constexpr double kFartherNeighbours = 3;
/// What a loop's pose errs by beyond its pairs' noise: depths that are wrong alike, edges that look
/// elsewhere from there.
constexpr double kSystematicM = 0.005;
constexpr double kSystematicRad = 0.1 * kRadiansPerDegree;
/// Of directions that a registration leaves open: nobody would call that sure.
constexpr double kOpenVariance = 1e6;
/// Two registrations of the same points agree within so many of the largest standard deviations.
constexpr double kBothWaysSigmas = 1.5;

double largestSigma(const Eigen::Matrix3d& covariance) {
  return std::sqrt(
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance).eigenvalues().maxCoeff());
}

/// The same factor, as sure as a loop can be.
RelativePoseFactor withSystematicError(RelativePoseFactor factor) {
  MotionEstimate motion = motionOf(factor, kOpenVariance);
  motion.covariance.diagonal().head<3>().array() += kSystematicM * kSystematicM;
  motion.covariance.diagonal().tail<3>().array() += kSystematicRad * kSystematicRad;
  factor.T_from_to = motion.T_from_to;
  factor.sqrt_information = sqrtInformation(motion.covariance);
  factor.offset.setZero();
  return factor;
}

bool isSure(const RelativePoseFactor& factor, const LoopOptions& options) {
  const Matrix6d covariance = motionOf(factor, kOpenVariance).covariance;
  return largestSigma(covariance.topLeftCorner<3, 3>()) <= options.loop_max_sigma_m &&
         largestSigma(covariance.bottomRightCorner<3, 3>()) <= options.loop_max_sigma_rad;
}

/// Registers one keyframe with another that stands at the origin.
Registration registerBeside(const RegistrationCloud& cloud, const RegistrationCloud& other,
                            const Rigid3& T_other_ref, const Matrix6d& covariance,
                            const KeyframeRegistrationOptions& options) {
  return registerKeyframe(1, cloud, {{0, &other, Rigid3{}}},
                          {T_other_ref, sqrtInformation(covariance)}, options);
}

bool holds(const Registration& registration, const LoopOptions& options) {
  return !registration.factors.empty() && registration.inliers >= kLeastInliers &&
         registration.inlierRatio() >= options.loop_min_inliers &&
         registration.median_error <= kLargestMedianError &&
         registration.from_prior <= kFarthestFromPrior &&
         isSure(registration.factors.front(), options);
}

}  // namespace

void LoopOptions::validate() const {
  requireOption(loop_min_overlap > 0 && loop_min_overlap <= 1, "loop_min_overlap", loop_min_overlap,
                "above 0, at most 1");
  requireOption(loop_min_inliers >= 0 && loop_min_inliers <= 1, "loop_min_inliers",
                loop_min_inliers, "from 0 to 1");
  requireOption(loop_max_sigma_m > 0, "loop_max_sigma_m", loop_max_sigma_m, "above 0");
  requireOption(loop_max_sigma_rad > 0, "loop_max_sigma_deg",
                loop_max_sigma_rad / kRadiansPerDegree, "above 0");
  requireOption(loop_checks >= 0 && loop_checks <= 100, "loop_checks", loop_checks,
                "from 0 to 100");
}

double viewOverlap(const RegistrationCloud& of, const RegistrationCloud& in,
                   const Rigid3& T_in_of) {
  std::size_t looked_at = 0;
  std::size_t seen = 0;
  for (std::size_t i = 0; i < of.numQueryPoints(); i += kOverlapStride) {
    ++looked_at;
    if (in.sees(T_in_of * of.points()[i].p_ref.cast<double>())) ++seen;
  }
  return looked_at > 0 ? static_cast<double>(seen) / static_cast<double>(looked_at) : 0;
}

std::optional<RelativePoseFactor> verifyLoop(const LoopCandidate& candidate,
                                             const RegistrationCloud& older,
                                             const RegistrationCloud& newer,
                                             const Matrix6d& covariance, const LoopOptions& options,
                                             const KeyframeRegistrationOptions& registration) {
  KeyframeRegistrationOptions wider = registration;
  wider.first_distance_px *= kFartherNeighbours;
  const Registration there =
      registerBeside(newer, older, candidate.T_older_newer, covariance, wider);
  if (!holds(there, options)) return std::nullopt;
  const Registration back =
      registerBeside(older, newer, there.T_world_ref.inverse(), covariance, registration);
  if (!holds(back, options)) return std::nullopt;
  const Vector6d apart = differenceOf(there.T_world_ref * back.T_world_ref);
  if (apart.head<3>().norm() > kBothWaysSigmas * options.loop_max_sigma_m ||
      apart.tail<3>().norm() > kBothWaysSigmas * options.loop_max_sigma_rad) {
    return std::nullopt;
  }
  RelativePoseFactor factor = withSystematicError(there.factors.front());
  factor.from = candidate.older;
  factor.to = candidate.newer;
  factor.robust = true;
  return factor;
}

}  // namespace efm
