// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/keyframes/fusion_mapper.h"

#include <algorithm>
#include <numeric>
#include <stdexcept>
#include <string>

#include "mapping/geometry/timestamp.h"
#include "mapping/options/option_check.h"

namespace efm {
namespace {

/// A camera whose newest event is older than the others' by this much is taken to be silent.
constexpr std::int64_t kMaxCameraLagNs = kNanosecondsPerSecond;
/// How much later than a newer one a pose may come.
constexpr std::int64_t kMaxPoseDelayNs = kNanosecondsPerSecond;

[[noreturn]] void refuse(const Event& event, int camera, const std::string& expected) {
  throw std::invalid_argument("camera " + std::to_string(camera) + ", event at " +
                              formatSeconds(event.t_ns) + " s: " + expected);
}

void requireValid(const Event& event, const CameraModel& model, int camera) {
  if (event.x >= model.width || event.y >= model.height) {
    refuse(event, camera,
           "pixel (" + std::to_string(event.x) + ", " + std::to_string(event.y) +
               ") must lie inside the sensor of " + std::to_string(model.width) + "x" +
               std::to_string(model.height));
  }
  if (event.t_ns < -kEndOfTimeNs || event.t_ns > kEndOfTimeNs) {
    refuse(event, camera, "times must lie within " + formatSeconds(kEndOfTimeNs) + " s");
  }
}

}  // namespace

void TimeLimits::validate() const {
  if (!t0_ns || !t1_ns || *t0_ns < *t1_ns) return;
  throw std::invalid_argument("t1 = " + formatSeconds(*t1_ns) +
                              " s: must be after t0 = " + formatSeconds(*t0_ns) + " s");
}

void FusionMapperOptions::validate() const {
  trajectory.validate();
  keyframes.validate();
  keyframe.validate();
  limits.validate();
  filter.validate();
  for (auto camera = cameras.begin(); camera != cameras.end(); ++camera) {
    requireOption(*camera >= 0, "cameras", *camera, "0 or above");
    requireOption(std::find(cameras.begin(), camera, *camera) == camera, "cameras", *camera,
                  "there once");
  }
  if (only_window && !(only_window->t0_ns < only_window->t1_ns)) {
    throw std::invalid_argument("the window from " + formatSeconds(only_window->t0_ns) + " s to " +
                                formatSeconds(only_window->t1_ns) + " s: must end after it begins");
  }
}

EventCounts& EventCounts::operator+=(const EventCounts& other) {
  read += other.read;
  used += other.used;
  without_pose += other.without_pose;
  outside_window += other.outside_window;
  filtered += other.filtered;
  dropped += other.dropped;
  return *this;
}

EventCounts MapperCounts::total() const {
  EventCounts sum;
  for (const EventCounts& camera : cameras) sum += camera;
  return sum;
}

/// What the mapper tells its policy, once the recording has started.
class FusionMapper::SoFar : public RecordingProgress {
 public:
  explicit SoFar(FusionMapper& mapper) : mapper_(mapper) {}

  std::int64_t startNs() const override { return *mapper_.start_ns_; }
  std::int64_t reachedNs() const override { return mapper_.reached_ns_.value_or(kMinTimeNs); }
  std::int64_t completeNs() const override { return mapper_.completeNs(); }

  std::optional<std::int64_t> timeOfEvent(std::int64_t from_ns, std::int64_t count) const override {
    const std::size_t last = mapper_.countBefore(from_ns) + static_cast<std::size_t>(count);
    std::int64_t after_ns = mapper_.completeNs();
    if (mapper_.countBefore(after_ns) < last) return std::nullopt;
    // The first time such that so many events come before the one after it.
    std::int64_t t_ns = from_ns;
    for (--after_ns; t_ns < after_ns;) {
      const std::int64_t middle_ns = t_ns + (after_ns - t_ns) / 2;
      if (mapper_.countBefore(middle_ns + 1) >= last) {
        after_ns = middle_ns;
      } else {
        t_ns = middle_ns + 1;
      }
    }
    return t_ns;
  }

  std::optional<Rigid3> viewPoseAt(std::int64_t t_ns) const override {
    const std::optional<Rigid3> T_world_rig = mapper_.trajectory_.poseAt(t_ns);
    if (!T_world_rig) return std::nullopt;
    return mapper_.keyframeMapper().referencePose(*T_world_rig);
  }
  const ReferenceView& view() const override { return mapper_.keyframeMapper().view(); }

 private:
  FusionMapper& mapper_;
};

FusionMapper::FusionMapper(const FusionMapperOptions& options)
    : options_(options), trajectory_(options.trajectory) {
  options_.validate();
  // What is uniform in inverse depth has its middle at the harmonic mean.
  const DepthPlanesOptions& planes = options_.keyframe.planes;
  const double depth_guess_m = 2.0 / (1.0 / planes.min_depth_m + 1.0 / planes.max_depth_m);
  policy_ = options_.only_window ? makeSingleWindowPolicy(*options_.only_window)
                                 : makeKeyframePolicy(options_.keyframes, depth_guess_m);
}

FusionMapper::~FusionMapper() = default;

int FusionMapper::addCamera(const RigCamera& camera) {
  if (mapper_) throw std::logic_error("a camera was added after the first keyframe");
  camera.model.validate();
  rig_.cameras.push_back(camera);
  buffers_.emplace_back();
  if (options_.filter.any()) {
    incoming_.emplace_back(EventFilter(camera.model.width, camera.model.height, options_.filter));
  }
  counts_.cameras.emplace_back();
  return static_cast<int>(rig_.cameras.size()) - 1;
}

void FusionMapper::addPose(const StampedPose& pose) {
  if (!trajectory_.empty()) {
    const std::int64_t newest_ns = trajectory_.poses().back().t_ns;
    if (pose.t_ns < newest_ns - kMaxPoseDelayNs) {
      throw std::invalid_argument("the pose at " + formatSeconds(pose.t_ns) +
                                  " s comes after one at " + formatSeconds(newest_ns) +
                                  " s: poses must come in time order, up to a second");
    }
  }
  if (!trajectory_.add(pose)) ++counts_.duplicate_poses;
}

bool FusionMapper::selected(int camera) const {
  const std::vector<int>& cameras = options_.cameras;
  return cameras.empty() || std::find(cameras.begin(), cameras.end(), camera) != cameras.end();
}

void FusionMapper::addEvents(int camera, const std::vector<Event>& events) {
  const auto index = static_cast<std::size_t>(camera);
  const RigCamera& rig_camera = rig_.cameras.at(index);
  EventBuffer& buffer = buffers_[index];
  EventCounts& counts = counts_.cameras[index];
  if (events.empty()) return;

  std::int64_t newest_ns = buffer.newest_ns.value_or(kMinTimeNs + kMaxEventDelayNs);
  for (const Event& event : events) {
    requireValid(event, rig_camera.model, camera);
    const std::int64_t t_ns = event.t_ns + rig_camera.time_offset_ns;
    if (t_ns < newest_ns - kMaxEventDelayNs) {
      refuse(event, camera,
             "must not come more than 10 ms after a newer one, that at " +
                 formatSeconds(newest_ns - rig_camera.time_offset_ns) + " s");
    }
    newest_ns = std::max(newest_ns, t_ns);
  }

  counts.read += events.size();
  buffer.newest_ns = newest_ns;
  buffer.coverUntil(newest_ns - kMaxEventDelayNs);
  reached_ns_ = std::max(reached_ns_.value_or(newest_ns), newest_ns);
  const std::int64_t begin_ns = events.front().t_ns + rig_camera.time_offset_ns;
  begun_ns_ = std::max(begun_ns_.value_or(begin_ns), begin_ns);
  if (!selected(camera)) {
    counts.dropped += events.size();
    return;
  }
  std::vector<Event> wanted;
  wanted.reserve(events.size());
  for (Event event : events) {
    event.t_ns += rig_camera.time_offset_ns;
    if (!options_.limits.hold(event.t_ns)) {
      ++counts.outside_window;
    } else if (settled_ns_ && event.t_ns < *settled_ns_) {
      ++counts.dropped;
    } else {
      wanted.push_back(event);
    }
  }
  counts_.sorted_events +=
      incoming_.empty() ? buffer.insert(wanted) : incoming_[index].insert(wanted);
}

void FusionMapper::coverUntil(int camera, std::int64_t t_ns) {
  const auto index = static_cast<std::size_t>(camera);
  const std::int64_t bounded_ns = std::clamp(t_ns, -kEndOfTimeNs, kEndOfTimeNs);
  buffers_.at(index).coverUntil(bounded_ns + rig_.cameras[index].time_offset_ns);
}

void FusionMapper::finish() { finished_ = true; }

/// The time before which nothing more is to come from a camera.
std::int64_t FusionMapper::completeUntil(std::size_t camera) const {
  if (finished_) return kMaxTimeNs;
  // From where packets begin: a long one of another camera says nothing of this one yet.
  const std::int64_t silent_ns = begun_ns_ ? *begun_ns_ - kMaxCameraLagNs : kMinTimeNs;
  return std::max(buffers_[camera].covered_ns, silent_ns);
}

/// Events reach the buffers through the filters, as soon as all before them are here.
void FusionMapper::releaseFiltered() {
  for (std::size_t c = 0; c < incoming_.size(); ++c) {
    counts_.cameras[c].filtered += incoming_[c].release(completeUntil(c), buffers_[c]);
  }
}

bool FusionMapper::camerasCover(std::int64_t t_ns) const {
  for (std::size_t c = 0; c < buffers_.size(); ++c) {
    if (selected(static_cast<int>(c)) && completeUntil(c) < t_ns) return false;
  }
  return true;
}

/// All events of the selected cameras before this time are here, and poses reach it.
std::int64_t FusionMapper::completeNs() const {
  std::int64_t complete_ns = trajectory_.empty() ? kMinTimeNs : trajectory_.poses().back().t_ns;
  for (std::size_t c = 0; c < buffers_.size(); ++c) {
    if (selected(static_cast<int>(c))) complete_ns = std::min(complete_ns, completeUntil(c));
  }
  return complete_ns;
}

/// Events of the selected cameras in the buffers before a time.
std::size_t FusionMapper::countBefore(std::int64_t t_ns) const {
  std::size_t count = 0;
  for (const EventBuffer& buffer : buffers_) count += buffer.indexOf(t_ns) - buffer.begin;
  return count;
}

/// Whether all of a window's events and poses are here. The one window that was asked for is mapped
/// with what there is in the end.
bool FusionMapper::isDue(const Window& window) const {
  const bool asked_for = options_.only_window.has_value();
  if (asked_for && finished_) return true;
  if (asked_for && (!reached_ns_ || *reached_ns_ < window.t1_ns)) return false;
  if (options_.limits.t1_ns && window.t1_ns > *options_.limits.t1_ns) return false;
  return completeNs() >= window.t1_ns && trajectory_.poses().back().t_ns >= window.t_ref_ns;
}

/// Looks for the first event with a pose. Events before it have none and are forgotten; what comes
/// after it, with a pose or without, is the policy's.
void FusionMapper::findStart() {
  if (trajectory_.empty()) return;
  const std::int64_t newest_pose_ns = trajectory_.poses().back().t_ns;
  std::optional<std::int64_t> first_ns;
  for (EventBuffer& buffer : buffers_) {
    for (std::size_t i = buffer.begin; i < buffer.events.size(); ++i) {
      const std::int64_t t_ns = buffer.events[i].t_ns;
      if (t_ns > newest_pose_ns || t_ns >= first_ns.value_or(kMaxTimeNs)) break;
      if (!trajectory_.segmentAt(t_ns, buffer.pose_cursor)) continue;
      first_ns = t_ns;
      break;
    }
  }
  // A camera that lags may still bring an earlier one.
  const std::int64_t forgotten_ns = std::min(completeNs(), first_ns.value_or(kMaxTimeNs));
  for (std::size_t c = 0; c < buffers_.size(); ++c) {
    EventBuffer& buffer = buffers_[c];
    const std::size_t end = buffer.indexOf(forgotten_ns);
    counts_.cameras[c].without_pose += end - buffer.begin;
    buffer.begin = end;
    buffer.compact();
  }
  if (first_ns && camerasCover(*first_ns)) start_ns_ = first_ns;
}

/// A gap in the events, however long, costs nothing.
void FusionMapper::passEmptyWindows() {
  if (!reached_ns_) return;
  const SoFar recording(*this);
  const std::int64_t from_ns = policy_->earliestStart(recording);
  std::int64_t empty_until_ns = std::min(*reached_ns_, options_.limits.t1_ns.value_or(kMaxTimeNs));
  for (std::size_t c = 0; c < buffers_.size(); ++c) {
    if (!selected(static_cast<int>(c))) continue;
    const EventBuffer& buffer = buffers_[c];
    const std::size_t next = buffer.indexOf(from_ns);
    const bool there = next < buffer.events.size();
    empty_until_ns = std::min(empty_until_ns, there ? buffer.events[next].t_ns : completeUntil(c));
  }
  counts_.windows_without_events += policy_->advancePast(recording, empty_until_ns);
}

std::vector<EventSpan> FusionMapper::eventsOf(const Window& window) const {
  std::vector<EventSpan> events;
  for (const EventBuffer& buffer : buffers_) {
    events.push_back(buffer.between(window.t0_ns, window.t1_ns));
  }
  return events;
}

void FusionMapper::countKeyframe(const KeyframeDepthMap& keyframe) {
  ++counts_.keyframes;
  counts_.votes += keyframe.votes;
  counts_.silent_subintervals += keyframe.silent_subintervals;
  counts_.event_uses =
      std::accumulate(keyframe.events.begin(), keyframe.events.end(), counts_.event_uses);
  for (EventBuffer& buffer : buffers_) {
    const std::size_t end = buffer.indexOf(keyframe.window.t1_ns);
    for (std::size_t i = buffer.indexOf(keyframe.window.t0_ns); i < end; ++i) {
      if (trajectory_.segmentAt(buffer.events[i].t_ns, buffer.pose_cursor)) buffer.used[i] = 1;
    }
  }
}

/// The time before which every event is here, its poses known, and no window to come needs it.
std::int64_t FusionMapper::settledUntil() {
  const std::int64_t settled_ns = policy_->earliestStart(SoFar(*this));
  return finished_ ? settled_ns : std::min(settled_ns, completeNs());
}

/// Lets go of events and poses before a time, and says what became of the events.
void FusionMapper::settleBefore(std::int64_t t_ns) {
  if (settled_ns_ && t_ns <= *settled_ns_) return;
  settled_ns_ = t_ns;
  for (std::size_t c = 0; c < buffers_.size(); ++c) {
    EventBuffer& buffer = buffers_[c];
    EventCounts& counts = counts_.cameras[c];
    const std::size_t end = buffer.indexOf(t_ns);
    for (; buffer.begin < end; ++buffer.begin) {
      if (buffer.used[buffer.begin] != 0) {
        ++counts.used;
      } else if (trajectory_.segmentAt(buffer.events[buffer.begin].t_ns, buffer.pose_cursor)) {
        ++counts.outside_window;
      } else {
        ++counts.without_pose;
      }
    }
    buffer.compact();
  }
  // The view of a window may stand before it.
  trajectory_.forgetBefore(start_ns_ ? std::min(t_ns, policy_->earliestReference(SoFar(*this)))
                                     : t_ns);
}

std::optional<KeyframeDepthMap> FusionMapper::next(DsiSink* sink, StageHook* stages) {
  releaseFiltered();
  if (options_.only_window) start_ns_ = options_.only_window->t0_ns;
  if (!start_ns_) findStart();
  while (start_ns_) {
    passEmptyWindows();
    const std::optional<Window> window = policy_->current(SoFar(*this));
    if (!window || !isDue(*window)) break;
    std::optional<KeyframeDepthMap> keyframe = mapWindow(*window, sink, stages);
    policy_->advance(*window, keyframe ? &*keyframe : nullptr);
    settleBefore(settledUntil());
    if (keyframe) return keyframe;
  }
  if (finished_) {
    settleBefore(kMaxTimeNs);
  } else if (start_ns_) {
    settleBefore(settledUntil());
  }
  return std::nullopt;
}

/// Made when it is first needed: by then the rig is complete.
KeyframeMapper& FusionMapper::keyframeMapper() {
  if (!mapper_) {
    std::vector<int> cameras = options_.cameras;
    if (cameras.empty()) {
      cameras.resize(rig_.cameras.size());
      std::iota(cameras.begin(), cameras.end(), 0);
    }
    mapper_ = std::make_unique<KeyframeMapper>(rig_, cameras, options_.keyframe);
  }
  return *mapper_;
}

std::optional<KeyframeDepthMap> FusionMapper::mapWindow(const Window& window, DsiSink* sink,
                                                        StageHook* stages) {
  const std::vector<EventSpan> events = eventsOf(window);
  if (std::all_of(events.begin(), events.end(), [](EventSpan some) { return some.empty(); })) {
    ++counts_.windows_without_events;
    return std::nullopt;
  }
  auto keyframe = keyframeMapper().map(window, events, trajectory_, sink, stages);
  if (keyframe) {
    countKeyframe(*keyframe);
  } else {
    ++counts_.keyframes_without_pose;
  }
  return keyframe;
}

}  // namespace efm
