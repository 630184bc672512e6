// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/engine/live_mapper.h"

#include <fmt/format.h>

#include <stdexcept>
#include <utility>

namespace efm {
namespace {

/// Snapshots of the map may take 1 / this of the time.
constexpr int kMapCostDivisor = 20;

std::string errorText() {
  try {
    throw;
  } catch (const std::exception& error) {
    return error.what();
  } catch (...) {
    return "an exception of another type";
  }
}

}  // namespace

LiveMapper::LiveMapper(const EventFusionOptions& options, Callbacks callbacks,
                       const std::vector<StoredKeyframe>& earlier, QualityFacts facts)
    : MapperDriver(options, std::move(callbacks), earlier, std::move(facts), ChoiceBy::kSession),
      gate_(options.live) {
  status_ = session_.status();
  used_options_ = session_.options();
  map_ = session_.snapshot(true);
  thread_ = std::thread([this] {  // waits: no input before the constructor returns
    worker_ = std::this_thread::get_id();
    run();
    worker_ = std::thread::id();
    const auto last = std::move(self_);  // may destroy this
  });
}

std::shared_ptr<MapperDriver> LiveMapper::make(const EventFusionOptions& options,
                                               Callbacks callbacks,
                                               const std::vector<StoredKeyframe>& earlier,
                                               QualityFacts facts) {
  const auto mapper =
      std::make_shared<LiveMapper>(options, std::move(callbacks), earlier, std::move(facts));
  mapper->self_ = mapper;
  return {mapper.get(), [mapper](MapperDriver*) {
            mapper->stop();
            if (mapper->runsHere()) mapper->thread_.detach();
          }};
}

LiveMapper::~LiveMapper() {
  if (!runsHere()) stop();
}

void LiveMapper::finish() {
  const auto kept = weak_from_this().lock();
  if (runsHere()) throw std::logic_error("the mapping cannot be finished from its own callback");
  gate_.end();
  std::unique_lock<std::mutex> lock(mutex_);
  ended_changed_.wait(lock, [this] { return ended_; });
  if (end_error_) std::rethrow_exception(std::exchange(end_error_, nullptr));
}

void LiveMapper::stop() {
  stopped_ = true;
  gate_.stop();
  if (runsHere()) return;
  const std::lock_guard<std::mutex> lock(join_mutex_);
  if (thread_.joinable()) thread_.join();
}

// --- The mapper's thread ---

void LiveMapper::run() {
  for (bool goes_on = true; goes_on;) {
    attempt(Fault::kMapping, "the input", [&] { goes_on = takeAndMap(); });  // may lack memory
  }
  endRun(nullptr);  // if stopped, nobody waits for the end
}

/// Takes and maps the input that is there, one by one: how much of it there is changes nothing.
/// @return true if more input may come.
bool LiveMapper::takeAndMap() {
  // A delayed snapshot is made when its time has come.
  if (map_changed_) {
    gate_.wait(map_renewed_ + kMapCostDivisor * map_cost_);
  } else {
    gate_.wait();
  }
  while (std::optional<Input> input = gate_.take(session_.eventsCompleteNs())) {
    const Fault fault = std::holds_alternative<PoseSample>(*input)    ? Fault::kPose
                        : std::holds_alternative<EventPacket>(*input) ? Fault::kEvents
                                                                      : Fault::kMapping;
    attempt(fault, "the input", [&] { feed(std::move(*input)); });
    warnOfLosses();
    mapDue();
    if (stopped_) return false;
  }
  if (stopped_) return false;
  const bool ends = gate_.isAtEnd();
  std::exception_ptr error;
  if (ends) {
    attempt(Fault::kMapping, "the end of the input", [&] {
      try {
        session_.finish();
      } catch (const std::invalid_argument&) {  // a pose, which counts as rejected
      } catch (...) {
        error = std::current_exception();
        throw;
      }
    });
    mapDue();
  }
  publishState();
  publishMap(ends);
  if (!ends) return true;
  attempt(Fault::kMapping, "the session file", [&] { endStored(); });
  warnOfLosses();
  tellOfEnd(sayer());
  endRun(error);
  return false;
}

void LiveMapper::endRun(std::exception_ptr error) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (std::exchange(ended_, true)) return;
  end_error_ = std::move(error);
  ended_changed_.notify_all();
}

void LiveMapper::mapDue() {
  while (!stopped_ && mapNext()) {
  }
}

/// @return true if it made a keyframe, or dropped a window.
bool LiveMapper::mapNext() {
  attempt(Fault::kMapping, "the input that waits", [&] {  // the newest input wins
    session_.limitHeld(options_.live.queueEvents() - static_cast<double>(gate_.queuedEvents()));
  });
  std::optional<KeyframeDepthMap> keyframe;
  const bool mapped = attempt(Fault::kMapping, "a keyframe", [&] { keyframe = mapWindow(); });
  if (!keyframe && !mapped && session_.dropFailedWindow()) {
    publishState();
    return true;
  }
  if (!keyframe) {
    attempt(Fault::kMapping, "the input that waits", [&] { session_.limitWaits(); });
    return false;
  }
  std::vector<std::string> warnings;
  map_changed_ = true;
  attempt(Fault::kMapping, "the session file", [&] { store(*keyframe); });
  attempt(Fault::kMapping, "a warning", [&] { warnings = warningsOfSilence(*keyframe); });
  publishMap(false);
  publishState();
  for (const std::string& text : warnings) warn(text);
  if (callbacks_.on_keyframe) {
    callBack("the callback of a keyframe", [&] { callbacks_.on_keyframe(*keyframe); });
  }
  return true;
}

/// Renews the snapshot, unless this would take too much of the time.
void LiveMapper::publishMap(bool at_once) {
  const Clock::time_point begin = Clock::now();
  const bool is_due = map_changed_ && begin - map_renewed_ >= kMapCostDivisor * map_cost_;
  if (!is_due && !at_once) return;
  std::shared_ptr<const MapSnapshot> made;
  const bool done =
      attempt(Fault::kMapping, "the snapshot of the map", [&] { made = session_.snapshot(true); });
  map_renewed_ = Clock::now();
  map_cost_ = map_renewed_ - begin;
  if (!done) return;  // the next try costs as much
  map_changed_ = false;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    map_ = made;
  }
  if (!callbacks_.on_map) return;
  callBack("the callback of the map", [&] { callbacks_.on_map(made); });
}

/// Renews the state, and logs a choice of options and failed refinements.
void LiveMapper::publishState() {
  attempt(Fault::kMapping, "the state", [&] {
    tell(takeNews(), sayer());
    SessionStatus status = session_.status();
    std::string failure;
    if (status.refinement && status.refinement->failures > warned_failures_) {
      warned_failures_ = status.refinement->failures;
      failure = "refinement: " + status.refinement->last_error;
    }
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      status_ = std::move(status);
      used_options_ = session_.options();
    }
    if (!failure.empty()) warn(failure);
  });
}

// --- Results ---

SessionStatus LiveMapper::status() const {
  std::map<int, QueueCounts> cameras = gate_.counts();
  const std::uint64_t rejected_poses = gate_.rejectedPoses();
  const std::uint64_t late_events = gate_.lateEvents();
  const std::lock_guard<std::mutex> lock(mutex_);
  SessionStatus status = status_;
  LiveStatus& live = *status.live;
  for (const auto& [camera, counts] : live.cameras) cameras[camera].lost = counts.lost;
  live.cameras = std::move(cameras);
  live.rejected_poses += rejected_poses;
  live.late_events = late_events;
  live.errors = live_.errors;
  live.last_error = live_.last_error;
  return status;
}

std::shared_ptr<const MapSnapshot> LiveMapper::newest(bool /*with_points*/) {
  const std::lock_guard<std::mutex> lock(mutex_);
  return map_;
}

EventFusionOptions LiveMapper::usedOptions() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return used_options_;
}

bool LiveMapper::hasEnded() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return ended_;
}

// --- Errors and the log ---

/// Runs a step. Its exception is counted. @return whether there was none.
template <typename Step>
bool LiveMapper::attempt(Fault fault, const char* doing, const Step& step) {
  try {
    step();
    return true;
  } catch (const std::invalid_argument&) {
    noteError(doing, fault);
  } catch (...) {  // no rejected input
    noteError(doing, fault == Fault::kCallback ? fault : Fault::kMapping);
  }
  return false;
}

/// Calls the host without a lock that another thread needs.
template <typename Call>
void LiveMapper::callBack(const char* name, const Call& call) {
  if (!stopped_) attempt(Fault::kCallback, name, call);
}

MapperDriver::Say LiveMapper::sayer() {
  return [this](const auto& callback, const std::string& text) {
    if (callback) callBack("the callback of the log", [&] { callback(text); });
  };
}

/// Writes a line to the host's log.
void LiveMapper::warn(const std::string& text) { sayer()(callbacks_.warn, text); }

/// Counts an exception, within its handler. Throws nothing: nobody catches in the thread.
void LiveMapper::noteError(const char* doing, Fault fault) noexcept {
  const bool is_input = fault == Fault::kEvents || fault == Fault::kPose;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!is_input) ++live_.errors;
  }
  try {
    const std::string text = errorText();
    bool is_new = false;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      is_new = live_.last_error != text;
      live_.last_error = text;
    }
    // A failing callback is logged once, rejected events once a second, rejected poses never.
    const Clock::time_point now = Clock::now();
    if (fault == Fault::kCallback) is_new = logged_callbacks_.insert(doing).second;
    if (fault == Fault::kEvents && now - rejection_logged_ < std::chrono::seconds(1)) return;
    if (!is_new || fault == Fault::kPose) return;
    if (is_input) rejection_logged_ = now;
    warn(is_input ? text : std::string(doing) + ": " + text);
  } catch (...) {  // no memory: the error is counted already
  }
}

/// Warns of lost events and dropped windows, at most once a second.
void LiveMapper::warnOfLosses() {
  const Clock::time_point now = Clock::now();
  if (now - warned_ < std::chrono::seconds(1)) return;
  std::uint64_t losses = 0;
  std::string text;
  const SessionStatus status = this->status();
  for (const auto& [camera, counts] : status.live->cameras) {
    losses += counts.losses();
    text += fmt::format("; camera {}: ", camera);
    for (const QueueFate fate :
         {QueueFate::kQueueFull, QueueFate::kSubsampled, QueueFate::kRejected}) {
      const auto& row = kQueueFates[static_cast<std::size_t>(fate)];
      text += fmt::format("{} {}, ", counts.fates[fate], row.text);
    }
    text += fmt::format("{} lost afterwards, of {} events", counts.lost, counts.received);
  }
  const DroppedWindows& dropped = status.counts.dropped_windows;
  if (losses == warned_losses_ && dropped.total() == warned_dropped_windows_) return;
  warned_ = now;
  warned_losses_ = losses;
  warned_dropped_windows_ = dropped.total();
  warn(fmt::format("so far {}{}", asText(dropped), text));
}

}  // namespace efm
