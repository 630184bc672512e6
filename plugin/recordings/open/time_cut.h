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
#include "plugin/recordings/open/merged_recording.h"
#include "plugin/session/pose_source_selector.h"

namespace efm {

/// An interval [t0, t1) of a recording: its events, its poses, and of each source the nearest pose
/// before and after, so that events keep poses on both sides. A packet without a time has the time
/// of its first event; other observations without a time pass. At t1 it reads further until each
/// camera has passed t1, but at most for a second: a packet may come only when it ends. Empty
/// packets that announce the rig announce it before the first event of the interval.
class TimeCut : public Recording {
 public:
  /// @param t0_ns, t1_ns nothing: no limit.
  TimeCut(std::unique_ptr<Recording> recording, std::optional<std::int64_t> t0_ns,
          std::optional<std::int64_t> t1_ns);

  /// @throws std::invalid_argument where a pose has no time.
  mrpt::obs::CObservation::Ptr next() override;
  std::string position() const override { return recording_->position(); }
  double progress() const override { return recording_->progress(); }
  RecordingCounts counts() const override { return recording_->counts(); }

 private:
  struct PoseTrack {
    mrpt::obs::CObservation::Ptr before;  // the newest before t0, until delivered
    bool ended = false;                   // the first one from t1 on was delivered
  };

  bool readOne();
  bool posesEnded() const;
  void addPose(const mrpt::obs::CObservation::Ptr& pose, PoseTrack& track, std::int64_t t_ns);
  void noteProgress(int camera, std::int64_t begin_ns, std::int64_t covered_until_ns);
  void addPacket(const CObservationEvents::Ptr& packet);
  void addOther(const mrpt::obs::CObservation::Ptr& observation);
  void deliver(const mrpt::obs::CObservation::Ptr& observation);
  void announceBefore(const CObservationEvents& first);

  std::unique_ptr<Recording> recording_;
  std::int64_t t0_ns_;
  std::int64_t t1_ns_;
  bool began_ = false;  // an observation from t0 on was read
  std::map<PoseSourceId, PoseTrack> poses_;
  std::vector<mrpt::obs::CObservation::Ptr> across_;  // packets that t0 cuts, until delivered
  std::deque<mrpt::obs::CObservation::Ptr> ready_;
  /// Per camera, the empty packets before the first event, until delivered.
  std::map<int, CObservationEvents::Ptr> announcements_;
  bool has_events_ = false;                   // one was read
  std::map<int, bool> passed_t1_;             // per camera
  std::int64_t first_begin_ns_ = kMaxTimeNs;  // of packets
  bool events_ended_ = false;
};

/// The recording itself where there is no limit.
std::unique_ptr<Recording> cutTime(std::unique_ptr<Recording> recording,
                                   std::optional<std::int64_t> t0_ns,
                                   std::optional<std::int64_t> t1_ns);

}  // namespace efm
