// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>

#include "mapping/geometry/angle.h"
#include "maps/refinement/keyframe_registration.h"
#include "maps/refinement/tracker_errors.h"

namespace efm {

struct LoopOptions {
  bool loops = true;  ///< Whether they are looked for.
  /// Share of a keyframe's points that an older one must have in its view to be a candidate. Range:
  /// above 0, at most 1.
  double loop_min_overlap = 0.3;
  /// Share of those points that must find a neighbour. Range: 0 to 1.
  double loop_min_inliers = 0.5;
  /// How sure the registration must be: standard deviations in the direction that it is least sure
  /// of. Above 0.
  double loop_max_sigma_m = 0.03;
  double loop_max_sigma_rad = 0.5 * kRadiansPerDegree;
  int loop_checks = 1;  ///< Candidates that are registered per keyframe, 0 to 100.

  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

/// Two keyframes that may have seen the same place.
struct LoopCandidate {
  std::size_t older = 0;
  std::size_t newer = 0;
  Rigid3 T_older_newer;  ///< About where the newer one would stand then.
};

/// The share of a keyframe's points that lie in another one's view.
double viewOverlap(const RegistrationCloud& of, const RegistrationCloud& in, const Rigid3& T_in_of);

/// Registers the candidate's keyframes with each other, both ways: a place that looks alike from
/// there alone is none.
/// @param covariance of T_older_newer.
/// @return a robust factor; nothing where too few points have neighbours, their errors are too
/// large, the result is not sure, far beyond what the covariance allows, or another one the other
/// way.
std::optional<RelativePoseFactor> verifyLoop(const LoopCandidate& candidate,
                                             const RegistrationCloud& older,
                                             const RegistrationCloud& newer,
                                             const Matrix6d& covariance, const LoopOptions& options,
                                             const KeyframeRegistrationOptions& registration);

}  // namespace efm
