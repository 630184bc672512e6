// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/open/joined_recording.h"

#include <algorithm>
#include <set>
#include <stdexcept>
#include <utility>

#include "mapping/base/option.h"
#include "mapping/geometry/timestamp.h"

namespace efm {
namespace {

/// Cuts the poses, see `join`. @param poses in the order of time.
void cutPoses(const TimeLimits& limits, std::vector<PoseSample>& poses) {
  if (!limits.t0_ns && !limits.t1_ns) return;
  std::set<PoseSourceId> has_before, has_after;
  const auto keep = [&](const PoseSample& pose) {
    if (limits.t0_ns && pose.t_ns < *limits.t0_ns) return has_before.insert(pose.source).second;
    if (limits.t1_ns && pose.t_ns >= *limits.t1_ns) return has_after.insert(pose.source).second;
    return true;
  };
  std::vector<PoseSample> kept;
  const auto begin = std::find_if(poses.begin(), poses.end(), [&](const PoseSample& pose) {
    return !limits.t0_ns || pose.t_ns >= *limits.t0_ns;
  });
  for (auto pose = begin; pose != poses.begin();) {  // the newest poses before t0
    if (keep(*--pose)) kept.push_back(std::move(*pose));
  }
  std::reverse(kept.begin(), kept.end());
  for (auto pose = begin; pose != poses.end(); ++pose) {
    if (keep(*pose)) kept.push_back(std::move(*pose));
  }
  poses = std::move(kept);
}

class JoinedRecording : public Recording {
 public:
  JoinedRecording(JoinedParts parts, const TimeLimits& limits)
      : parts_(std::move(parts)),
        limits_(limits),
        bad_(std::make_unique<BadEvents>(parts_.skip_bad_events)) {
    limits.validate();
    requireOption(parts_.cameras.size() == parts_.rig.cameras.size(), "event streams",
                  parts_.cameras.size(), "one per camera");
    for (std::size_t i = 0; i < parts_.cameras.size(); ++i) {
      const std::int64_t offset_ns = offsetOf(i);
      parts_.cameras[i].skipBadEvents(*bad_);
      if (limits.t0_ns) parts_.cameras[i].startAt(*limits.t0_ns - offset_ns);
      if (limits.t1_ns) parts_.cameras[i].stopAt(*limits.t1_ns - offset_ns);
    }
    std::stable_sort(parts_.poses.begin(), parts_.poses.end(),
                     [](const auto& a, const auto& b) { return a.t_ns < b.t_ns; });
    for (std::size_t i = 0; i < parts_.cameras.size() && !parts_.poses.empty(); ++i) {
      parts_.cameras[i].expectPoses(parts_.poses.front().t_ns - offsetOf(i),
                                    parts_.poses.back().t_ns - offsetOf(i));
    }
    if (!parts_.all_poses) cutPoses(limits, parts_.poses);
    if (!limits.t0_ns && !limits.t1_ns && !parts_.only_poses) requireEvents();
  }

  std::optional<Sample> read() override {
    readAhead();
    if (next_pose_ < parts_.poses.size()) {
      PoseSample& pose = parts_.poses[next_pose_];
      if (isDue(pose.t_ns + parts_.latency_ns)) {
        position_ = "the poses";
        ++next_pose_;
        return std::move(pose);
      }
    }
    if (other_ && (!other_->t_ns || isDue(*other_->t_ns))) {
      return *std::exchange(other_, std::nullopt);
    }
    if (!packet_) return std::nullopt;
    position_ = packet_position_;
    return *std::exchange(packet_, std::nullopt);
  }

  /// Damage at which the recording ended comes first. What lies behind the limits is none, unless
  /// all streams of the file share it.
  std::string damage() const override {
    std::string damage = damaged_ ? parts_.cameras[*damaged_].damage() : parts_.poses_damage;
    for (const EventPackets& camera : parts_.cameras) {
      if (damage.empty() && camera.stream().sharesDamage()) damage = camera.stream().damage();
    }
    return damage;
  }

  const Rig& rig() const override { return parts_.rig; }
  std::vector<RecordedCamera> cameras() const override {
    std::vector<RecordedCamera> cameras;
    for (std::size_t i = 0; i < parts_.cameras.size(); ++i) {
      const EventStream& stream = parts_.cameras[i].stream();
      RecordedCamera& camera = cameras.emplace_back();
      camera.label = stream.label().empty() ? "cam" + std::to_string(i) : stream.label();
      camera.original = stream.original();
      if (i < first_ns_.size()) camera.first_ns = first_ns_[i];
    }
    return cameras;
  }
  std::string position() const override { return position_; }

  double progress() const override {
    double least = 1;
    for (const EventPackets& camera : parts_.cameras) {
      least = std::min(least, camera.stream().progress());
    }
    return least;
  }

  RecordingCounts counts() const override {
    RecordingCounts counts;
    counts.warnings = parts_.warnings;
    counts.notes = parts_.notes;
    counts.recalibrated = parts_.recalibrated;
    counts.of_calibration = parts_.of_calibration;
    counts.topics = parts_.topics;
    counts.transforms = parts_.transforms;
    counts.skipped_events = bad_->count();
    counts.first_skipped = bad_->first();
    for (std::size_t i = 0; i < parts_.cameras.size(); ++i) {
      const EventPackets& camera = parts_.cameras[i];
      if (const auto t_ns = camera.nearestBefore()) {
        const std::int64_t before_ns = *t_ns + offsetOf(i);
        counts.nearest_before_ns =
            std::max(counts.nearest_before_ns.value_or(before_ns), before_ns);
      }
      if (const auto t_ns = camera.nearestAfter()) {
        const std::int64_t after_ns = *t_ns + offsetOf(i);
        counts.nearest_after_ns = std::min(counts.nearest_after_ns.value_or(after_ns), after_ns);
      }
      counts.sorted_events += camera.sortedEvents();
      counts.lost_packets += camera.stream().lostPackets();
      counts.undated_events += camera.stream().undatedEvents();
      for (Warning& warning : camera.stream().warnings()) {
        counts.warnings.push_back(std::move(warning));
      }
    }
    return counts;
  }

 private:
  /// Returns the offset from a camera's clock to the clock of the poses.
  std::int64_t offsetOf(std::size_t camera) const {
    return parts_.rig.cameras[camera].time_offset_ns;
  }

  void requireEvents() {
    if (parts_.cameras.empty()) return;
    const std::optional<std::size_t> first = nextCamera();
    if (first && parts_.cameras[*first].isAtDamage()) {
      throw std::runtime_error(parts_.cameras[*first].damage());
    }
    if (first || !damage().empty()) return;  // the recording ends with damage
    std::string names;
    for (const EventPackets& camera : parts_.cameras) {
      names += (names.empty() ? "" : ", ") + camera.stream().name();
    }
    throw std::runtime_error(names + ": no events: expected at least one");
  }

  /// Returns whether there is no next packet, or it does not begin before this time.
  bool isDue(std::int64_t t_ns) const {
    return !packet_ || nearestTick(t_ns) <= nearestTick(packet_->events.front().t_ns);
  }

  /// Reads the next packet and object. After damage of the events, only poses come.
  void readAhead() {
    if (parts_.only_poses) return;
    if (!packet_ && !damaged_) packet_ = nextPacket();
    while (parts_.others && !other_ && !damaged_) {
      other_ = parts_.others->next();
      if (!other_) parts_.others.reset();
      if (other_ && other_->t_ns && !limits_.contain(*other_->t_ns)) other_.reset();
    }
  }

  /// Returns the camera with the earliest next packet; the first camera if times are equal.
  std::optional<std::size_t> nextCamera() {
    std::optional<std::size_t> first;
    std::int64_t first_ns = kEndOfTimeNs;
    for (std::size_t camera = 0; camera < parts_.cameras.size(); ++camera) {
      const std::int64_t t_ns = parts_.cameras[camera].nextTime().value_or(kEndOfTimeNs);
      if (t_ns >= first_ns) continue;
      first_ns = t_ns;
      first = camera;
    }
    return first;
  }

  std::optional<EventPacket> nextPacket() {
    const std::optional<std::size_t> next = nextCamera();
    if (!next) return std::nullopt;
    if (parts_.cameras[*next].isAtDamage()) {
      damaged_ = next;
      return std::nullopt;
    }
    if (first_ns_.empty()) {
      for (EventPackets& camera : parts_.cameras) {
        first_ns_.push_back(camera.nextTime().value_or(kEndOfTimeNs));
      }
    }
    EventPackets& stream = parts_.cameras[*next];
    packet_position_ = stream.stream().name();
    EventPacket packet{static_cast<int>(*next), stream.nextPacket()};
    if (nextCamera()) packet.complete_until_ns = stream.nextTime().value_or(kEndOfTimeNs);
    return packet;
  }

  JoinedParts parts_;
  TimeLimits limits_;
  std::unique_ptr<BadEvents> bad_;      // the cameras refer to it
  std::vector<std::int64_t> first_ns_;  // of each camera, known with the first packet
  std::size_t next_pose_ = 0;
  std::optional<EventPacket> packet_;   // the next packet
  std::optional<OtherSample> other_;    // the next object
  std::optional<std::size_t> damaged_;  // the camera whose damage ended the events
  std::string packet_position_;
  std::string position_ = "the recording";
};

}  // namespace

std::unique_ptr<Recording> join(JoinedParts parts, const TimeLimits& limits) {
  return std::make_unique<JoinedRecording>(std::move(parts), limits);
}

}  // namespace efm
