// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/streams/sample.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "mapping/base/option.h"
#include "mapping/base/text.h"
#include "mapping/geometry/timestamp.h"
#include "plugin/recordings/streams/recording_parts.h"

namespace efm {

std::string asText(const PoseSourceId& source) {
  if (source.kind == PoseKind::kActions) return "actions";
  return (source.kind == PoseKind::kPose ? "poses " : "odometry ") + inQuotes(source.label);
}

std::int64_t trajectoryTime(std::int64_t t_ns, std::int64_t time_offset_ns) {
  const auto within = [](std::int64_t t) { return std::clamp(t, -kEndOfTimeNs, kEndOfTimeNs); };
  return within(within(t_ns) + within(time_offset_ns));
}

std::int64_t nearestTick(std::int64_t t_ns) {
  std::int64_t ticks = t_ns / kTickNs;
  const std::int64_t rest_ns = t_ns % kTickNs;
  if (2 * rest_ns >= kTickNs) ++ticks;
  if (2 * rest_ns < -kTickNs) --ticks;
  return ticks * kTickNs;
}

namespace {

constexpr double kSteps = 1099511627776.0;  // 2^40: of 1

double onGrid(double value) { return std::round(value * kSteps) / kSteps + 0.0; }  // not -0

}  // namespace

Rigid3 roundedMount(const Rigid3& T_body_rig) {
  Rigid3 mount = roundedPose(T_body_rig);
  for (double& component : mount.translation) component = onGrid(component);
  return mount;
}

Rigid3 roundedPose(const Rigid3& T_a_b) {
  // One component is at least 0.5, so one is found. Special rotations have no component near this
  // bound, so that the last digits do not decide which one it is.
  constexpr double kLarge = 0.4321;
  Eigen::Vector4d q(T_a_b.rotation.w(), T_a_b.rotation.x(), T_a_b.rotation.y(), T_a_b.rotation.z());
  q /= q.norm();  // 0 becomes NaN, which is rejected later
  int large = 0;
  while (large < 3 && !(std::abs(q[large]) > kLarge)) ++large;
  if (q[large] < 0) q = -q;
  double rest = 1;
  for (int i = 0; i < 4; ++i) {
    if (i == large) continue;
    q[i] = onGrid(q[i]);
    rest -= q[i] * q[i];
  }
  q[large] = std::sqrt(rest);
  return {{q[0], q[1], q[2], q[3]}, T_a_b.translation};
}

RigSetup readRigSetup(const std::filesystem::path& calibration,
                      const std::filesystem::path& hand_eye) {
  RigSetup setup;
  if (!calibration.empty()) setup.calibration = readCalibration(calibration);
  if (!hand_eye.empty()) {
    setup.T_body_rig =
        roundedMount(readHandEye(hand_eye, setup.calibration ? &*setup.calibration : nullptr));
  }
  return setup;
}

Rig calibrated(Rig rig, const RigSetup& setup, const std::vector<std::int64_t>& time_offsets_ns) {
  const std::size_t count = rig.cameras.size();
  if (setup.calibration) setup.calibration->requireLike(rig);
  requireOption(time_offsets_ns.empty() || time_offsets_ns.size() == count,
                OptionName("rig", "time_offsets_s", " (how many)"), time_offsets_ns.size(),
                fmt::format("one per camera of the recording: {}", count));
  for (std::size_t i = 0; i < count; ++i) {
    RigCamera& camera = rig.cameras[i];
    if (setup.calibration) camera = setup.calibration->camera(i, knownSize(camera.model));
    camera.T_rig_cam = roundedPose(camera.T_rig_cam);
    if (!time_offsets_ns.empty()) camera.time_offset_ns = time_offsets_ns[i];
  }
  return rig;
}

Rigid3 PoseSample::T_world_rig() const { return roundedPose(T_world_body * T_body_rig); }

}  // namespace efm
