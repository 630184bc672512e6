// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/motion_correction.h"

#include <cmath>
#include <cstdlib>
#include <numeric>

#include "mapping/option_check.h"
#include "mapping/quasi_newton.h"

namespace efm {
namespace {
double env(const char* name, double otherwise) {
  const char* v = std::getenv(name);
  return v ? std::atof(v) : otherwise;
}

}  // namespace

void MotionCorrectionOptions::validate() const {
  requireOption(sigma_m_s > 0 && sigma_m_s <= 10, "motion_sigma_m_s", sigma_m_s,
                "above 0 and at most 10");
  requireOption(sigma_rad_s > 0 && sigma_rad_s <= 10, "motion_sigma_rad_s", sigma_rad_s,
                "above 0 and at most 10");
  requireOption(max_events >= 100 && max_events <= 10'000'000, "motion_max_events", max_events,
                "100 to 10,000,000");
  requireOption(rounds >= 1 && rounds <= 10, "motion_rounds", rounds, "1 to 10");
  requireOption(min_gain >= 0 && min_gain <= 1, "motion_min_gain", min_gain, "0 to 1");
}

VelocityCorrection sharpestMotion(const std::vector<std::vector<WarpedEvent>>& events,
                                  cv::Size view, const MotionCorrectionOptions& options,
                                  const VelocityCorrection& warped_with) {
  const std::size_t count =
      std::accumulate(events.begin(), events.end(), std::size_t{0},
                      [](std::size_t sum, const auto& some) { return sum + some.size(); });
  if (count == 0) return warped_with;
  // In units of the standard deviations, so that all directions have about the same scale.
  VelocityVector sigmas;
  sigmas << options.sigma_m_s, options.sigma_m_s, options.sigma_m_s, options.sigma_rad_s,
      options.sigma_rad_s, options.sigma_rad_s;
  const double kPrior = env("EFM_PRIOR", 0.01);
  VelocityVector before;
  before << warped_with.linear_m_s, warped_with.angular_rad_s;
  Eigen::VectorXd place = before.cwiseQuotient(sigmas);
  for (const double blur_px : {env("EFM_BLUR1", 2.0), env("EFM_BLUR2", 1.0)}) {
    const EventContrast contrast(events, view, blur_px);
    const auto cost = [&](const Eigen::VectorXd& at, Eigen::VectorXd& slope) {
      const EventContrast::Value value = contrast.at(sigmas.cwiseProduct(at) - before);
      slope = kPrior * at - sigmas.cwiseProduct(value.gradient) / value.contrast;
      return 0.5 * kPrior * at.squaredNorm() - std::log(value.contrast);
    };
    place = minimise(cost, place);
  }
  const VelocityVector velocity = sigmas.cwiseProduct(place);
  return {velocity.head<3>(), velocity.tail<3>()};
}

}  // namespace efm
