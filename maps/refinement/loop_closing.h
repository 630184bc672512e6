// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "mapping/base/option.h"
#include "mapping/geometry/rigid3.h"
#include "maps/refinement/keyframe_registration.h"
#include "maps/refinement/tracker_model.h"

namespace efm {

struct LoopOptions {
  bool loops = true;  ///< True if loops are searched.
  /// Minimum fraction of the points of a keyframe in the view of a candidate. Range: above 0, at
  /// most 1.
  double loop_min_overlap = 0.3;
  /// Minimum fraction of the points in view that have a neighbour. Range: 0 to 1.
  double loop_min_inliers = 0.5;
  /// Maximum standard deviations of the registration in its least certain direction. Above 0.
  double loop_max_sigma_m = 0.03;
  double loop_max_sigma_rad = 0.5 * kRadiansPerDegree;
  int loop_checks = 1;  ///< Number of candidates that are registered per keyframe, 0 to 100.

  template <typename Self, typename Visit>
  static void fields(Self& self, Visit&& visit) {
    visit("loops", self.loops);
    visit("loop_min_overlap", self.loop_min_overlap, Allowed::above(0, 1, "above 0, at most 1"));
    visit("loop_min_inliers", self.loop_min_inliers, Allowed::from(0, 1, "from 0 to 1"));
    visit("loop_max_sigma_m", self.loop_max_sigma_m, Allowed::above(0, "above 0"));
    visit("loop_max_sigma_deg", self.loop_max_sigma_rad,
          Allowed::above(0, "above 0").in(kRadiansPerDegree));
    visit("loop_checks", self.loop_checks, Allowed::from(0, 100, "from 0 to 100"));
  }
  void validate() const { requireFields(*this); }
};

/// Two keyframes that may see the same place.
struct LoopCandidate {
  std::size_t older = 0;
  std::size_t newer = 0;
  Rigid3 T_older_newer;  ///< The approximate relative pose.
};

/// The result of the registrations of a candidate.
struct LoopCheck {
  std::optional<RelativePoseFactor> factor;
  std::uint64_t failed_solves = 0;  ///< Failed solves, as in Registration.
};

/// Returns the fraction of the points of a keyframe that lie in the view of another keyframe.
double viewOverlap(const RegistrationCloud& of, const RegistrationCloud& in, const Rigid3& T_in_of);

/// Registers the keyframes of a candidate with each other, in both directions. A wrong place may
/// look right in one direction only.
/// @param covariance of T_older_newer.
/// @return a robust factor; no factor if a registration has too few pairs, too large errors, too
/// large standard deviations or too large a distance from T_older_newer, or if the two results
/// disagree.
LoopCheck verifyLoop(const LoopCandidate& candidate, const RegistrationCloud& older,
                     const RegistrationCloud& newer, const Matrix6d& covariance,
                     const LoopOptions& options, const KeyframeRegistrationOptions& registration);

}  // namespace efm
