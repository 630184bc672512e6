// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <thread>
#include <vector>

#include "mapping/events/event_checker.h"
#include "plugin/engine/first_look.h"
#include "plugin/engine/mapper_driver.h"
#include "plugin/session/pose_intake.h"

namespace efm {

/// A mutex whose threads take turns: one that locks it again and again does not keep others out.
class TurnMutex {
 public:
  void lock() {
    std::unique_lock<std::mutex> lock(mutex_);
    const std::uint64_t turn = next_++;
    changed_.wait(lock, [&] { return turn == now_; });
  }
  void unlock() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      ++now_;
    }
    changed_.notify_all();
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::uint64_t next_ = 0, now_ = 0;
};

/// Maps in the caller's thread.
///
/// Automatic options are chosen from the whole recording, with the same code as in
/// `event-fusion map`, which reads the recording twice. Nothing is mapped before `finish`, and all
/// events are kept in memory. If they need more than `[live] max_queue_mb`, the recording is a
/// stream: the options are chosen from the data so far, and then the depth limits follow the
/// keyframes.
///
/// If a window cannot be mapped (no memory, a sink that throws), the
/// next call tries it again. A query waits while a keyframe is made, but not while it is delivered.
/// If several threads add samples, keyframes may be delivered at the same time. Within a callback
/// `add` and `finish` only take the input: the caller of the callback maps it.
class PlaybackMapper : public MapperDriver {
 public:
  PlaybackMapper(const EventFusionOptions& options, Callbacks callbacks,
                 const std::vector<StoredKeyframe>& earlier = {}, QualityFacts facts = {});

  void skip(int camera, const std::vector<Event>& events) override;
  void finish() override;
  void stop() override;
  void pullKeyframes() override { pulled_ = true; }
  std::optional<KeyframeDepthMap> next() override;
  SessionStatus status() const override;
  std::shared_ptr<const MapSnapshot> newest(bool with_points) override;
  EventFusionOptions usedOptions() const override;

 protected:
  void useRig(const Rig& rig) override;
  void useEvents(int camera, std::vector<Event> events,
                 std::optional<std::int64_t> complete_until_ns) override;
  void usePacket(EventPacket packet) override;
  void usePose(PoseSample pose) override;
  void describeInput(RecordingCounts& counts) const override;
  bool hasEnded() const override { return ended_; }

 private:
  class FirstError;
  std::vector<Input> confirmedBy(const EventPacket& packet);
  std::vector<Input> confirmed(std::vector<PoseSample> poses);
  void work(std::vector<Input> inputs, bool ends = false);
  void lookAt(const Input& input);
  void chooseIfDue();
  std::optional<KeyframeDepthMap> mapNext(FirstError& error);
  Say sayer(FirstError& error);
  template <typename Call>
  void callBack(FirstError& error, const Call& call);

  // Under cameras_mutex_.
  std::vector<EventIntake> intakes_;  // one per camera
  PoseIntake pose_intake_;
  std::optional<TimeSpan> pose_times_;  // which confirm events

  std::atomic<bool> pulled_ = false;
  std::atomic<bool> stopped_ = false;
  std::atomic<bool> ended_ = false;
  // Guards the session and the members below. It is held while a keyframe is made.
  mutable TurnMutex session_mutex_;
  std::unique_ptr<FirstLook> look_;        // until the automatic options are chosen
  std::optional<RecordingSurvey> survey_;  // the result of look_
  bool look_ends_ = false;  // events are missing: choose as soon as the data last a second
  std::map<int, std::uint64_t> paused_events_;
  std::set<std::thread::id> delivering_;  // threads that are in a callback
  bool finished_ = false;
};

}  // namespace efm
