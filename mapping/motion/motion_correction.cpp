// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/motion/motion_correction.h"

#include <cmath>
#include <limits>
#include <numeric>

#include "mapping/geometry/angle.h"
#include "mapping/motion/quasi_newton.h"
#include "mapping/options/option_check.h"

namespace efm {

void MotionCorrectionOptions::validate() const {
  requireOption(motion_sigma_m_s > 0 && motion_sigma_m_s <= 10, "motion_sigma_m_s",
                motion_sigma_m_s, "above 0 and at most 10");
  requireOption(motion_sigma_deg_s > 0 && motion_sigma_deg_s <= 1000, "motion_sigma_deg_s",
                motion_sigma_deg_s, "above 0 and at most 1000");
  requireOption(motion_rounds >= 1 && motion_rounds <= 10, "motion_rounds", motion_rounds,
                "1 to 10");
  requireOption(max_events >= 100 && max_events <= 10'000'000, "max_events", max_events,
                "100 to 10,000,000");
  requireOption(min_gain >= 0 && min_gain <= 1, "min_gain", min_gain, "0 to 1");
}

VelocityCorrection sharpestMotion(const std::vector<std::vector<WarpedEvent>>& events,
                                  const SharpestMotionInput& input,
                                  const MotionCorrectionOptions& options) {
  constexpr int kPatchPx = 24;
  EventContrast contrast(events, input.view, kPatchPx);
  const std::vector<std::size_t>& in_patch = contrast.eventsInPatch();
  if (in_patch.empty()) return input.warped_with;

  // Variables in units of their standard deviations: all have about the same scale.
  const Eigen::Index count = contrast.variables();
  const auto patches = static_cast<Eigen::Index>(in_patch.size());
  Eigen::VectorXd sigmas(count);
  sigmas << Eigen::Vector3d::Constant(options.motion_sigma_m_s),
      Eigen::Vector3d::Constant(kRadiansPerDegree * options.motion_sigma_deg_s),
      Eigen::VectorXd::Constant(patches, input.sigma_inverse_depth);
  // A standard deviation costs half of this share of the contrast; of a patch, of the contrast that
  // its events have a part in. Small: they decide only where events do not.
  constexpr double kVelocityPrior = 1e-3;
  constexpr double kDepthPrior = 5e-3;
  Eigen::VectorXd prior(count);
  prior.head<6>().setConstant(kVelocityPrior);
  const auto events_in_all =
      static_cast<double>(std::accumulate(in_patch.begin(), in_patch.end(), std::size_t{0}));
  for (Eigen::Index i = 0; i < patches; ++i) {
    prior[6 + i] =
        kDepthPrior * static_cast<double>(in_patch[static_cast<std::size_t>(i)]) / events_in_all;
  }

  Eigen::VectorXd warped_with = Eigen::VectorXd::Zero(count);
  warped_with.head<6>() << input.warped_with.linear_m_s, input.warped_with.angular_rad_s;
  const auto cost = [&](const Eigen::VectorXd& at, Eigen::VectorXd& slope) {
    const double value = contrast.at(sigmas.cwiseProduct(at) - warped_with, slope);
    if (!(value > 0)) return std::numeric_limits<double>::infinity();
    slope = prior.cwiseProduct(at) - sigmas.cwiseProduct(slope) / value;
    return 0.5 * prior.dot(at.cwiseAbs2()) - std::log(value);
  };
  QuasiNewtonOptions search;
  search.max_evaluations = 25;
  Eigen::VectorXd place = Eigen::VectorXd::Zero(count);
  place.head<6>() = warped_with.head<6>().cwiseQuotient(sigmas.head<6>());
  // Smooth images lead from afar, sharp ones to the place.
  for (const double blur_px : {2.0, 1.0}) {
    contrast.setBlur(blur_px);
    place = minimise(cost, place, search);
  }
  const Eigen::VectorXd found = sigmas.cwiseProduct(place);
  return {found.head<3>(), found.segment<3>(3)};
}

}  // namespace efm
