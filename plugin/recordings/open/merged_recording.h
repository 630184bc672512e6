// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "mapping/geometry/rig.h"
#include "plugin/recordings/open/recording.h"
#include "plugin/recordings/streams/event_packets.h"

namespace efm {

/// The event streams of a rig's cameras, as observations in the order of time.
///
/// The first packets are empty, one per camera: they announce the rig (see CObservationEvents).
/// Each further packet has the events of one camera in a period. A packet covers its camera until
/// the camera's next event, and the camera's last packet covers it for ever (`kEndOfTimeNs`):
/// nobody waits for a silent camera. The very last packet has no such time: there the recording
/// ends. If a stream has a wrong event, all events before it come before the error.
class MergedRecording : public Recording {
 public:
  /// @param cameras one per camera of the rig; of none, there is no observation.
  /// @param skip_bad_events the number of bad events that are left out, of all cameras together; a
  /// further one is an error.
  MergedRecording(Rig rig, std::vector<EventPackets> cameras, std::uint64_t skip_bad_events = 0);

  /// Adds to the warnings of `counts`.
  void addWarnings(std::vector<Warning> warnings) { warnings_ = std::move(warnings); }

  /// @throws std::runtime_error if there are cameras and none has an event; the streams' errors.
  void requireEvents();

  mrpt::obs::CObservation::Ptr next() override;
  std::string position() const override { return position_; }
  double progress() const override;
  RecordingCounts counts() const override;

 private:
  std::optional<std::size_t> nextCamera();
  mrpt::obs::CObservation::Ptr packetOf(std::size_t camera, std::int64_t t_ns,
                                        std::vector<Event> events);

  Rig rig_;
  std::unique_ptr<BadEvents> bad_;     // the cameras refer to it
  std::vector<EventPackets> cameras_;  // per camera
  std::vector<Warning> warnings_;
  std::string position_ = "the recording";
  std::size_t announced_ = 0;  // number of empty packets so far
};

}  // namespace efm
