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
/// When the first events come, an empty packet of each camera goes before them, so that the whole
/// rig is known. Then a packet holds what its camera saw in a stretch of 10 ms. A packet is covered
/// until its camera's next event, a camera's last one for good (`kEndOfTimeNs`): nobody waits for a
/// camera that sees nothing, and one without any event is known to be silent from the beginning.
/// The last packet of all is not covered: the recording ends there, it does not go on in silence.
/// Where a file cannot be read on, the error comes when all that was seen before was given.
class MergedRecording : public Recording {
 public:
  /// @param readers one per camera of the rig.
  /// @throws std::runtime_error where no camera has an event, and as the readers do.
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
  std::size_t announced_ = 0;  // cameras whose empty packet was given
};

}  // namespace efm
