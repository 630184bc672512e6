// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/map_refinement.h"

#include <cmath>
#include <cstddef>
#include <utility>

#include "mapping/geometry/timestamp.h"
#include "plugin/session/session_status.h"

namespace efm {
namespace {

/// Number of waiting keyframes with points; further keyframes lose their points.
constexpr std::size_t kMaxWaiting = 50;

std::string textOf(const std::exception_ptr& error) {
  if (!error) return {};
  try {
    std::rethrow_exception(error);
  } catch (const std::exception& exception) {
    return exception.what();
  } catch (...) {
    return "unknown error";
  }
}

}  // namespace

Matrix6d covarianceAt(const RefinementState& state, const Rigid3& T_world_rig) {
  const Eigen::Vector3d lever_m = T_world_rig.translation - state.T_world_ref_denoised.translation;
  Matrix6d by_motion = Matrix6d::Identity();  // a rotation r moves the rig by r x lever
  by_motion.topRightCorner<3, 3>() << 0, lever_m.z(), -lever_m.y(),  //
      -lever_m.z(), 0, lever_m.x(),                                  //
      lever_m.y(), -lever_m.x(), 0;
  return by_motion * state.covariance * by_motion.transpose() +
         state.tracker.driftCovariance(lever_m.norm());
}

namespace {

/// Returns whether a correction has the size of the expected errors, in the whole window and at a
/// time after (negative: before) the reference time.
bool isLikely(const MotionCorrection& correction, double since_s) {
  // Of simulated trackers, poor ones too: up to 1.1 (translation) and 1.4 (rotation).
  constexpr double kMaxRmsSigmas = 2;
  constexpr double kMaxSigmas = 4;
  double squared_m = 0;
  double squared_rad = 0;
  double variance = 0;  // of three axes, of a walk of 1
  for (std::size_t i = 0; i < correction.knots.size(); ++i) {
    squared_m += correction.knots[i].head<3>().squaredNorm();
    squared_rad += correction.knots[i].tail<3>().squaredNorm();
    variance += 3 * std::abs(correction.sinceReference(i));
  }
  const double rms = std::sqrt(variance);
  const double then = std::sqrt(std::abs(since_s));
  const Vector6d error = differenceOf(correction.displacement(since_s));
  return std::sqrt(squared_m) <= kMaxRmsSigmas * rms * correction.walk_m &&
         std::sqrt(squared_rad) <= kMaxRmsSigmas * rms * correction.walk_rad &&
         error.head<3>().norm() <= kMaxSigmas * then * correction.walk_m &&
         error.tail<3>().norm() <= kMaxSigmas * then * correction.walk_rad;
}

}  // namespace

WindowMotion::WindowMotion(const KeyframeDepthMap& keyframe)
    : t_ref_ns(keyframe.window.t_ref_ns),
      T_world_ref(keyframe.T_world_ref),
      T_rig_ref(keyframe.T_rig_ref),
      correction(keyframe.motion_correction) {}

std::optional<Rigid3> motionBetween(const WindowMotion& from, const WindowMotion& to) {
  const Rigid3 T_from_to = from.T_world_ref.inverse() * to.T_world_ref;
  // A window's correction at another time, in its reference view.
  const auto correctionAt = [](const WindowMotion& window,
                               std::int64_t t_ns) -> std::optional<Rigid3> {
    const double since_s = secondsBetween(window.t_ref_ns, t_ns);
    const std::optional<MotionCorrection>& correction = window.correction;
    if (!correction || !correction->covers(since_s) || !isLikely(*correction, since_s)) {
      return std::nullopt;
    }
    return window.T_rig_ref.inverse() * correction->displacement(since_s) * window.T_rig_ref;
  };
  const std::optional<Rigid3> by_from = correctionAt(from, to.t_ref_ns);
  const std::optional<Rigid3> by_to = correctionAt(to, from.t_ref_ns);
  if (by_from && by_to) {
    return interpolate(T_from_to * *by_from, by_to->inverse() * T_from_to, 0.5);
  }
  if (by_from) return T_from_to * *by_from;
  if (by_to) return by_to->inverse() * T_from_to;
  return std::nullopt;
}

MapRefinement::MapRefinement(const MapRefinementOptions& options)
    : options_(options), refiner_(options.refiner) {
  state_.tracker = options.refiner.tracker;
  state_.covariance = refiner_.covariance();
  if (options.background) thread_ = std::thread([this] { runInBackground(); });
}

MapRefinement::~MapRefinement() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

Rigid3 MapRefinement::add(const KeyframeDepthMap& keyframe,
                          const std::optional<PoseNoise>& stated) {
  KeyframeRefiner::requireUsable(keyframe.T_world_ref, stated);
  Task task{RegistrationCloud(keyframe, options_.refiner.points), keyframe.T_world_ref, stated, {}};
  WindowMotion motion(keyframe);
  if (last_) task.T_last_ref = motionBetween(*last_, motion);
  last_ = std::move(motion);
  if (!options_.background) {
    if (!refine(task)) std::rethrow_exception(std::exchange(unthrown_, nullptr));
    return refiner_.T_world_ref(refiner_.keyframes() - 1);
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  if (waiting_.size() >= kMaxWaiting) task.cloud.clear();
  waiting_.push_back(std::move(task));
  changed_.notify_all();
  return state_.T_world_odom * keyframe.T_world_ref;
}

void MapRefinement::finish() {
  {
    std::unique_lock<std::mutex> lock(mutex_);
    held_ = 0;
    changed_.notify_all();
    changed_.wait(lock, [this] { return waiting_.size() == held_; });
  }
  // The thread is idle, so the refiner may be used here.
  work([this] { refiner_.finish(); });
}

void MapRefinement::fail(std::exception_ptr error) noexcept {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++state_.failures;
  if (!unthrown_) unthrown_ = error;
  last_failure_ = std::move(error);
}

void MapRefinement::throwFailure() {
  if (options_.background) return;
  if (const std::exception_ptr error = std::exchange(unthrown_, nullptr)) {
    std::rethrow_exception(error);
  }
}

Rigid3 MapRefinement::predict(const Rigid3& T_odom_ref) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return state_.T_world_odom * T_odom_ref;
}

std::map<std::size_t, Rigid3> MapRefinement::takeMoved() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return std::exchange(moved_, {});
}

RefinementState MapRefinement::state() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  RefinementState state = state_;
  state.waiting = waiting_.size();
  state.last_error = textOf(last_failure_);
  return state;
}

/// @return true if the refiner has the keyframe. Otherwise the task has lost its points.
bool MapRefinement::refine(Task& task) {
  const std::size_t number = refiner_.keyframes();
  work([&] { refiner_.add(std::move(task.cloud), task.T_odom_ref, task.stated, task.T_last_ref); });
  task.cloud.clear();
  return refiner_.keyframes() > number;
}

/// Runs a step of the refiner, and publishes its results. Counts errors.
template <typename Step>
void MapRefinement::work(const Step& step) {
  StageTimes times;
  try {
    const StageScope scope(&times, &StageSeconds::refine, Processors::kThis);
    step();
  } catch (...) {
    fail(std::current_exception());
  }
  try {
    publish(times.real.refine, times.cpu.refine);
  } catch (...) {
    fail(std::current_exception());
  }
}

/// Copies the refiner's results for the other thread.
void MapRefinement::publish(double seconds, double cpu_seconds) {
  std::map<std::size_t, Rigid3> moved = refiner_.takeMoved();
  const std::lock_guard<std::mutex> lock(mutex_);
  moved.merge(moved_);  // a new pose replaces an earlier one
  moved_ = std::move(moved);
  state_.T_world_odom = refiner_.T_world_odom();
  state_.T_world_ref_denoised = refiner_.T_world_ref_denoised();
  state_.covariance = refiner_.covariance();
  state_.counts = refiner_.counts();
  state_.tracker = refiner_.trackerErrors();
  state_.seconds += seconds;
  state_.cpu_seconds += cpu_seconds;
  state_.most_seconds = std::max(state_.most_seconds, seconds);
}

void MapRefinement::runInBackground() {
  std::unique_lock<std::mutex> lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return stop_ || waiting_.size() > held_; });
    if (stop_) return;
    Task& task = waiting_.front();  // a deque does not move it when tasks are added
    const std::size_t waiting = waiting_.size();
    lock.unlock();
    const bool refined = refine(task);
    lock.lock();
    if (refined) waiting_.pop_front();
    held_ = refined ? 0 : waiting;  // tried again with the next keyframe
    changed_.notify_all();
  }
}

}  // namespace efm
