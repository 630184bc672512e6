// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/engine/playback_mapper.h"

#include <fmt/format.h>

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

PlaybackMapper::PlaybackMapper(const EventFusionOptions& options, Callbacks callbacks,
                               const std::vector<StoredKeyframe>& earlier, QualityFacts facts)
    : MapperDriver(options, std::move(callbacks), earlier, std::move(facts), ChoiceBy::kCaller) {
  if (options.automatic.any()) look_ = std::make_unique<FirstLook>(options);
}

// --- Input ---

void PlaybackMapper::useRig(const Rig& rig) {
  const std::lock_guard<TurnMutex> lock(session_mutex_);
  lookAt(rig);
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
    const std::lock_guard<std::mutex> copies_lock(copies_mutex_);
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
      const std::lock_guard<std::mutex> copies_lock(copies_mutex_);
      statistics_.addEvents(packet);
      rest.emplace_back(std::move(packet));
    }
  }
  work(std::move(rest), true);
  if (ended_.exchange(true)) return;
  FirstError error;
  error.attempt([&] {
    const std::lock_guard<TurnMutex> lock(session_mutex_);
    endStored();
  });
  tellOfEnd(sayer(error));
  error.rethrow();
}

void PlaybackMapper::stop() {
  const std::lock_guard<TurnMutex> lock(session_mutex_);  // waits for the current keyframe
  stopped_ = true;
}

// --- Mapping ---

/// Feeds and maps in the caller's thread.
void PlaybackMapper::work(std::vector<Input> inputs, bool ends) {
  const auto kept = weak_from_this().lock();  // a callback may drop the last reference
  FirstError error;
  {
    const std::lock_guard<TurnMutex> lock(session_mutex_);
    if (finished_ && !ends) throw std::logic_error("input after the end: `finish` was called");
    for (Input& input : inputs) {
      error.attempt([&] {
        lookAt(input);
        feed(std::move(input));
      });
    }
    if (ends && !std::exchange(finished_, true)) error.attempt([&] { session_.finish(); });
  }
  while (!pulled_) {  // earlier samples are mapped even if one is rejected
    const std::optional<KeyframeDepthMap> keyframe = mapNext(error);
    if (!keyframe) break;
    if (callbacks_.on_keyframe) callBack(error, [&] { callbacks_.on_keyframe(*keyframe); });
  }
  error.rethrow();
}

/// Shows input to the first look. Input that it rejects is rejected by the session, too.
void PlaybackMapper::lookAt(const Input& input) {
  if (!look_ || survey_) return;
  if (const auto* const rig = std::get_if<Rig>(&input)) look_->take(*rig);
  look_ends_ |= std::holds_alternative<Missing>(input);
  try {
    if (const auto* const packet = std::get_if<EventPacket>(&input)) look_->addEvents(*packet);
    if (const auto* const pose = std::get_if<PoseSample>(&input)) look_->addPose(*pose);
  } catch (const std::invalid_argument&) {
  }
}

/// Chooses the automatic options at the end of the input, or if too many events are held.
void PlaybackMapper::chooseIfDue() {
  if (!look_) return;
  const double max_mb = options_.live.max_queue_mb;
  const auto in_mb = [](std::uint64_t events) {
    return static_cast<double>(events * sizeof(Event)) / 1e6;
  };
  // The session holds at most what the look has received.
  const bool may_be_due = finished_ || look_ends_ || survey_;
  if (!may_be_due && in_mb(look_->receivedEvents()) <= max_mb) return;
  const SessionStatus status = session_.status();
  const double held_mb = in_mb(status.held_events);
  const bool ends = look_ends_ && status.events &&
                    secondsBetween(status.events->first_ns, status.events->last_ns) > kFirstWindowS;
  if (!finished_ && !ends && held_mb <= max_mb) return;
  if (!survey_) survey_ = look_->finish();
  RecordingSurvey survey = *survey_;
  const double seen_s = survey.duration_s.value_or(0);
  if (!finished_) survey.duration_s.reset();
  const EventFusionOptions& options = session_.options();
  NewOptions found{chooseAndJudge(survey, options), !finished_};
  OptionChoice& choice = found.chosen.choice;
  if (found.follow_depths) {  // at the end, following limits would be no better
    if (!choice.found_scene) choice = chooseWideDepths(options.automatic, found.chosen.mapper);
    for (ChosenOption& option : choice.options) {
      option.reason += fmt::format(
          "; from the first {:.3g} s of a stream{}", seen_s,
          ends ? "" : fmt::format(", {:.0f} MB of events ([live] max_queue_mb)", held_mb));
    }
  }
  feed(std::move(found));
  survey_.reset();
  look_.reset();
}

std::optional<KeyframeDepthMap> PlaybackMapper::next() {
  FirstError error;
  std::optional<KeyframeDepthMap> keyframe = mapNext(error);
  error.rethrow();
  return keyframe;
}

/// Maps the next window, and tells the log.
std::optional<KeyframeDepthMap> PlaybackMapper::mapNext(FirstError& error) {
  std::optional<KeyframeDepthMap> keyframe;
  std::vector<std::string> warnings;
  News news;
  {
    const std::lock_guard<TurnMutex> lock(session_mutex_);
    // Within a callback, the caller of the callback maps.
    if (stopped_ || delivering_.count(std::this_thread::get_id()) != 0) return std::nullopt;
    error.attempt([&] {
      chooseIfDue();
      keyframe = mapWindow();
    });
    if (keyframe) error.attempt([&] { store(*keyframe); });
    if (keyframe) error.attempt([&] { warnings = warningsOfSilence(*keyframe); });
    error.attempt([&] { news = takeNews(); });
  }
  const Say say = sayer(error);
  tell(news, say);
  for (const std::string& text : warnings) say(callbacks_.warn, text);
  return keyframe;
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
  status.live.reset();
  status.paused_events = paused_events_;
  return status;
}

std::shared_ptr<const MapSnapshot> PlaybackMapper::newest(bool with_points) {
  const std::lock_guard<TurnMutex> lock(session_mutex_);
  return session_.snapshot(with_points);
}

EventFusionOptions PlaybackMapper::usedOptions() const {
  const std::lock_guard<TurnMutex> lock(session_mutex_);
  return session_.options();
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
