// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "mapping/keyframes/fusion_mapper.h"
#include "plugin/recordings/streams/sample.h"
#include "plugin/session/event_fusion_options.h"

namespace efm {

/// Assembles the rig as its cameras appear, in any order: packets of a camera wait until all
/// cameras of lower indices are there. Gives cameras the calibration and the time offset of the
/// options.
class RigAssembly {
 public:
  explicit RigAssembly(const EventFusionOptions& options);

  /// Adds all cameras of the options' calibration to the mapper, in live operation and if the
  /// calibration has the sizes of the sensors. Then no camera has to wait for another one.
  void declare(FusionMapper& mapper);
  /// Adds the packet's camera to the mapper if it is the next one, and then each camera that waited
  /// for it.
  /// @return the packets of known cameras, in the order to feed them; empty while this one waits.
  /// @throws std::invalid_argument if the packet contradicts the options' calibration or its
  /// camera's first packet, the rig is complete without its camera, or the packet has waited for
  /// another camera for more than a second of events.
  std::vector<EventPacket> add(EventPacket packet, FusionMapper& mapper);

  /// @throws std::invalid_argument if the options name a camera that the rig does not have, or
  /// their calibration or time offsets have another number of cameras.
  void requireOptionsFit() const;
  /// Returns whether the rig is complete with a packet that begins at this time, on the clock of
  /// the poses. It is complete more than a second after the recording's first event, for any length
  /// of packets. It is complete at once if there are poses and all cameras are known. They are
  /// known from the options, from a packet that has their number, or if the recording starts with
  /// one empty packet per camera whose `covered_until_ns` is the time of the first event.
  bool isReady(std::int64_t begin_ns, bool has_poses);
  /// Completes the rig: a new camera is an error from now on.
  void complete() { complete_ = true; }
  bool isComplete() const { return complete_; }

  /// Begins a new clock after a reset: the first event is still to come.
  void beginClock() { first_ns_ = newest_begin_ns_ = std::nullopt; }

  /// Returns the number of events in the waiting packets, by camera.
  std::map<int, std::uint64_t> waitingEvents() const;
  /// @throws std::invalid_argument if a camera waits for a camera that never came.
  void requireNoneWaits() const;

  /// Returns the content of the files that the options name.
  const RigSetup& setup() const { return setup_; }

 private:
  bool isKnown() const;
  void applyOptions(EventPacket& packet);
  void noteAnnouncement(const EventPacket& packet);
  void addCamera(const RigCamera& camera, FusionMapper& mapper);
  void letWait(EventPacket packet);
  [[noreturn]] void rejectWithoutNext(int camera) const;
  void requireIncomplete(int camera) const;

  std::vector<int> selected_cameras_;
  int reference_camera_;
  bool declares_;
  std::vector<std::int64_t> time_offsets_ns_;
  RigSetup setup_;

  int num_cameras_ = 0;
  std::optional<std::int64_t> first_ns_, newest_begin_ns_;  // begins of packets with events
  bool complete_ = false;
  std::map<int, std::int64_t> announced_ns_;  // end of each camera's empty packets
  int stated_cameras_ = 0;                    // number that a packet has
  std::optional<bool> announced_;  // true if all cameras were announced; set at the first event
  std::map<int, std::vector<EventPacket>> waiting_;  // by camera
  std::optional<std::int64_t> waiting_since_ns_;     // begin of the first waiting event
};

}  // namespace efm
