// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/faults/keyframe_noise.h"

#include "mapping/base/named_choice.h"
#include "mapping/geometry/timestamp.h"
#include "tracking_stub/random/random_numbers.h"

namespace efm {
namespace {

constexpr std::int64_t kMinLengthNs = 1'000'000;
constexpr std::int64_t kMaxLengthNs = 1'000'000'000'000'000;

std::int64_t floorDivide(std::int64_t value, std::int64_t by) {
  return value / by - (value % by < 0 ? 1 : 0);
}

}  // namespace

void KeyframeNoiseOptions::validate() const {
  requireOption(noise_m >= 0 && noise_m <= 1e3, "noise_m of keyframes", noise_m, "0 to 1e3");
  requireOption(noise_rad >= 0 && noise_rad <= 3.2, "noise_rad of keyframes", noise_rad,
                "0 to 3.2");
  requireOption(!any() || length_ns.has_value(), "length_ns of keyframes", "nothing",
                "given where there is noise per keyframe");
  requireOption(!length_ns || (*length_ns >= kMinLengthNs && *length_ns <= kMaxLengthNs),
                "length_ns of keyframes", length_ns.value_or(0), "1e6 to 1e15");
  requireOption(!start_ns || (*start_ns > -kEndOfTimeNs && *start_ns < kEndOfTimeNs),
                "start_ns of keyframes", start_ns.value_or(0), "within 4.6e18 of 0");
}

KeyframeNoise::KeyframeNoise(const KeyframeNoiseOptions& options, const Clock& clock,
                             std::uint64_t seed)
    : options_(options),
      start_ns_(options.start_ns.value_or(clock.first_pose_ns)),
      tick_ns_(clock.tick_ns),
      seed_(seed) {
  options_.validate();
  requireOption(options_.length_ns.has_value(), "length_ns of keyframes", "nothing", "given");
  requireOption(tick_ns_ >= 1 && tick_ns_ < kMinLengthNs, "tick_ns", tick_ns_, "1 to 999999");
}

std::int64_t KeyframeNoise::beginNs(std::int64_t interval) const {
  return floorDivide(start_ns_ + interval * *options_.length_ns, tick_ns_) * tick_ns_;
}

std::int64_t KeyframeNoise::intervalAt(std::int64_t t_ns) const {
  const std::int64_t interval = floorDivide(t_ns - start_ns_, *options_.length_ns);
  return t_ns >= beginNs(interval + 1) ? interval + 1 : interval;  // beginnings are rounded down
}

Rigid3 KeyframeNoise::errorOf(std::int64_t interval, const Eigen::Vector3d& rig_world) const {
  RandomNumbers random(seed_, static_cast<std::uint64_t>(interval));
  const Eigen::Vector3d shift_world = options_.noise_m * normalVector(random);
  const Eigen::Quaterniond rotation = rotationBy(options_.noise_rad * normalVector(random));
  return {rotation, rig_world - rotation * rig_world + shift_world};
}

}  // namespace efm
