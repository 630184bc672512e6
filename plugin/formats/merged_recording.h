// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "mapping/geometry/rig.h"
#include "plugin/formats/event_text.h"
#include "plugin/recordings/recording.h"

namespace efm {

/// One event file per camera of a rig, as observations in the order of time.
///
/// The first packets are empty, one per camera: they announce the rig (see CObservationEvents).
/// Each further packet has the events of one camera in 10 ms. A packet covers its camera until the
/// camera's next event, and the camera's last packet covers it for ever (`kEndOfTimeNs`): nobody
/// waits for a silent camera. The very last packet has no such time: there the recording ends. If a
/// file has a wrong line, all events before it come before the error.
class MergedRecording : public Recording {
 public:
  /// @param readers one per camera of the rig.
  /// @throws std::runtime_error if no camera has an event; the readers' errors.
  MergedRecording(Rig rig, std::vector<EventTextReader> readers);

  mrpt::obs::CObservation::Ptr next() override;
  std::string position() const override { return position_; }
  double progress() const override;
  RecordingCounts counts() const override;

 private:
  std::optional<std::size_t> nextCamera();
  mrpt::obs::CObservation::Ptr packetOf(std::size_t camera, std::int64_t t_ns,
                                        std::vector<Event> events);

  Rig rig_;
  std::vector<EventTextReader> readers_;  // per camera
  std::string position_ = "the recording";
  std::size_t announced_ = 0;  // number of empty packets so far
};

}  // namespace efm
