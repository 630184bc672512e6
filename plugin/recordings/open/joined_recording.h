// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "mapping/events/window.h"
#include "plugin/recordings/streams/event_packets.h"
#include "plugin/recordings/streams/recording_parts.h"
#include "plugin/recordings/streams/sample.h"

namespace efm {

/// The parts that `join` puts together.
struct JoinedParts {
  Rig rig;                            ///< The cameras of the packets.
  std::vector<EventPackets> cameras;  ///< One per camera of the rig.
  bool recalibrated = false;          ///< See `RecordingCounts`.
  std::vector<int> of_calibration;    ///< As `recalibrated`.
  std::vector<PoseSample> poses;      ///< The poses in any order; equal times keep theirs.
  std::string poses_damage;  ///< The error that ended the poses: thrown at the recording's end.
  std::unique_ptr<OtherStream> others;  ///< Other objects; may be null.
  bool all_poses = false;       ///< True if poses outside the interval are kept, for a mapping.
  bool only_poses = false;      ///< True if the events are not read.
  std::int64_t latency_ns = 0;  ///< Delay of each pose after its time.
  /// The maximum number of bad events that are left out, of all cameras together. One more is an
  /// error.
  std::uint64_t skip_bad_events = 0;
  std::vector<Warning> warnings;  ///< Warnings that come first in `RecordingCounts`.
  std::vector<Warning> notes;     ///< The others go to `RecordingCounts` as they are.
  std::vector<RecordedTopic> topics;
  std::vector<RecordedTransform> transforms;
};

/// Puts the parts in the order of time. For limits [t0, t1) on the clock of the poses, it keeps the
/// events and poses inside, and the nearest pose of each source before and after, so that events
/// have poses on both sides. Most events outside are not read if their format has an index.
///
/// Each packet has the events of one camera in a period. After a packet, its camera is complete
/// until the camera's next event. After the camera's last packet, it is complete for ever
/// (`kEndOfTimeNs`), so nobody waits for a silent camera. The last packet of the recording has no
/// such time. If a stream has a wrong event, all samples before the event come before the error.
/// @throws std::runtime_error if there are cameras and no limits, and no camera has an event.
std::unique_ptr<Recording> join(JoinedParts parts, const TimeLimits& limits);

}  // namespace efm
