// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/playback_mapper.h"

#include <algorithm>
#include <exception>
#include <iterator>
#include <stdexcept>
#include <utility>

#include "plugin/recordings/streams/pose_conflict.h"

namespace efm {

/// The first exception of some steps. The others are tried all the same.
class PlaybackMapper::FirstError {
 public:
  template <typename Step>
  void attempt(const Step& step) {
    try {
      step();
    } catch (...) {
      if (!first_) first_ = std::current_exception();
    }
  }
  void rethrow() const {
    if (first_) std::rethrow_exception(first_);
  }

 private:
  std::exception_ptr first_;
};

// --- Input ---

void PlaybackMapper::useRig(const Rig& rig) {
  const std::lock_guard<TurnMutex> lock(session_mutex_);
  feed(rig);
  for (const RigCamera& camera : rig.cameras) {
    intakes_.emplace_back(static_cast<int>(intakes_.size()), camera);
  }
}

void PlaybackMapper::useEvents(int camera, std::vector<Event> events,
                               std::optional<std::int64_t> complete_until_ns) {
  EventPacket packet{camera, {}, complete_until_ns};
  std::vector<Input> inputs;
  {
    const std::lock_guard<std::mutex> lock(cameras_mutex_);
    EventIntake& intake = intakes_[static_cast<std::size_t>(camera)];
    if (pose_times_) intake.expectPoses(pose_times_->first_ns, pose_times_->last_ns);
    packet.events = intake.add(std::move(events));
    if (complete_until_ns) {
      packet.complete_until_ns = std::min(*complete_until_ns, intake.waitsSinceNs());
    }
    inputs = confirmedBy(packet);
    const std::lock_guard<std::mutex> statistics_lock(statistics_mutex_);
    statistics_.addEvents(packet);
  }
  inputs.emplace_back(std::move(packet));
  work(std::move(inputs));
}

void PlaybackMapper::usePacket(EventPacket packet) {
  std::vector<Input> inputs;
  {
    const std::lock_guard<std::mutex> lock(cameras_mutex_);
    inputs = confirmedBy(packet);
  }
  inputs.emplace_back(std::move(packet));
  work(std::move(inputs));
}

void PlaybackMapper::usePose(PoseSample pose) {
  if (!PoseIntake::isPossible(pose)) return work({std::move(pose)});  // the session rejects it
  std::vector<Input> inputs;
  {
    const std::lock_guard<std::mutex> lock(cameras_mutex_);
    inputs = confirmed(pose_intake_.add(std::move(pose)));
  }
  work(std::move(inputs));
}

/// Returns the poses that the events of a packet confirm.
std::vector<Input> PlaybackMapper::confirmedBy(const EventPacket& packet) {
  if (packet.events.empty()) return {};
  const std::int64_t offset_ns = intakes_[static_cast<std::size_t>(packet.camera)].offsetNs();
  return confirmed(pose_intake_.noteEvents(trajectoryTime(packet.events.back().t_ns, offset_ns)));
}

/// Returns poses that are right as input.
std::vector<Input> PlaybackMapper::confirmed(std::vector<PoseSample> poses) {
  for (const PoseSample& pose : poses) extend(pose_times_, pose.t_ns);
  return {std::make_move_iterator(poses.begin()), std::make_move_iterator(poses.end())};
}

void PlaybackMapper::skip(int camera, const std::vector<Event>& events) {
  if (events.empty()) return;
  {
    const std::lock_guard<TurnMutex> lock(session_mutex_);
    paused_events_[camera] += events.size();
  }
  work({Missing{camera, events.back().t_ns + 1, DropReason::kPaused}});
}

void PlaybackMapper::finish() {
  const auto kept = weak_from_this().lock();
  std::vector<Input> rest;
  {
    const std::lock_guard<std::mutex> lock(cameras_mutex_);
    rest = confirmed(pose_intake_.finish());
    for (EventIntake& intake : intakes_) {
      const auto camera = static_cast<int>(&intake - intakes_.data());
      if (pose_times_) intake.expectPoses(pose_times_->first_ns, pose_times_->last_ns);
      EventPacket packet{camera, intake.finish()};
      const std::lock_guard<std::mutex> statistics_lock(statistics_mutex_);
      statistics_.addEvents(packet);
      rest.emplace_back(std::move(packet));
    }
  }
  work(std::move(rest), true);
  if (ended_.exchange(true)) return;
  FirstError error;
  tellOfEnd(sayer(error));
  error.rethrow();
}

void PlaybackMapper::stop() {
  const std::lock_guard<TurnMutex> lock(session_mutex_);  // waits for the current keyframe
  stopped_ = true;
}

void PlaybackMapper::setFacts(QualityFacts facts) {
  const std::lock_guard<TurnMutex> lock(session_mutex_);
  session_.setFacts(std::move(facts));
}

// --- Mapping ---

/// Feeds and maps in the caller's thread.
void PlaybackMapper::work(std::vector<Input> inputs, bool ends) {
  const auto kept = weak_from_this().lock();  // a callback may drop the last reference
  FirstError error;
  News news;
  {
    const std::lock_guard<TurnMutex> lock(session_mutex_);
    if (finished_ && !ends) throw std::logic_error("input after the end: `finish` was called");
    for (Input& input : inputs) error.attempt([&] { feed(std::move(input)); });
    if (ends && !std::exchange(finished_, true)) error.attempt([&] { session_.finish(); });
    error.attempt([&] { news = takeNews(); });
  }
  tell(news, sayer(error));
  while (mapNext(error)) {  // earlier samples are mapped even if one is rejected
  }
  error.rethrow();
}

/// @return true if it made a keyframe.
bool PlaybackMapper::mapNext(FirstError& error) {
  std::optional<KeyframeDepthMap> keyframe;
  std::vector<std::string> warnings;
  News news;
  {
    const std::lock_guard<TurnMutex> lock(session_mutex_);
    // Within a callback, the caller of the callback maps.
    if (stopped_ || delivering_.count(std::this_thread::get_id()) != 0) return false;
    error.attempt([&] { keyframe = mapWindow(); });
    if (keyframe) error.attempt([&] { warnings = warningsOfSilence(*keyframe); });
    error.attempt([&] { news = takeNews(); });
  }
  const Say say = sayer(error);
  tell(news, say);
  for (const std::string& text : warnings) say(callbacks_.warn, text);
  if (keyframe && callbacks_.on_keyframe) {
    callBack(error, [&] { callbacks_.on_keyframe(*keyframe); });
  }
  return keyframe.has_value();
}

MapperDriver::Say PlaybackMapper::sayer(FirstError& error) {
  return [this, &error](const auto& callback, const std::string& text) {
    if (callback) callBack(error, [&] { callback(text); });
  };
}

/// Calls the host without a lock that another thread needs.
template <typename Call>
void PlaybackMapper::callBack(FirstError& error, const Call& call) {
  if (stopped_) return;
  const auto thread = std::this_thread::get_id();
  bool is_outer = false;
  error.attempt([&] {
    {
      const std::lock_guard<TurnMutex> lock(session_mutex_);
      is_outer = delivering_.insert(thread).second;
    }
    call();
  });
  const std::lock_guard<TurnMutex> lock(session_mutex_);
  if (is_outer) delivering_.erase(thread);
}

// --- Results ---

SessionStatus PlaybackMapper::status() const {
  const std::lock_guard<TurnMutex> lock(session_mutex_);
  SessionStatus status = session_.status();
  status.paused_events = paused_events_;
  return status;
}

std::shared_ptr<const MapSnapshot> PlaybackMapper::newest(bool with_points) {
  const std::lock_guard<TurnMutex> lock(session_mutex_);
  return makeSnapshot(with_points);
}

FusionMapperOptions PlaybackMapper::usedOptions() const {
  const std::lock_guard<TurnMutex> lock(session_mutex_);
  return session_.usedOptions();
}

GlobalCloudOptions PlaybackMapper::cloudOptions() const {
  const std::lock_guard<TurnMutex> lock(session_mutex_);
  return session_.cloudOptions();
}

void PlaybackMapper::describeInput(RecordingCounts& counts) const {
  const std::lock_guard<std::mutex> lock(cameras_mutex_);
  for (const EventIntake& intake : intakes_) {
    if (counts.first_skipped.empty()) counts.first_skipped = intake.firstWrong();
    counts.skipped_events += intake.wrongEvents();
  }
  if (pose_intake_.wrongPoses() == 0) return;
  counts.warnings.push_back(skippedPoses(pose_intake_.wrongPoses(), pose_intake_.firstWrong()));
}

}  // namespace efm
