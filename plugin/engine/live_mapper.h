// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "plugin/engine/mapper_driver.h"
#include "plugin/session/gate.h"

namespace efm {

/// Maps in a thread of its own, behind a gate. Errors of the mapping, the refinement and the
/// callbacks are counted and logged; the window is dropped and the next one is tried. Queries
/// return the newest published state. The snapshot of the map is renewed after each keyframe, as
/// long as this takes at most a twentieth of the time.
class LiveMapper : public MapperDriver {
 public:
  LiveMapper(const EventFusionOptions& options, Callbacks callbacks,
             const std::vector<StoredKeyframe>& earlier, QualityFacts facts);
  static std::shared_ptr<MapperDriver> make(const EventFusionOptions& options, Callbacks callbacks,
                                            const std::vector<StoredKeyframe>& earlier,
                                            QualityFacts facts);
  ~LiveMapper() override;

  void skip(int camera, const std::vector<Event>& events) override { gate_.skip(camera, events); }
  void finish() override;
  void stop() override;
  bool runsHere() const override { return std::this_thread::get_id() == worker_; }
  SessionStatus status() const override;
  std::shared_ptr<const MapSnapshot> newest(bool with_points) override;
  EventFusionOptions usedOptions() const override;

 protected:
  void useRig(const Rig& rig) override { gate_.add(rig); }
  void useEvents(int camera, std::vector<Event> events,
                 std::optional<std::int64_t> complete_until_ns) override {
    gate_.add(camera, std::move(events), complete_until_ns);
  }
  void usePacket(EventPacket packet) override { gate_.add(std::move(packet)); }
  void usePose(PoseSample pose) override { gate_.add(std::move(pose)); }
  bool hasEnded() const override;

 private:
  using Clock = std::chrono::steady_clock;
  /// Origin of an exception: the mapping, a callback of the host, or a rejected sample.
  enum class Fault { kMapping, kCallback, kEvents, kPose };

  // Functions of the mapper's thread.
  void run();
  bool takeAndMap();
  void mapDue();
  bool mapNext();
  void endRun(std::exception_ptr error);
  void publishState();
  void publishMap(bool at_once);
  template <typename Step>
  bool attempt(Fault fault, const char* doing, const Step& step);
  template <typename Call>
  void callBack(const char* name, const Call& call);
  Say sayer();
  void warn(const std::string& text);
  void noteError(const char* doing, Fault fault) noexcept;
  void warnOfLosses();

  Gate gate_;
  std::atomic<bool> stopped_ = false;
  std::atomic<std::thread::id> worker_{};  // the mapper's thread
  std::mutex join_mutex_;                  // guards thread_

  // Members of the mapper's thread.
  bool map_changed_ = false;
  Clock::time_point map_renewed_;
  Clock::duration map_cost_{};
  Clock::time_point warned_;
  Clock::time_point rejection_logged_;
  std::set<std::string> logged_callbacks_;  // callbacks that threw and were logged
  std::uint64_t warned_losses_ = 0;
  std::uint64_t warned_dropped_windows_ = 0;
  std::uint64_t warned_failures_ = 0;
  std::shared_ptr<LiveMapper> self_;  // set by `make` until the thread ends: the owner may be gone

  mutable std::mutex mutex_;  // guards the members below; held for copies only
  std::condition_variable ended_changed_;
  SessionStatus status_;
  EventFusionOptions used_options_;
  LiveStatus live_;  // its errors
  std::shared_ptr<const MapSnapshot> map_;
  bool ended_ = false;
  std::exception_ptr end_error_;

  std::thread thread_;  // last member: it uses the others
};

}  // namespace efm
