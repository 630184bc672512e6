// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "event_fusion/engine.h"
#include "plugin/mrpt/CObservationEvents.h"
#include "plugin/session/event_fusion_options.h"

namespace efm {

/// Gives the packets of an MRPT host to a mapper. Each packet has its camera's calibration, and the
/// cameras appear one after another: the packets wait until the rig is complete.
///
/// If the options or the recording declare the cameras (see CObservationEvents), the rig is
/// complete with the first event; in live operation with a calibration in the options at once.
/// Otherwise it is complete when a packet begins more than a second after the first event, in live
/// operation also when the waiting events fill half of the queue. Thread-safe.
class RigFromPackets {
 public:
  /// @throws std::invalid_argument if the cameras of the options do not fit the other options.
  RigFromPackets(const EventFusionOptions& options, std::shared_ptr<MapperDriver> mapper);

  /// @param maps false if the events are not to be mapped.
  /// @throws std::invalid_argument if the packet contradicts its camera's first packet or the
  /// options, the rig is complete without its camera, or a camera of a lower index has no packet.
  void add(const CObservationEvents& packet, bool maps);
  /// Completes the rig, if cameras wait.
  void finish();

 private:
  struct Packet {
    int camera;
    std::vector<Event> events;
    std::optional<std::int64_t> complete_until_ns;
    bool maps;
  };

  void check(const CObservationEvents& packet);
  bool completes(const CObservationEvents& packet);
  void complete();
  void give(Packet packet);
  [[noreturn]] void rejectWithoutNext(int camera) const;

  const EventFusionOptions options_;
  const std::shared_ptr<MapperDriver> mapper_;
  std::recursive_mutex mutex_;  // guards the members below; a callback may add packets
  std::map<int, RigCamera> cameras_;
  std::map<int, std::int64_t> declared_ns_;  // end of each camera's empty packets
  std::optional<bool> is_declared_;          // set at the first event
  std::optional<std::int64_t> first_ns_, newest_begin_ns_;
  std::vector<Packet> waiting_;
  std::size_t waiting_events_ = 0;
  int num_cameras_ = 0;  // of the complete rig; 0 before
};

}  // namespace efm
