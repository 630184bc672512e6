// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/keyframes/view_motion.h"

#include <algorithm>
#include <cmath>

namespace efm {
namespace {

/// How far a unit of inverse depth (1/m) moves the view of a camera at `p_view` (metres), in
/// pixels, on average over the view.
double meanParallax(const ReferenceView& view, const Eigen::Vector3d& p_view) {
  constexpr int kGrid = 5;
  double sum = 0;
  for (int row = 0; row < kGrid; ++row) {
    for (int column = 0; column < kGrid; ++column) {
      const Eigen::Vector3d ray =
          view.pointAt((column + 0.5) / kGrid * view.width, (row + 0.5) / kGrid * view.height, 1);
      sum += std::hypot(view.fx * (p_view.x() - ray.x() * p_view.z()),
                        view.fy * (p_view.y() - ray.y() * p_view.z()));
    }
  }
  return sum / (kGrid * kGrid);
}

}  // namespace

std::optional<ViewMotion> motionIn(const WindowData& data, const Rig& rig,
                                   const std::vector<int>& cameras,
                                   const KeyframeMapperOptions& options) {
  const std::optional<Rigid3> T_world_rig = data.trajectory->poseAt(data.window.t_ref_ns);
  if (!T_world_rig) return std::nullopt;
  const auto reference = static_cast<std::size_t>(options.reference_camera);
  const Rigid3& T_rig_view = rig.cameras.at(reference).T_rig_cam;
  const Rigid3 T_view_world = (*T_world_rig * T_rig_view).inverse();
  const ReferenceView view = makeReferenceView(rig.cameras.at(reference).model, options.view);
  ViewMotion motion;
  constexpr int kSteps = 16;
  for (int step = 0; step <= kSteps; ++step) {
    const std::int64_t t_ns =
        data.window.t0_ns + (data.window.t1_ns - data.window.t0_ns) / kSteps * step;
    const std::optional<Rigid3> T_world_then = data.trajectory->poseAt(t_ns);
    if (!T_world_then) continue;
    const Rigid3 T_view_rig = T_view_world * *T_world_then;
    for (const int camera : cameras) {
      const Rigid3& T_rig_cam = rig.cameras.at(static_cast<std::size_t>(camera)).T_rig_cam;
      motion.rig_baseline_m =
          std::max(motion.rig_baseline_m, (T_rig_cam.translation - T_rig_view.translation).norm());
      const double parallax_px_m = meanParallax(view, (T_view_rig * T_rig_cam).translation);
      motion.parallax_px_m = std::max(motion.parallax_px_m, parallax_px_m);
    }
    const Rigid3 T_view_then = T_view_rig * T_rig_view;
    motion.shift_m = std::max(motion.shift_m, T_view_then.translation.norm());
    motion.rotation_rad =
        std::max(motion.rotation_rad, Eigen::AngleAxisd(T_view_then.rotation).angle());
  }
  return motion;
}

}  // namespace efm
