// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "mapping/geometry/timestamp.h"
#include "plugin/mrpt/CObservationEvents.h"
#include "plugin/recordings/recording.h"
#include "plugin/session/pose_source_selector.h"

namespace efm {

/// A stretch of a recording, [t0, t1): the events in it, and the poses in it with the nearest one
/// of each source before and after, so that every event has a pose on both sides that had. Packets
/// without a time go by their events', other observations without one pass. Reads on until each
/// camera has passed t1, whose packets may come when they end, but no more than a second.
class TimeCut : public Recording {
 public:
  /// @param t0_ns, t1_ns no limit where not given.
  /// @throws std::invalid_argument where t1 is not after t0.
  TimeCut(std::unique_ptr<Recording> recording, std::optional<std::int64_t> t0_ns,
          std::optional<std::int64_t> t1_ns);

  /// @throws std::invalid_argument where a pose has no time.
  mrpt::obs::CObservation::Ptr next() override;
  std::string place() const override { return recording_->place(); }
  double progress() const override { return recording_->progress(); }
  RecordingCounts counts() const override { return recording_->counts(); }

 private:
  struct PoseTrack {
    mrpt::obs::CObservation::Ptr before;  // the newest before t0, until it is given
    bool ended = false;                   // the one after t1 was given
  };

  bool readOne();
  bool posesEnded() const;
  void takePose(const mrpt::obs::CObservation::Ptr& pose, PoseTrack& track, std::int64_t t_ns);
  void noteProgress(int camera, std::int64_t begin_ns, std::int64_t covered_until_ns);
  void takePacket(const CObservationEvents::Ptr& packet);
  void takeOther(const mrpt::obs::CObservation::Ptr& observation);
  void give(const mrpt::obs::CObservation::Ptr& observation);

  std::unique_ptr<Recording> recording_;
  std::int64_t t0_ns_;
  std::int64_t t1_ns_;
  bool began_ = false;  // something from t0 on was read
  std::map<PoseSourceId, PoseTrack> poses_;
  std::vector<mrpt::obs::CObservation::Ptr> across_;  // packets that t0 cuts, until it is given
  std::deque<mrpt::obs::CObservation::Ptr> ready_;
  std::map<int, bool> passed_t1_;             // per camera
  std::int64_t first_begin_ns_ = kMaxTimeNs;  // of packets
  bool events_ended_ = false;
};

/// The recording itself where no limit is given.
/// @throws std::invalid_argument as TimeCut does.
std::unique_ptr<Recording> cutTime(std::unique_ptr<Recording> recording,
                                   std::optional<std::int64_t> t0_ns,
                                   std::optional<std::int64_t> t1_ns);

}  // namespace efm
