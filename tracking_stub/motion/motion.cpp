// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/motion/motion.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <utility>

#include "mapping/base/option.h"
#include "mapping/depth/peak_fit.h"
#include "mapping/geometry/timestamp.h"

namespace efm {

LoopMotion::LoopMotion(const LoopMotionOptions& options) : options_(options) {
  requireOption(options_.period_s > 0, "period_s", options_.period_s, "above 0");
}

Rigid3 LoopMotion::poseAt(std::int64_t t_ns) const {
  const double phase = 2 * kPi * secondsBetween(options_.start_ns, t_ns) / options_.period_s;
  Eigen::Matrix3d R_outward_cam;  // outward: x out, y left, z up
  R_outward_cam << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  Rigid3 T_world_cam;
  T_world_cam.translation = {options_.radius_x_m * std::cos(phase),
                             options_.radius_y_m * std::sin(phase), options_.height_m};
  T_world_cam.rotation = Eigen::AngleAxisd(phase + options_.heading_rad, Eigen::Vector3d::UnitZ()) *
                         Eigen::Quaterniond(R_outward_cam);
  return options_.sway ? T_world_cam * options_.sway->poseAt(t_ns) : T_world_cam;
}

namespace {

double valueAt(const std::vector<Sine>& sines, double t_s) {
  double sum = 0;
  for (const Sine& sine : sines) {
    sum += sine.amplitude * std::sin(2 * kPi * sine.frequency_hz * t_s + sine.phase_rad);
  }
  return sum;
}

Eigen::Vector3d valueAt(const std::array<std::vector<Sine>, 3>& axes, double t_s) {
  return {valueAt(axes[0], t_s), valueAt(axes[1], t_s), valueAt(axes[2], t_s)};
}

}  // namespace

Rigid3 SmoothMotion::poseAt(std::int64_t t_ns) const {
  const double t_s = secondsBetween(options_.start_ns, t_ns);
  Rigid3 T_center_rig;
  T_center_rig.translation = valueAt(options_.translation, t_s) + options_.velocity * t_s;
  T_center_rig.rotation = rotationBy(valueAt(options_.rotation, t_s));
  return options_.T_world_center * T_center_rig;
}

namespace {

using Poses = std::vector<StampedPose>;

Poses inOrder(Poses poses) {
  std::stable_sort(poses.begin(), poses.end(),
                   [](const StampedPose& a, const StampedPose& b) { return a.t_ns < b.t_ns; });
  const auto same = [](const StampedPose& a, const StampedPose& b) { return a.t_ns == b.t_ns; };
  poses.erase(std::unique(poses.begin(), poses.end(), same), poses.end());
  requireOption(poses.size() >= 2, "poses", poses.size(), "at least 2 of different times");
  return poses;
}

Rigid3 between(const StampedPose& a, const StampedPose& b, std::int64_t t_ns) {
  return interpolate(a.T_world_rig, b.T_world_rig,
                     secondsBetween(a.t_ns, t_ns) / secondsBetween(a.t_ns, b.t_ns));
}

/// Returns the distance of each inner pose from the line between its neighbours: metres, radians.
std::pair<std::vector<double>, std::vector<double>> distancesToLine(const Poses& poses) {
  std::vector<double> metres(poses.size(), 0.0);
  std::vector<double> radians(poses.size(), 0.0);
  for (std::size_t i = 1; i + 1 < poses.size(); ++i) {
    const Rigid3& here = poses[i].T_world_rig;
    const Rigid3 expected = between(poses[i - 1], poses[i + 1], poses[i].t_ns);
    metres[i] = (here.translation - expected.translation).norm();
    radians[i] = here.rotation.angularDistance(expected.rotation);
  }
  return {metres, radians};
}

/// Marks only local maxima above the limit: half of a jump also appears in the adjacent poses.
void markJumps(const std::vector<double>& distances, std::vector<bool>& jumps) {
  constexpr double kTimesMedian = 8;
  std::vector<double> reordered = distances;
  const double limit = kTimesMedian * upperMedian(reordered) + 1e-9;
  for (std::size_t i = 1; i + 1 < distances.size(); ++i) {
    if (distances[i] > limit && distances[i] >= distances[i - 1] &&
        distances[i] > distances[i + 1]) {
      jumps[i] = true;
    }
  }
}

Poses withoutJumps(const Poses& poses) {
  const auto [metres, radians] = distancesToLine(poses);
  std::vector<bool> jumps(poses.size(), false);
  markJumps(metres, jumps);
  markJumps(radians, jumps);
  Poses kept;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (!jumps[i]) kept.push_back(poses[i]);
  }
  return kept;
}

void rejectGaps(const Poses& poses) {
  constexpr double kMaxGapS = 1;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    const double gap_s = secondsBetween(poses[i - 1].t_ns, poses[i].t_ns);
    if (gap_s <= kMaxGapS) continue;
    throw std::invalid_argument("no pose for " + std::to_string(gap_s) + " s after t = " +
                                formatSeconds(poses[i - 1].t_ns) + ": a gap of at most " +
                                std::to_string(kMaxGapS) + " s can be bridged");
  }
}

double medianPeriod(const Poses& poses) {
  std::vector<double> periods;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    periods.push_back(secondsBetween(poses[i - 1].t_ns, poses[i].t_ns));
  }
  return upperMedian(periods);
}

Poses resampled(const Poses& poses, std::int64_t period_ns) {
  Poses even;
  std::size_t i = 0;
  for (std::int64_t t_ns = poses.front().t_ns; t_ns <= poses.back().t_ns; t_ns += period_ns) {
    while (i + 2 < poses.size() && poses[i + 1].t_ns <= t_ns) ++i;
    even.push_back({t_ns, between(poses[i], poses[i + 1], t_ns)});
  }
  return even;
}

/// Returns the right half of a sinc under a Hann window. The half width of the window is two
/// periods of the cutoff frequency. The sum over both halves is 1.
std::vector<double> lowPass(double cutoff_hz, double period_s) {
  const double half_width_s = 2 / cutoff_hz;
  const int taps = static_cast<int>(std::floor(half_width_s / period_s));
  std::vector<double> weights = {1};
  double sum = 1;
  for (int k = 1; k <= taps; ++k) {
    const double t_s = k * period_s;
    const double x = 2 * kPi * cutoff_hz * t_s;
    weights.push_back(std::sin(x) / x * 0.5 *
                      (1 + std::cos(kPi * t_s / (half_width_s + period_s))));
    sum += 2 * weights.back();
  }
  for (double& weight : weights) weight /= sum;
  return weights;
}

/// Returns the pose at an index, which may be beyond an end. Beyond an end the motion is mirrored
/// at the end pose, so the end keeps its position, speed and rate of rotation.
Rigid3 extended(const Poses& poses, std::ptrdiff_t i) {
  const auto last = static_cast<std::ptrdiff_t>(poses.size()) - 1;
  const auto at = [&](std::ptrdiff_t k) -> const Rigid3& {
    return poses[static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(k, 0, last))].T_world_rig;
  };
  if (i >= 0 && i <= last) return at(i);
  const std::ptrdiff_t end = i < 0 ? 0 : last;
  const Rigid3& mirrored = at(2 * end - i);
  return {at(end).rotation * mirrored.rotation.conjugate() * at(end).rotation,
          2 * at(end).translation - mirrored.translation};
}

Eigen::Vector3d logarithm(const Eigen::Quaterniond& rotation) {
  const double sign = rotation.w() < 0 ? -1 : 1;  // q and -q are the same rotation
  const double sine = rotation.vec().norm();
  if (sine < 1e-12) return 2 * sign * rotation.vec();
  return sign * 2 * std::atan2(sine, sign * rotation.w()) / sine * rotation.vec();
}

Poses filtered(const Poses& poses, const std::vector<double>& weights) {
  Poses smooth = poses;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Rigid3& here = poses[i].T_world_rig;
    Eigen::Vector3d shift = Eigen::Vector3d::Zero();
    Eigen::Vector3d rotation_vector = Eigen::Vector3d::Zero();
    for (std::size_t k = 1; k < weights.size(); ++k) {
      for (const int side : {-1, 1}) {
        const Rigid3 other =
            extended(poses, static_cast<std::ptrdiff_t>(i) + side * static_cast<std::ptrdiff_t>(k));
        shift += weights[k] * (other.translation - here.translation);
        rotation_vector += weights[k] * logarithm(here.rotation.conjugate() * other.rotation);
      }
    }
    Rigid3& T_world_rig = smooth[i].T_world_rig;
    T_world_rig.translation += shift;
    const double angle = rotation_vector.norm();
    if (angle > 0) {
      T_world_rig.rotation =
          (here.rotation * Eigen::Quaterniond(Eigen::AngleAxisd(angle, rotation_vector / angle)))
              .normalized();
    }
  }
  return smooth;
}

}  // namespace

std::vector<StampedPose> smoothTrajectory(const std::vector<StampedPose>& poses) {
  constexpr std::int64_t kPeriodNs = 5'000'000;
  const Poses clean = withoutJumps(inOrder(poses));
  rejectGaps(clean);
  // Above half of the poses' rate there are only artefacts of interpolation.
  const double cutoff_hz = std::min(10.0, 0.4 / medianPeriod(clean));
  return filtered(resampled(clean, kPeriodNs), lowPass(cutoff_hz, secondsBetween(0, kPeriodNs)));
}

std::int64_t startOfMotion(const std::vector<StampedPose>& poses) {
  constexpr double kSegmentS = 0.5;
  requireOption(!poses.empty(), "poses", poses.size(), "at least 1");
  struct Segment {
    std::int64_t begin_ns;
    double duration_s, length_m;
  };
  std::vector<Segment> segments;
  double length_m = 0;
  std::size_t begin = 0;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    const double duration_s = secondsBetween(poses[begin].t_ns, poses[i].t_ns);
    if (duration_s < kSegmentS) continue;
    const double chord_m =
        (poses[i].T_world_rig.translation - poses[begin].T_world_rig.translation).norm();
    segments.push_back({poses[begin].t_ns, duration_s, chord_m});
    length_m += chord_m;
    begin = i;
  }
  const double mean_speed = length_m / secondsBetween(poses.front().t_ns, poses[begin].t_ns);
  for (const Segment& segment : segments) {
    if (segment.length_m >= 0.5 * mean_speed * segment.duration_s) return segment.begin_ns;
  }
  return poses.front().t_ns;
}

SampledMotion::SampledMotion(std::vector<StampedPose> poses) : poses_(std::move(poses)) {
  requireOption(poses_.size() >= 2, "poses", poses_.size(), "at least 2");
  period_ns_ = poses_[1].t_ns - poses_[0].t_ns;
  for (std::size_t i = 1; i < poses_.size(); ++i) {
    const std::int64_t period_ns = poses_[i].t_ns - poses_[i - 1].t_ns;
    requireOption(period_ns > 0 && period_ns == period_ns_, "time between poses", period_ns,
                  "above 0 and always the same");
  }
}

Rigid3 SampledMotion::poseAt(std::int64_t t_ns) const {
  if (t_ns <= poses_.front().t_ns) return poses_.front().T_world_rig;
  if (t_ns >= poses_.back().t_ns) return poses_.back().T_world_rig;
  const auto i = static_cast<std::size_t>((t_ns - poses_.front().t_ns) / period_ns_);
  return between(poses_[i], poses_[i + 1], t_ns);
}

}  // namespace efm
