// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/motion/motion_correction.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>

#include "mapping/base/option.h"
#include "mapping/geometry/rigid3.h"

namespace efm {

Eigen::VectorXd minimise(
    const std::function<double(const Eigen::VectorXd&, Eigen::VectorXd&)>& function,
    const Eigen::VectorXd& start, const QuasiNewtonOptions& options) {
  const Eigen::Index size = start.size();
  Eigen::VectorXd position = start;
  Eigen::VectorXd gradient(size);
  double value = function(position, gradient);
  int left = options.max_evaluations - 1;
  if (!(std::isfinite(value) && gradient.norm() > 0)) return position;
  Eigen::MatrixXd inverse_hessian =
      options.first_step / gradient.norm() * Eigen::MatrixXd::Identity(size, size);

  while (left > 0) {
    Eigen::VectorXd step = -(inverse_hessian * gradient);
    if (!(step.dot(gradient) < 0)) break;
    Eigen::VectorXd next_gradient(size);
    double next = value;
    for (; left > 0; step /= 2) {
      if (step.norm() < options.min_step) return position;
      constexpr double kArmijo = 1e-4;
      next = function(position + step, next_gradient);
      --left;
      if (next <= value + kArmijo * step.dot(gradient)) break;
    }
    if (!(next < value)) break;
    const Eigen::VectorXd change = next_gradient - gradient;
    position += step;
    value = next;
    gradient = next_gradient;
    const double curvature = step.dot(change);
    if (curvature <= 0) continue;  // not convex here: no update of the Hessian
    const Eigen::VectorXd scaled = inverse_hessian * change;
    inverse_hessian -= (step * scaled.transpose() + scaled * step.transpose()) / curvature;
    inverse_hessian += (1 + change.dot(scaled) / curvature) / curvature * step * step.transpose();
  }
  return position;
}

namespace {

/// Warps the events of each camera to the depths of the view, at most `max_events` in all. Cameras
/// without such events are left out: they would make the harmonic mean over cameras 0 everywhere.
std::vector<std::vector<WarpedEvent>> warpToDepth(const WindowInput& input,
                                                  const Trajectory& motion, const cv::Mat1f& depth,
                                                  int max_events) {
  constexpr double kRadiusPx = 4;  // error in the image of a blurred keyframe's depths
  std::vector<std::vector<WarpedEvent>> warped(input.cameras.size());
  const NearestDepths depths(depth, kRadiusPx);
  if (depths.empty()) return warped;
  std::size_t count = 0;
  for (const CameraEvents& camera : input.cameras) count += camera.events.size();
  const auto max_count = static_cast<std::size_t>(max_events);
  const std::size_t every = std::max<std::size_t>(1, (count + max_count - 1) / max_count);
  const WarpTarget target{input.T_world_ref.inverse(), input.view, inversePlanes(input.planes),
                          &depths, input.window.t_ref_ns};
  tbb::parallel_for(std::size_t{0}, input.cameras.size(), [&](std::size_t i) {
    warped[i] = warpEvents(input.cameras[i], every, motion, target);
  });
  warped.erase(std::remove_if(warped.begin(), warped.end(),
                              [](const auto& events) { return events.empty(); }),
               warped.end());
  return warped;
}

}  // namespace

VelocityCorrection findCorrection(const WindowInput& input, const Trajectory& motion,
                                  const cv::Mat1f& depth, const VelocityCorrection& current,
                                  const MotionCorrectionOptions& options) {
  constexpr double kSigmaPlanes = 2;  // sigma of depths found along a wrong motion
  const ContrastSearch search{depth.size(), kSigmaPlanes * input.planes.inverseDepthStep(),
                              current};
  return maximizeContrast(warpToDepth(input, motion, depth, options.max_events), search, options);
}

VelocityCorrection maximizeContrast(const std::vector<std::vector<WarpedEvent>>& events,
                                    const ContrastSearch& search,
                                    const MotionCorrectionOptions& options) {
  constexpr int kPatchPx = 24;
  EventContrast contrast(events, search.view, kPatchPx);
  const std::vector<std::size_t>& in_patch = contrast.eventsInPatch();
  if (in_patch.empty()) return search.current;

  // Variables in units of their standard deviations: all have about the same scale.
  const Eigen::Index count = contrast.variables();
  const auto patches = static_cast<Eigen::Index>(in_patch.size());
  Eigen::VectorXd sigmas(count);
  sigmas << Eigen::Vector3d::Constant(options.motion_sigma_m_s),
      Eigen::Vector3d::Constant(kRadiansPerDegree * options.motion_sigma_deg_s),
      Eigen::VectorXd::Constant(patches, search.sigma_inverse_depth);
  // A velocity of one standard deviation costs half of kVelocityPrior times the contrast. A change
  // of a patch's depth by one standard deviation costs half of kDepthPrior times the contrast of
  // the patch's own events. Both are small: the priors decide only if the events do not.
  constexpr double kVelocityPrior = 1e-3;
  constexpr double kDepthPrior = 5e-3;
  Eigen::VectorXd prior(count);
  prior.head<6>().setConstant(kVelocityPrior);
  const auto all_events =
      static_cast<double>(std::accumulate(in_patch.begin(), in_patch.end(), std::size_t{0}));
  for (Eigen::Index i = 0; i < patches; ++i) {
    prior[6 + i] =
        kDepthPrior * static_cast<double>(in_patch[static_cast<std::size_t>(i)]) / all_events;
  }

  Eigen::VectorXd current = Eigen::VectorXd::Zero(count);
  current.head<6>() << search.current.linear_m_s, search.current.angular_rad_s;
  const auto cost = [&](const Eigen::VectorXd& at, Eigen::VectorXd& gradient) {
    const double value = contrast.at(sigmas.cwiseProduct(at) - current, gradient);
    if (!(value > 0)) return std::numeric_limits<double>::infinity();
    gradient = prior.cwiseProduct(at) - sigmas.cwiseProduct(gradient) / value;
    return 0.5 * prior.dot(at.cwiseAbs2()) - std::log(value);
  };
  QuasiNewtonOptions descent;
  descent.max_evaluations = 25;
  Eigen::VectorXd position = Eigen::VectorXd::Zero(count);
  position.head<6>() = current.head<6>().cwiseQuotient(sigmas.head<6>());
  // Smooth images have a wide basin of convergence; sharp images have an exact minimum.
  for (const double blur_px : {2.0, 1.0}) {
    contrast.setBlur(blur_px);
    position = minimise(cost, position, descent);
  }
  const Eigen::VectorXd found = sigmas.cwiseProduct(position);
  return {found.head<3>(), found.segment<3>(3)};
}

}  // namespace efm
