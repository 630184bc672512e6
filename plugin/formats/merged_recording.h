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
/// An empty packet of each camera comes before the first events, so that the whole rig is known.
/// Every other packet holds the events of one camera in an interval of 10 ms. A packet is covered
/// until the camera's next event; the last packet of a camera is covered for all time
/// (`kEndOfTimeNs`). So the mapping does not wait for a silent camera. The last packet of the
/// recording does not say what it covers, because the recording ends there. If a file cannot be
/// read any further, the error comes after the packets before it.
class MergedRecording : public Recording {
 public:
  /// @param readers one per camera of the rig.
  /// @throws std::runtime_error if no camera has an event, and the errors of the readers.
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
  std::size_t announced_ = 0;  // cameras whose empty packet was returned
};

}  // namespace efm
