// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/mrpt/rig_from_packets.h"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <stdexcept>
#include <utility>

#include "mapping/geometry/timestamp.h"
#include "plugin/engine/mapper_driver.h"

namespace efm {

RigFromPackets::RigFromPackets(const EventFusionOptions& options,
                               std::shared_ptr<MapperDriver> mapper)
    : options_(options), mapper_(std::move(mapper)) {
  const std::optional<Calibration>& given = mapper_->setup().calibration;
  if (!options.live.enabled || !given) return;
  const std::vector<RigCamera>& cameras = given->rig.cameras;
  const auto has_size = [](const RigCamera& camera) { return camera.model.width > 0; };
  if (!std::all_of(cameras.begin(), cameras.end(), has_size)) return;
  mapper_->addCameras(given->rig);
  num_cameras_ = static_cast<int>(cameras.size());
}

void RigFromPackets::add(const CObservationEvents& packet, bool maps) {
  Packet next{packet.camera_index, packet.events, packet.covered_until_ns, maps};
  {
    const std::lock_guard<std::recursive_mutex> lock(mutex_);
    check(packet);
    if (num_cameras_ == 0) {
      requirePossible(next.events, next.camera, cameras_.at(next.camera));
      waiting_events_ += next.events.size();
      waiting_.push_back(std::move(next));
      if (completes(packet)) complete();
      return;
    }
  }
  give(std::move(next));
}

/// Checks a packet's calibration, and notes that of a new camera.
void RigFromPackets::check(const CObservationEvents& packet) {
  const int camera = packet.camera_index;
  if (camera < 0) {
    throw std::invalid_argument(fmt::format("camera {}: must be 0 or above", camera));
  }
  RigCamera calibration = calibrationOf(packet);
  if (const auto& given = mapper_->setup().calibration) {
    calibration = given->camera(static_cast<std::size_t>(camera), knownSize(calibration.model));
  }
  requireCalibrated(camera, calibration.model);
  const auto known = cameras_.find(camera);
  if (known != cameras_.end() && !isSame(known->second, calibration)) {
    throw std::invalid_argument(
        fmt::format("camera {}: its calibration or its pose on the rig differs from that of its "
                    "first packet",
                    camera));
  }
  if (num_cameras_ > 0 && camera >= num_cameras_) {
    if (known != cameras_.end()) rejectWithoutNext(camera);
    throw std::invalid_argument(fmt::format(
        "camera {} first appears when the rig is complete: all cameras must be there within a "
        "second of the first event, in live operation also before the queue is half full",
        camera));
  }
  if (known == cameras_.end()) calibration.validate();
  cameras_.emplace(camera, std::move(calibration));
}

/// Returns whether the rig is complete with a packet.
bool RigFromPackets::completes(const CObservationEvents& packet) {
  constexpr std::int64_t kCompletesNs = kNanosecondsPerSecond;
  const int camera = packet.camera_index;
  if (packet.events.empty()) {
    if (packet.covered_until_ns) declared_ns_[camera] = *packet.covered_until_ns;
    return false;
  }
  const std::int64_t t_ns = packet.events.front().t_ns;
  const std::size_t count = cameras_.size();
  if (!is_declared_) {
    const auto declared = declared_ns_.find(camera);
    is_declared_ =
        declared != declared_ns_.end() && declared->second == t_ns && declared_ns_.size() == count;
  }
  const std::vector<std::int64_t>& offsets_ns = options_.rig.time_offsets_ns;
  const auto index = static_cast<std::size_t>(camera);
  const std::int64_t begin_ns = trajectoryTime(
      t_ns, index < offsets_ns.size() ? offsets_ns[index] : cameras_.at(camera).time_offset_ns);
  first_ns_ = std::min(first_ns_.value_or(begin_ns), begin_ns);
  newest_begin_ns_ = std::max(newest_begin_ns_.value_or(begin_ns), begin_ns);
  const auto& given = mapper_->setup().calibration;
  const bool is_known =
      *is_declared_ || offsets_ns.size() == count || (given && given->rig.cameras.size() == count);
  const bool has_no_gap = cameras_.rbegin()->first + 1 == static_cast<int>(count);
  return (is_known && has_no_gap) || *newest_begin_ns_ - *first_ns_ > kCompletesNs ||
         (options_.live.enabled &&
          static_cast<double>(waiting_events_) > options_.live.queueEvents() / 2);
}

/// Completes the rig with the cameras up to the first gap, and gives the waiting packets.
void RigFromPackets::complete() {
  std::vector<Packet> packets = std::exchange(waiting_, {});
  waiting_events_ = 0;
  Rig rig;
  for (const auto& [index, camera] : cameras_) {
    if (index == static_cast<int>(rig.cameras.size())) rig.cameras.push_back(camera);
  }
  if (rig.cameras.empty()) rejectWithoutNext(cameras_.begin()->first);
  mapper_->addCameras(rig);
  num_cameras_ = static_cast<int>(rig.cameras.size());
  std::exception_ptr error;
  for (Packet& packet : packets) {
    try {
      if (packet.camera >= num_cameras_) rejectWithoutNext(packet.camera);
      give(std::move(packet));
    } catch (...) {  // the other packets are used all the same
      if (!error) error = std::current_exception();
    }
  }
  if (error) std::rethrow_exception(error);
}

void RigFromPackets::give(Packet packet) {
  if (!packet.maps) return mapper_->skip(packet.camera, packet.events);
  mapper_->addEvents(packet.camera, std::move(packet.events), packet.complete_until_ns);
}

void RigFromPackets::finish() {
  const std::lock_guard<std::recursive_mutex> lock(mutex_);
  if (num_cameras_ == 0 && !cameras_.empty()) complete();
}

void RigFromPackets::rejectWithoutNext(int camera) const {
  throw std::invalid_argument(fmt::format(
      "the recording has events of camera {} but none of camera {}", camera, num_cameras_));
}

}  // namespace efm
