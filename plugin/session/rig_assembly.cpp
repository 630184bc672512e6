// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/rig_assembly.h"

#include <fmt/format.h>
#include <algorithm>

#include <iterator>
#include <stdexcept>
#include <utility>

#include "mapping/base/option.h"
#include "mapping/geometry/timestamp.h"
#include "plugin/recordings/calibration/calibration_file.h"
#include "plugin/session/health_checks.h"

namespace efm {
namespace {

OptionName timeOffsets() { return {"rig", "time_offsets_s", " (how many)"}; }

void requireSame(const RigCamera& first, const EventPacket& packet) {
  if (isSame(first, packet.calibration)) return;
  throw std::invalid_argument(
      fmt::format("camera {}: its calibration or its pose on the rig differs from that of its "
                  "first packet",
                  packet.camera));
}

}  // namespace

RigAssembly::RigAssembly(const EventFusionOptions& options)
    : selected_cameras_(options.mapper.cameras),
      reference_camera_(options.mapper.keyframe.reference_camera),
      declares_(options.live.enabled),
      time_offsets_ns_(options.rig.time_offsets_ns),
      setup_(readRigSetup(options.rig)) {}

void RigAssembly::declare(FusionMapper& mapper) {
  if (!declares_ || !setup_.calibration) return;
  const std::vector<RigCamera>& cameras = setup_.calibration->rig.cameras;
  const auto has_size = [](const RigCamera& camera) { return camera.model.width > 0; };
  if (!std::all_of(cameras.begin(), cameras.end(), has_size)) return;
  if (!time_offsets_ns_.empty()) setup_.calibration->requireCameras(time_offsets_ns_.size());
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    RigCamera camera = cameras[i];
    camera.T_rig_cam = roundedPose(camera.T_rig_cam);
    if (!time_offsets_ns_.empty()) camera.time_offset_ns = time_offsets_ns_[i];
    addCamera(camera, mapper);
  }
}

std::vector<EventPacket> RigAssembly::add(EventPacket packet, FusionMapper& mapper) {
  if (packet.camera < 0) {
    throw std::invalid_argument(fmt::format("camera {}: must be 0 or above", packet.camera));
  }
  applyOptions(packet);
  noteAnnouncement(packet);
  std::vector<EventPacket> ready;
  if (packet.camera > num_cameras_) {
    letWait(std::move(packet));
    return ready;
  }
  const bool is_new = packet.camera == num_cameras_;
  if (is_new) {
    requireIncomplete(packet.camera);
    addCamera(packet.calibration, mapper);
  } else {
    requireSame(mapper.rig().cameras[static_cast<std::size_t>(packet.camera)], packet);
  }
  ready.push_back(std::move(packet));
  if (!is_new) return ready;
  // All cameras are added before their packets, because a packet may complete the rig.
  for (auto next = waiting_.extract(num_cameras_); next; next = waiting_.extract(num_cameras_)) {
    addCamera(next.mapped().front().calibration, mapper);
    std::move(next.mapped().begin(), next.mapped().end(), std::back_inserter(ready));
  }
  return ready;
}

void RigAssembly::applyOptions(EventPacket& packet) {
  const auto camera = static_cast<std::size_t>(packet.camera);
  RigCamera& recorded = packet.calibration;
  if (setup_.calibration) recorded = setup_.calibration->camera(camera, knownSize(recorded.model));
  if (!isCalibrated(recorded.model)) {
    throw OptionHint(
        fmt::format("camera {} has no calibration: a map needs --calibration FILE ([rig] "
                    "calibration)",
                    camera),
        {{"rig", "calibration"}});
  }
  recorded.T_rig_cam = roundedPose(recorded.T_rig_cam);
  if (time_offsets_ns_.empty()) return;
  requireOption(camera < time_offsets_ns_.size(), timeOffsets(), time_offsets_ns_.size(),
                fmt::format("one per camera, and there is camera {}", camera));
  recorded.time_offset_ns = time_offsets_ns_[camera];
}

void RigAssembly::noteAnnouncement(const EventPacket& packet) {
  stated_cameras_ = std::max(stated_cameras_, packet.num_cameras);
  if (announced_) return;
  if (packet.events.empty()) {
    if (packet.covered_until_ns) announced_ns_[packet.camera] = *packet.covered_until_ns;
    return;
  }
  const auto announcement = announced_ns_.find(packet.camera);
  announced_ = announcement != announced_ns_.end() &&
               announcement->second == packet.events.front().t_ns &&
               announced_ns_.size() == static_cast<std::size_t>(num_cameras_);
}

bool RigAssembly::isReady(std::int64_t begin_ns, bool has_poses) {
  constexpr std::int64_t kCompletesNs = kNanosecondsPerSecond;
  first_ns_ = std::min(first_ns_.value_or(begin_ns), begin_ns);
  newest_begin_ns_ = std::max(newest_begin_ns_.value_or(begin_ns), begin_ns);
  return (has_poses && isKnown()) || *newest_begin_ns_ - *first_ns_ > kCompletesNs;
}

/// Returns whether all cameras are known.
bool RigAssembly::isKnown() const {
  const auto count = static_cast<std::size_t>(num_cameras_);
  if (!waiting_.empty() || count == 0) return false;
  return announced_.value_or(false) || stated_cameras_ == num_cameras_ ||
         time_offsets_ns_.size() == count ||
         (setup_.calibration && setup_.calibration->rig.cameras.size() == count);
}

void RigAssembly::addCamera(const RigCamera& camera, FusionMapper& mapper) {
  mapper.addCamera(camera);
  ++num_cameras_;
}

void RigAssembly::letWait(EventPacket packet) {
  constexpr std::int64_t kMaxWaitNs = kNanosecondsPerSecond;
  const int camera = packet.camera;
  if (complete_ && waiting_.count(camera) != 0) rejectWithoutNext(camera);
  requireIncomplete(camera);
  packet.calibration.validate();
  const auto waiting = waiting_.find(camera);
  if (waiting != waiting_.end()) requireSame(waiting->second.front().calibration, packet);
  if (!packet.events.empty()) {
    const std::int64_t first_ns =
        std::clamp(packet.events.front().t_ns, -kEndOfTimeNs, kEndOfTimeNs);  // not yet checked
    const std::int64_t begin_ns = first_ns + packet.calibration.time_offset_ns;
    if (!waiting_since_ns_) waiting_since_ns_ = begin_ns;
    if (begin_ns - *waiting_since_ns_ > kMaxWaitNs) rejectWithoutNext(camera);
  } else if (waiting != waiting_.end()) {
    return;  // the first packet has the calibration
  }
  waiting_[camera].push_back(std::move(packet));
}

void RigAssembly::rejectWithoutNext(int camera) const {
  throw std::invalid_argument(fmt::format(
      "the recording has events of camera {} but none of camera {}", camera, num_cameras_));
}

void RigAssembly::requireIncomplete(int camera) const {
  if (!complete_) return;
  throw std::invalid_argument(fmt::format(
      "camera {} first appears when the rig is complete: all cameras must be there within a second "
      "of the first event, in live operation also before the queue is half full",
      camera));
}

void RigAssembly::requireOptionsFit() const {
  const auto count = static_cast<std::size_t>(num_cameras_);
  const std::string expected = fmt::format("a camera of the recording: 0 to {}", num_cameras_ - 1);
  for (const int camera : selected_cameras_) {
    requireOption(camera < num_cameras_, OptionName("rig", "cameras"), camera, expected);
  }
  if (count == 0) return;
  requireOption(reference_camera_ < num_cameras_, OptionName("dsi", "reference_camera"),
                reference_camera_, expected);
  if (setup_.calibration) setup_.calibration->requireCameras(count);
  requireOption(time_offsets_ns_.empty() || time_offsets_ns_.size() == count, timeOffsets(),
                time_offsets_ns_.size(), fmt::format("one per camera of the recording: {}", count));
}

std::map<int, std::uint64_t> RigAssembly::waitingEvents() const {
  std::map<int, std::uint64_t> events;
  for (const auto& [camera, packets] : waiting_) {
    for (const EventPacket& packet : packets) events[camera] += packet.events.size();
  }
  return events;
}

void RigAssembly::requireNoneWaits() const {
  if (!waiting_.empty()) rejectWithoutNext(waiting_.begin()->first);
}

}  // namespace efm
