// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/formats/merged_recording.h"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

#include "mapping/options/option_check.h"
#include "plugin/mrpt/CObservationEvents.h"
#include "plugin/mrpt/mrpt_pose.h"
#include "plugin/mrpt/mrpt_time.h"

namespace efm {
MergedRecording::MergedRecording(Rig rig, std::vector<EventTextReader> readers)
    : rig_(std::move(rig)), readers_(std::move(readers)) {
  requireOption(!readers_.empty() && readers_.size() == rig_.cameras.size(), "readers",
                readers_.size(), "one per camera, at least one");
  if (!nextCamera()) {
    std::string files;
    for (const EventTextReader& reader : readers_) {
      files += (files.empty() ? "" : ", ") + reader.file().string();
    }
    throw std::runtime_error(files + ": no events: expected at least one line t x y p");
  }
}

mrpt::obs::CObservation::Ptr MergedRecording::next() {
  const std::optional<std::size_t> camera = nextCamera();
  if (!camera) return nullptr;
  position_ = readers_[*camera].file().string();
  const std::int64_t t_ns = *readers_[*camera].nextTime();
  if (announced_ < readers_.size()) return packetOf(announced_++, t_ns, {});
  return packetOf(*camera, t_ns, readers_[*camera].nextPacket());
}

/// The camera with the earliest next packet; of several the first one.
std::optional<std::size_t> MergedRecording::nextCamera() {
  std::optional<std::size_t> first;
  std::int64_t first_ns = kEndOfTimeNs;
  for (std::size_t camera = 0; camera < readers_.size(); ++camera) {
    const std::int64_t t_ns = readers_[camera].nextTime().value_or(kEndOfTimeNs);
    if (t_ns >= first_ns) continue;
    first_ns = t_ns;
    first = camera;
  }
  return first;
}

mrpt::obs::CObservation::Ptr MergedRecording::packetOf(std::size_t camera, std::int64_t t_ns,
                                                       std::vector<Event> events) {
  auto packet = CObservationEvents::Create();
  packet->sensorLabel = "cam" + std::to_string(camera);
  packet->timestamp = mrptTimeFrom(t_ns);
  packet->camera_index = static_cast<int>(camera);
  packet->camera = rig_.cameras[camera].model;
  packet->camera_pose = mrptPoseFrom(rig_.cameras[camera].T_rig_cam);
  packet->events = std::move(events);
  if (nextCamera()) {
    packet->covered_until_ns = readers_[camera].nextTime().value_or(kEndOfTimeNs);
  }
  return packet;
}

double MergedRecording::progress() const {
  std::uint64_t read = 0;
  std::uint64_t total = 0;
  for (const EventTextReader& reader : readers_) {
    read += reader.bytesRead();
    total += reader.bytesTotal();
  }
  return total > 0 ? std::min(1.0, static_cast<double>(read) / static_cast<double>(total)) : 0.0;
}

RecordingCounts MergedRecording::counts() const {
  RecordingCounts counts;
  for (const EventTextReader& reader : readers_) counts.sorted_events += reader.sortedEvents();
  return counts;
}

}  // namespace efm
