// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "mapping/keyframes/fusion_mapper.h"
#include "plugin/session/event_fusion_options.h"
#include "plugin/session/sample.h"

namespace efm {

/// Puts the rig together as its cameras appear in any order: packets of a camera wait until all
/// cameras of lower indices are there. Gives cameras the calibration and the time offset of the
/// options.
class RigAssembly {
 public:
  explicit RigAssembly(const EventFusionOptions& options);

  /// Live operation: adds all cameras of the options' calibration to the mapper, if it has their
  /// sizes. Then none is waited for, and each may begin at any time.
  void declare(FusionMapper& mapper);
  /// Adds the packet's camera to the mapper if it is the next one, and then each camera that waited
  /// for it.
  /// @return the packets of known cameras, in the order to feed them; none while this one waits.
  /// @throws std::invalid_argument if the packet contradicts the options' calibration or its
  /// camera's first packet, the rig is complete without its camera, or it has waited for a camera
  /// for more than a second of events.
  std::vector<EventPacket> add(EventPacket packet, FusionMapper& mapper);

  /// @throws std::invalid_argument where the options name a camera that the rig does not have, or
  /// its calibration or time offsets have another number of cameras.
  void requireOptionsFit() const;
  /// Returns whether the rig is complete with a packet that begins at this time, on the clock of
  /// the poses: over a second after the recording's first event, whatever the length of packets; or
  /// at once if there are poses and all cameras are known. They are known from the options, or if
  /// the recording starts with one empty packet per camera whose `covered_until_ns` is the time of
  /// the first event.
  bool isReady(std::int64_t begin_ns, bool has_poses);
  /// From now on a new camera is an error.
  void complete() { complete_ = true; }
  bool isComplete() const { return complete_; }

  /// A clock went back: the first event is still to come.
  void beginClock() { first_ns_ = newest_begin_ns_ = std::nullopt; }

  /// The events in the packets that wait, by camera.
  std::map<int, std::uint64_t> waitingEvents() const;
  /// @throws std::invalid_argument where a camera waits for one that never came.
  void requireNoneWaits() const;

  /// The files of the options.
  const RigSetup& setup() const { return setup_; }
  /// The number of cameras whose recorded calibration differs from the options'.
  std::size_t recalibratedCameras() const { return recalibrated_.size(); }

 private:
  bool isKnown() const;
  void applyOptions(EventPacket& packet);
  void noteAnnouncement(const EventPacket& packet);
  void addCamera(const RigCamera& camera, FusionMapper& mapper);
  void letWait(EventPacket packet);
  [[noreturn]] void refuseWithoutNext(int camera) const;
  void requireIncomplete(int camera) const;

  std::vector<int> selected_cameras_;
  int reference_camera_;
  bool declares_;
  std::vector<std::int64_t> time_offsets_ns_;
  RigSetup setup_;

  int num_cameras_ = 0;
  std::optional<std::int64_t> first_ns_, newest_begin_ns_;  // of packets with events
  bool complete_ = false;
  std::map<int, std::int64_t> announced_ns_;  // the end of each camera's empty packets
  std::optional<bool> announced_;             // all cameras; known from the first event on
  std::set<int> recalibrated_;
  std::map<int, std::vector<EventPacket>> waiting_;  // by camera
  std::optional<std::int64_t> waiting_since_ns_;     // begin of their first event
};

}  // namespace efm
