// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <tuple>
#include <variant>
#include <vector>

#include "mapping/base/text.h"
#include "mapping/events/event.h"
#include "mapping/geometry/rig.h"
#include "mapping/geometry/timestamp.h"
#include "mapping/geometry/trajectory.h"

namespace efm {

/// Kinds of pose sources, the best first.
enum class PoseKind {
  kPose,      ///< Poses in the world.
  kOdometry,  ///< Wheel odometry in the plane; it drifts.
  kActions,   ///< Composed movements; they drift.
};

/// Source of poses: its kind, and the label of its sensor.
struct PoseSourceId {
  PoseKind kind = PoseKind::kPose;
  std::string label;

  friend bool operator<(const PoseSourceId& a, const PoseSourceId& b) {
    return std::tie(a.kind, a.label) < std::tie(b.kind, b.label);
  }
  friend bool operator==(const PoseSourceId& a, const PoseSourceId& b) {
    return a.kind == b.kind && a.label == b.label;
  }
};

/// Returns "odometry 'wheels'", for messages.
std::string asText(const PoseSourceId& source);

/// Events of one camera in an interval of time.
struct EventPacket {
  int camera = 0;  ///< Index in the rig.
  CheckedEvents events;
  /// The camera's events before this time (its own clock) are complete: in this packet or in
  /// earlier packets. So an empty packet with this time says that there was no event.
  std::optional<std::int64_t> complete_until_ns = std::nullopt;
};

/// What a recording tells of a camera beside its calibration.
struct RecordedCamera {
  std::string label;  ///< Name of the sensor.
  /// Time of the first event; kEndOfTimeNs if there is none. Known with the first packet.
  std::int64_t first_ns = kEndOfTimeNs;
  /// The camera's first packet in the rawlog (a CObservationEvents); null for other formats.
  std::shared_ptr<const void> original = nullptr;
};

/// A pose of a tracker.
struct PoseSample {
  PoseSourceId source;
  std::int64_t t_ns = 0;
  Rigid3 T_world_body;
  Rigid3 T_body_rig;  ///< The pose of the rig on the tracked body.
  /// Standard deviations that the tracker states.
  std::optional<PoseNoise> noise = std::nullopt;
  std::shared_ptr<const void> original =
      nullptr;  ///< The observation in the rawlog; null: not kept.

  /// Returns the pose of the rig, see `roundedPose`.
  Rigid3 T_world_rig() const;
};

/// Any other content of a rawlog.
struct OtherSample {
  std::string type;                  ///< Name of its class.
  std::optional<std::int64_t> t_ns;  ///< std::nullopt if the observation has no time.
  std::shared_ptr<const void> original;
};

/// Returns the time of an event on the clock of the poses. The arguments may be unchecked: they are
/// limited to kEndOfTimeNs, so that their sum and differences of results do not overflow.
std::int64_t trajectoryTime(std::int64_t t_ns, std::int64_t time_offset_ns);

using Sample = std::variant<EventPacket, PoseSample, OtherSample>;

/// Tick of the poses' times: each pose gets the nearest tick of 100 ns, the resolution of MRPT's
/// clock. At 300 px/s this is an error of 1.5e-5 px.
inline constexpr std::int64_t kTickNs = 100;
/// Ticks of MRPT's clock, which counts from 1601, at the Unix epoch. The recording's clock is taken
/// as Unix time.
inline constexpr std::int64_t kMrptTicksAtUnixEpoch = 116'444'736'000'000'000;
std::int64_t nearestTick(std::int64_t t_ns);
/// Returns a pose with a rounded rotation: three components of its quaternion are multiples of
/// 2^-40 (1e-12 rad), the fourth one follows from them. A rotation that became a matrix and a
/// quaternion again, as in MRPT's classes and NumPy, differs in its last digits; rounded, it is the
/// same. So a recording gives the same map, bit for bit, as text, as a rawlog and through a host.
Rigid3 roundedPose(const Rigid3& T_a_b);
/// Returns the pose of a rig on its body with a rounded translation, too (multiples of 2^-40 m): it
/// is the same after it was inverted and inverted again.
Rigid3 roundedMount(const Rigid3& T_body_rig);

/// A topic of a bag. Its messages were recorded between two times: those of the bag's chunks.
struct RecordedTopic {
  std::string name;  ///< "/davis/left/events"
  std::string type;  ///< "dvs_msgs/EventArray", also if ROS 2 has "dvs_msgs/msg/EventArray".
  std::uint64_t messages = 0;  ///< 0: the index does not have their number.
  std::int64_t from_ns = kEndOfTimeNs, until_ns = -kEndOfTimeNs;

  void add(std::uint64_t more, std::int64_t more_from_ns, std::int64_t more_until_ns) {
    messages += more;
    from_ns = std::min(from_ns, more_from_ns);
    until_ns = std::max(until_ns, more_until_ns);
  }
};

/// The transforms between two frames of a bag: /tf and /tf_static.
struct RecordedTransform {
  std::string parent, child;
  bool moves = false;
  std::uint64_t count = 0;
};

/// Counts of irregular data in a recording that could be read.
struct RecordingCounts {
  std::uint64_t sorted_events = 0;   ///< Events that came up to 10 ms after a newer event.
  std::uint64_t lost_packets = 0;    ///< Missing packets, from the recording's packet numbers.
  std::uint64_t undated_events = 0;  ///< Events left out: see `EventStream::undatedEvents`.
  std::uint64_t skipped_events = 0;  ///< Bad events, left out: see `BadEvents`.
  std::string first_skipped;         ///< Error of the first skipped event.
  std::vector<Warning> warnings;     ///< Warnings of the readers: see `EventStream::warnings`.
  std::vector<Warning> notes;        ///< Notes of the readers, for example of replaced transforms.
  bool recalibrated = false;  ///< A given calibration replaced another one, the recording's own.
  /// The cameras of a given calibration that the recording has, if the calibration has more.
  std::vector<int> of_calibration;
  std::vector<RecordedTopic> topics;          ///< Topics of a bag, if they were asked for.
  std::vector<RecordedTransform> transforms;  ///< As `topics`.
  /// Times of the events nearest to the time limits of reading, on the clock of the poses.
  std::optional<std::int64_t> nearest_before_ns, nearest_after_ns;
};

/// Recording as a stream of samples in the order of time. A pose comes before the packets that
/// begin at its time or later.
class Recording {
 public:
  virtual ~Recording() = default;

  /// @return the next sample; std::nullopt at the end.
  /// @throws std::runtime_error once at damage, after the samples before it.
  std::optional<Sample> next() {
    std::optional<Sample> sample = read();
    const std::string damage = sample || thrown_ ? std::string() : this->damage();
    if (damage.empty()) return sample;
    thrown_ = true;
    throw std::runtime_error(damage);
  }
  /// @return the next sample; std::nullopt at the end, and at damage.
  virtual std::optional<Sample> read() = 0;
  /// Returns the damage that ended the recording; empty if there is none.
  virtual std::string damage() const { return {}; }

  /// Returns the cameras of the packets, with given files and offsets applied. It never changes.
  virtual const Rig& rig() const = 0;
  /// Returns one for each camera of the rig.
  virtual std::vector<RecordedCamera> cameras() const = 0;

  /// Returns the position of the last sample that `next` returned: "cam0/events.txt".
  virtual std::string position() const = 0;

  /// Returns the fraction of the input that was read, 0 to 1.
  virtual double progress() const = 0;

  virtual RecordingCounts counts() const { return {}; }

 private:
  bool thrown_ = false;
};

}  // namespace efm
