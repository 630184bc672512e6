// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "mapping/events/window.h"
#include "plugin/recordings/streams/event_packets.h"
#include "plugin/recordings/streams/recording_parts.h"
#include "plugin/session/sample.h"

namespace efm {

/// What a recording is put together from.
struct JoinedParts {
  Rig rig;                               ///< As the packets have it.
  std::vector<EventPackets> cameras;     ///< One per camera of the rig.
  std::vector<std::int64_t> offsets_ns;  ///< From a camera's clock to that of the poses.
  std::vector<PoseSample> poses;         ///< In any order; poses of equal time keep theirs.
  std::string poses_damage;  ///< The error that ended the poses: thrown at the recording's end.
  std::unique_ptr<OtherStream> others;  ///< May be null.
  bool all_poses = false;  ///< Poses outside the interval are kept, too: a mapping looks at those.
  std::int64_t latency_ns = 0;  ///< A pose comes this long after its time.
  /// The number of bad events that are left out, of all cameras together; a further one is an
  /// error.
  std::uint64_t skip_bad_events = 0;
  std::vector<Warning> warnings;  ///< The first of those in `RecordingCounts`.
};

/// Puts the parts in the order of time. Of an interval [t0, t1) on the clock of the poses, there
/// are its events, its poses, and of each source the nearest pose before and after, so that events
/// keep poses on both sides. Most events outside are not read, if their format has an index.
///
/// The first packets are empty, one per camera. Each further packet has the events of one camera in
/// a period. A packet covers its camera until the camera's next event, and the camera's last packet
/// covers it for ever (`kEndOfTimeNs`): nobody waits for a silent camera. The very last packet has
/// no such time: there the recording ends. If a stream has a wrong event, all samples before it
/// come before the error.
/// @throws std::runtime_error if there are cameras and no limits, and none has an event.
std::unique_ptr<Recording> join(JoinedParts parts, const TimeLimits& limits);

}  // namespace efm
