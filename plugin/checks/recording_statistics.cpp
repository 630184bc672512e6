// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/checks/recording_statistics.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "mapping/geometry/timestamp.h"

namespace efm {

void EventRate::joinBins() {
  for (std::size_t bin = 0; bin < kBins / 2; ++bin) {
    counts_[bin] = counts_[2 * bin] + counts_[2 * bin + 1];
  }
  std::fill(counts_.begin() + kBins / 2, counts_.end(), 0);
  ++log2_width_;
}

std::vector<double> EventRate::over(std::int64_t t0_ns, std::int64_t t1_ns, int intervals) const {
  std::vector<double> rates(static_cast<std::size_t>(intervals), 0.0);
  const double interval_s = secondsBetween(t0_ns, t1_ns) / intervals;
  if (!start_ns_ || interval_s <= 0) return rates;
  const double width_s = std::ldexp(1e-9, log2_width_);
  for (std::size_t bin = 0; bin < counts_.size(); ++bin) {
    if (counts_[bin] == 0) continue;
    // The last bins may reach beyond t1, but their events do not.
    const double from =
        (secondsBetween(t0_ns, *start_ns_) + static_cast<double>(bin) * width_s) / interval_s;
    const double first = std::clamp<double>(from, 0, intervals - 1e-3);
    const double last = std::clamp<double>(from + width_s / interval_s, first + 1e-3, intervals);
    for (int i = static_cast<int>(first); i < last; ++i) {
      const double overlap = std::min(last, i + 1.0) - std::max<double>(first, i);
      rates[static_cast<std::size_t>(i)] +=
          static_cast<double>(counts_[bin]) * overlap / (last - first) / interval_s;
    }
  }
  return rates;
}

double EventRate::countIn(std::int64_t t0_ns, std::int64_t t1_ns) const {
  double count = 0;
  if (!start_ns_) return count;
  const double width_s = std::ldexp(1e-9, log2_width_);
  const double first = secondsBetween(*start_ns_, t0_ns) / width_s;
  const double last = secondsBetween(*start_ns_, t1_ns) / width_s;
  const auto end = static_cast<std::size_t>(std::clamp<double>(std::ceil(last), 0, kBins));
  for (auto bin = static_cast<std::size_t>(std::clamp<double>(first, 0, kBins)); bin < end; ++bin) {
    const auto begin = static_cast<double>(bin);
    const double overlap = std::min(last, begin + 1) - std::max(first, begin);
    count += static_cast<double>(counts_[bin]) * std::max(overlap, 0.0);
  }
  return count;
}

std::string sparkline(const std::vector<double>& values) {
  static constexpr const char* kBlocks[] = {"▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
  const double max = values.empty() ? 0 : *std::max_element(values.begin(), values.end());
  std::string line;
  for (const double value : values) {
    line += value > 0 ? kBlocks[std::min(7, static_cast<int>(8 * value / max))] : " ";
  }
  return line;
}

namespace {

std::uint64_t countBetween(const std::vector<std::int64_t>& times_ns, std::int64_t from_ns,
                           std::int64_t until_ns) {
  return static_cast<std::uint64_t>(
      std::count_if(times_ns.begin(), times_ns.end(),
                    [&](std::int64_t t_ns) { return t_ns >= from_ns && t_ns < until_ns; }));
}

double distanceOf(const Rigid3& T_world_a, const Rigid3& T_world_b) {
  return (T_world_b.translation - T_world_a.translation).norm();
}

double angleOf(const Rigid3& T_world_a, const Rigid3& T_world_b) {
  return T_world_a.rotation.angularDistance(T_world_b.rotation);
}

}  // namespace

StatisticsOptions statisticsOptions(const EventFusionOptions& options) {
  StatisticsOptions statistics;
  const FusionMapperOptions& mapper = options.mapper;
  statistics.cameras = mapper.cameras;
  statistics.pose_source = options.rig.pose_source;
  if (mapper.only_window) {
    statistics.window_s = secondsBetween(mapper.only_window->t0_ns, mapper.only_window->t1_ns);
  } else if (mapper.policy.policy != KeyframePolicyKind::kEvents) {
    statistics.window_s = mapper.policy.window_s;
  }
  return statistics;
}

void StreamStatistics::add(std::int64_t from_ns, std::int64_t until_ns, std::uint64_t number) {
  count += number;
  if (last_ns && from_ns > *last_ns && from_ns - *last_ns > max_gap_ns) {
    max_gap_ns = from_ns - *last_ns;
    max_gap_start_ns = *last_ns;
  }
  first_ns = std::min(first_ns.value_or(from_ns), from_ns);
  last_ns = std::max(last_ns.value_or(until_ns), until_ns);
}

double StreamStatistics::seconds() const {
  return first_ns ? secondsBetween(*first_ns, *last_ns) : 0.0;
}

double StreamStatistics::rate() const {
  return seconds() > 0 ? static_cast<double>(count) / seconds() : 0.0;
}

void PoseStatistics::add(const StampedPose& pose, std::int64_t window_ns) {
  // In shorter steps, the noise of a tracker with a high rate looks like speed.
  constexpr std::int64_t kMinStepNs = 10'000'000;
  const bool late = poses.last_ns && pose.t_ns <= *poses.last_ns;
  const bool earlier = poses.last_ns && pose.t_ns < *poses.last_ns;
  poses.add(pose.t_ns, pose.t_ns, 1);
  if (!earlier) check.add(pose);
  if (!step_begin_) step_begin_ = window_begin_ = pose;
  if (late) {  // poses may come in falling order
    if (window_begin_->t_ns - pose.t_ns > window_ns) return;
    max_shift_m = std::max(max_shift_m, distanceOf(window_begin_->T_world_rig, pose.T_world_rig));
    return;
  }
  motion.add(pose);
  if (pose.t_ns - step_begin_->t_ns >= kMinStepNs) {
    const double step_s = secondsBetween(step_begin_->t_ns, pose.t_ns);
    const double step_m = distanceOf(step_begin_->T_world_rig, pose.T_world_rig);
    path_m += step_m;
    max_speed = std::max(max_speed, step_m / step_s);
    max_rotation_rate =
        std::max(max_rotation_rate, angleOf(step_begin_->T_world_rig, pose.T_world_rig) / step_s);
    step_begin_ = pose;
  }
  max_shift_m = std::max(max_shift_m, distanceOf(window_begin_->T_world_rig, pose.T_world_rig));
  max_rotation_rad =
      std::max(max_rotation_rad, angleOf(window_begin_->T_world_rig, pose.T_world_rig));
  if (pose.t_ns - window_begin_->t_ns >= window_ns) window_begin_ = pose;
}

bool RecordingStatistics::add(const Sample& sample) {
  if (const auto* packet = std::get_if<EventPacket>(&sample)) {
    addEvents(*packet);
    return true;
  }
  const auto* pose = std::get_if<PoseSample>(&sample);
  if (pose == nullptr) return false;
  addPose(*pose);
  return true;
}

void RecordingStatistics::setCameras(const Rig& rig, const std::vector<RecordedCamera>& recorded) {
  // A sensor without a calibration may have the largest possible size.
  constexpr std::size_t kMaxPixels = 1U << 24U;
  for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
    if (!isSelected(static_cast<int>(i), options_.cameras)) continue;
    CameraStatistics& statistics = cameras_[static_cast<int>(i)];
    if (i < recorded.size()) statistics.label = recorded[i].label;
    statistics.camera = rig.cameras[i];
    const CameraModel& model = statistics.camera.model;
    const std::size_t pixels =
        static_cast<std::size_t>(model.width) * static_cast<std::size_t>(model.height);
    if (pixels <= kMaxPixels) statistics.pixels.assign(pixels, 0);
  }
}

void RecordingStatistics::addEvents(const EventPacket& packet) {
  const auto entry = cameras_.find(packet.camera);
  if (entry == cameras_.end()) return;  // it takes no part
  CameraStatistics& statistics = entry->second;
  const auto width = static_cast<std::size_t>(statistics.camera.model.width);
  const std::int64_t offset_ns = statistics.camera.time_offset_ns;
  std::vector<std::int64_t>& times_ns = statistics.newest_ns;
  times_ns.clear();
  times_ns.reserve(packet.events.size());
  std::uint64_t positive = 0;
  for (const Event& event : packet.events) {
    const std::int64_t t_ns = trajectoryTime(event.t_ns, offset_ns);
    statistics.rate.add(t_ns);
    positive += event.polarity ? 1 : 0;
    const std::size_t pixel = event.y * width + event.x;
    if (pixel < statistics.pixels.size()) ++statistics.pixels[pixel];
    times_ns.push_back(t_ns);
  }
  if (times_ns.empty()) return;
  statistics.positive += positive;
  const auto [first_ns, last_ns] = std::minmax_element(times_ns.begin(), times_ns.end());
  statistics.events.add(*first_ns, *last_ns, times_ns.size());
  if (!poses_.last_ns || (*first_ns >= *poses_.first_ns && *last_ns <= *poses_.last_ns)) return;
  events_before_poses_ += countBetween(statistics.newest_ns, kMinTimeNs, *poses_.first_ns);
  events_after_poses_ += countBetween(statistics.newest_ns, *poses_.last_ns + 1, kMaxTimeNs);
}

void RecordingStatistics::addPose(const PoseSample& pose) {
  const std::int64_t t_ns = trajectoryTime(pose.t_ns, 0);
  const auto [entry, is_new] = pose_sources_.try_emplace(pose.source);
  if (is_new) entry->second.order = pose_sources_.size();
  entry->second.lever_m = std::max(entry->second.lever_m, pose.T_body_rig.translation.norm());
  entry->second.add({t_ns, pose.T_world_rig()}, durationFromSeconds(options_.window_s));
  countAroundPose(t_ns);
}

/// A new pose can be only within the last packet of each camera, because the recording is in the
/// order of time.
void RecordingStatistics::countAroundPose(std::int64_t t_ns) {
  const bool first = poses_.count == 0;
  poses_.add(t_ns, t_ns, 1);
  const bool newest = *poses_.last_ns == t_ns;
  if (newest) events_after_poses_ = 0;
  for (const auto& [index, camera] : cameras_) {
    if (first) {
      events_before_poses_ +=
          camera.events.count - countBetween(camera.newest_ns, t_ns, kMaxTimeNs);
    }
    if (newest) events_after_poses_ += countBetween(camera.newest_ns, t_ns + 1, kMaxTimeNs);
  }
}

const PoseStatistics* RecordingStatistics::usedPoses() const {
  const PoseStatistics* used = nullptr;
  PoseKind kind = PoseKind::kPose;
  for (const auto& [source, poses] : pose_sources_) {
    if (!options_.pose_source.empty() && source.label != options_.pose_source) continue;
    if (used && std::tie(kind, used->order) <= std::tie(source.kind, poses.order)) continue;
    used = &poses;
    kind = source.kind;
  }
  return used;
}

std::optional<TimeSpan> RecordingStatistics::eventSpan() const {
  std::optional<TimeSpan> span;
  for (const auto& [index, camera] : cameras_) {
    if (!camera.events.first_ns) continue;
    extend(span, *camera.events.first_ns);
    extend(span, *camera.events.last_ns);
  }
  return span;
}

double overlapOf(const TimeSpan& events, const TimeSpan& poses) {
  const std::int64_t from_ns = std::max(events.first_ns, poses.first_ns);
  const std::int64_t until_ns = std::min(events.last_ns, poses.last_ns);
  if (from_ns > until_ns) return 0;
  const double events_s = secondsBetween(events.first_ns, events.last_ns);
  return events_s > 0 ? secondsBetween(from_ns, until_ns) / events_s : 1;
}

}  // namespace efm
