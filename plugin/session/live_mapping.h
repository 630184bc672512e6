// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <condition_variable>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <opencv2/core.hpp>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "plugin/session/hosted_mapping.h"
#include "plugin/session/input_queue.h"
#include "plugin/session/mapping_session.h"

namespace efm {

/// Maps in a thread of its own, for live operation. Adding input never waits for the mapping, and
/// results are snapshots: nothing here waits for a sweep but `finish` and the destructor, which
/// waits for the current one.
///
/// A snapshot of the map is renewed after each keyframe, as long as this takes at most a twentieth
/// of the time; the state is always renewed. Where the mapping falls behind until the input that
/// waits is as large as the queue may be, it gives up the oldest windows.
///
/// An error of the mapping, the refinement or a callback is counted and logged; its window is given
/// up and the next one is tried.
class LiveMapping : public HostedMapping, public std::enable_shared_from_this<LiveMapping> {
 public:
  /// @param earlier keyframes of an initial map.
  LiveMapping(const EventFusionOptions& options, std::vector<StoredKeyframe> earlier,
              Callbacks callbacks);
  /// Ends without mapping the rest.
  ~LiveMapping() override;
  LiveMapping(const LiveMapping&) = delete;
  LiveMapping& operator=(const LiveMapping&) = delete;

  /// The same, waiting for the current keyframe. One thread at a time. Within a callback it does
  /// not wait: the mapping's thread ends, and this object with it, once the callback returns.
  void stop() override;
  bool mayStopHere() const override { return !runsHere(); }

  void addEvents(EventPacket packet) override { queue_.add(std::move(packet)); }
  void skipEvents(const EventPacket& packet) override { queue_.skip(packet); }
  void addPose(const QueuedPose& pose) override { queue_.add(pose); }
  /// Maps the rest of the input and waits for it.
  /// @throws std::logic_error in the mapping's own thread; the error of the rig: a camera or an
  /// option that does not fit.
  void finish() override;

  void setSink(DsiSink* sink) override;
  void setClock(ProcessorClock clock) override;

  std::optional<Rigid3> T_body_rig() const override { return T_body_rig_; }
  SessionStatus status() const override;
  MapCloud::ConstPtr points() override { return snapshot()->points; }
  KeyframePoses keyframePoses() override;
  std::vector<StoredKeyframe> keyframes() override { return snapshot()->keyframes; }
  std::size_t numKeyframes() const override { return snapshot()->keyframes.size(); }
  /// Never null.
  std::shared_ptr<const MapSnapshot> snapshot() const override;
  std::pair<cv::Mat1f, DepthPlanesOptions> newestDepth() const override;

 private:
  bool runsHere() const { return std::this_thread::get_id() == thread_.get_id(); }
  void run();
  bool runOnce();
  bool feed(InputQueue::Batch batch);
  void chooseBefore(const InputQueue::Batch& batch);
  bool mapNext();
  void giveUpExcess();
  void keep(StoredKeyframe keyframe);
  void forgetOldest();
  void publishState();
  void publishMap(bool at_once);
  /// Of the mapping; of a host's callback; of input, which is refused.
  enum class Fault { kMapping, kCallback, kInput };
  template <typename Call>
  void callBack(const char* name, Call call);
  void warn(const std::string& text);
  void noteError(const char* doing, Fault fault) noexcept;
  void warnOfLosses();

  const LiveOptions options_;
  Callbacks callbacks_;
  std::optional<Rigid3> T_body_rig_;
  InputQueue queue_;

  // Of the mapping's thread.
  std::unique_ptr<MappingSession> session_;
  MapSnapshot next_map_;  // the keyframes so far, without their points
  bool map_changed_ = false;
  std::chrono::steady_clock::time_point map_renewed_;
  std::chrono::steady_clock::duration map_cost_{};
  std::chrono::steady_clock::time_point warned_;
  std::chrono::steady_clock::time_point refusal_logged_;
  std::set<std::string> told_callbacks_;  // that threw
  std::uint64_t warned_losses_ = 0;
  std::uint64_t warned_given_up_ = 0;
  std::uint64_t warned_failures_ = 0;
  std::shared_ptr<LiveMapping> alone_;  // after `stop` within a callback, whose owner may be gone
  std::uint64_t told_choices_ = 0;

  mutable std::mutex mutex_;  // of the members below; held for copies alone
  std::condition_variable finished_changed_;
  DsiSink* sink_ = nullptr;
  ProcessorClock clock_ = processSeconds;
  SessionStatus status_;
  LiveStatus live_;
  std::shared_ptr<const MapSnapshot> map_;
  cv::Mat1f newest_depth_;
  DepthPlanesOptions planes_;
  bool finished_ = false;
  std::exception_ptr finish_error_;

  std::thread thread_;  // last: it uses the others
};

}  // namespace efm
