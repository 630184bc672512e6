// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "mapping/base/text.h"
#include "mapping/events/event.h"
#include "mapping/geometry/rig.h"
#include "mapping/geometry/trajectory.h"
#include "plugin/session/pose_source_selector.h"

namespace efm {

/// The events of one camera in an interval of time.
struct EventPacket {
  int camera = 0;         ///< Index in the rig.
  RigCamera calibration;  ///< The same in all packets of a camera; the options may replace it.
  std::vector<Event> events;
  /// All events of the camera before this time (its own clock) are in this packet or earlier ones.
  /// So an empty packet with this time says that there was no event.
  std::optional<std::int64_t> covered_until_ns = std::nullopt;
  std::optional<std::int64_t> t_ns =
      std::nullopt;  ///< Of the first event; an empty packet has its own.
  /// EventPackets has checked the events: they lie inside the sensor, in the order of time.
  bool checked = false;
  std::string label = {};  ///< The sensor's name; empty: not known.
  /// Set instead of events that the host leaves out: until this time of the camera's clock.
  std::optional<std::int64_t> skipped_until_ns = std::nullopt;
  /// The camera's first packet in the rawlog (a CObservationEvents); null for other formats.
  std::shared_ptr<const void> original = nullptr;
};

/// A pose of a tracker: T_world_rig = T_world_body * T_body_rig.
struct PoseSample {
  PoseSourceId source;
  std::int64_t t_ns = 0;
  Rigid3 T_world_body;
  Rigid3 T_body_rig;  ///< The pose of the rig on the tracked body.
  /// The standard deviations that the tracker states.
  std::optional<PoseNoise> noise = std::nullopt;
  std::shared_ptr<const void> original =
      nullptr;  ///< The observation in the rawlog; null: not kept.
};

/// Anything else that a rawlog holds.
struct OtherSample {
  std::string type;                  ///< The name of its class.
  std::optional<std::int64_t> t_ns;  ///< std::nullopt if it has no time.
  std::shared_ptr<const void> original;
};

/// T_world_rig: with the options' T_body_rig if they have one.
inline Rigid3 rigPose(const PoseSample& pose, const std::optional<Rigid3>& T_body_rig) {
  return pose.T_world_body * T_body_rig.value_or(pose.T_body_rig);
}

/// The time of an event on the clock of the poses. Neither time is checked yet: both are limited to
/// kEndOfTimeNs, so that their sum and differences of such times do not overflow.
std::int64_t trajectoryTime(std::int64_t t_ns, std::int64_t time_offset_ns);

using Sample = std::variant<EventPacket, PoseSample, OtherSample>;

/// The time that a tracker's pose has in the mapping, however it comes: the nearest tick of 100 ns,
/// since MRPT's clock has these. At 300 px/s this is an error of 1.5e-5 px.
inline constexpr std::int64_t kTickNs = 100;
std::int64_t nearestTick(std::int64_t t_ns);
/// The pose that a host gives to the mapping after MRPT's classes held it: the rotation becomes a
/// matrix there, which changes the last digits. With it a recording gives the same map, bit for
/// bit, as text, as a rawlog and through a host.
Rigid3 roundedPose(const Rigid3& T_a_b);

/// Oddities of a recording that could be read.
struct RecordingCounts {
  std::uint64_t sorted_events = 0;  ///< Came up to 10 ms after a newer one.
  std::uint64_t lost_packets = 0;  ///< Missing in the numbers that the recording gives its packets.
  std::uint64_t undated_events = 0;  ///< Left out: see `EventStream::undatedEvents`.
  std::uint64_t skipped_events = 0;  ///< Bad ones, left out: see `BadEvents`.
  std::string first_skipped;         ///< The error of the first of them.
  std::vector<Warning> warnings;     ///< Of the readers: see `EventStream::warnings`.
  /// The events nearest to the time limits that were read, on the clock of the poses.
  std::optional<std::int64_t> nearest_before_ns, nearest_after_ns;
};

/// A recording as a stream of samples in the order of time. A pose comes before the packets that
/// begin at its time or later. The first packets are empty, one per camera: they announce the rig.
class Recording {
 public:
  virtual ~Recording() = default;

  /// @return the next sample; std::nullopt at the end.
  virtual std::optional<Sample> next() = 0;

  /// The cameras, as in the packets.
  virtual const Rig& rig() const = 0;

  /// The position of the last sample that `next` returned: "cam0/events.txt".
  virtual std::string position() const = 0;

  /// The fraction of the input that was read, 0 to 1.
  virtual double progress() const = 0;

  virtual RecordingCounts counts() const { return {}; }
};

}  // namespace efm
