// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/map_refinement.h"

#include <utility>

#include "plugin/session/stage_timer.h"

namespace efm {
namespace {

/// More waiting keyframes lose their points.
constexpr std::size_t kMaxWaiting = 50;

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
  Task task{RegistrationCloud(keyframe, options_.refiner.points), keyframe.T_world_ref, stated};
  if (!options_.background) {
    refine(std::move(task));
    return refiner_.T_world_ref(refiner_.keyframes() - 1);
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  if (error_) std::rethrow_exception(error_);
  if (waiting_.size() >= kMaxWaiting) task.cloud = RegistrationCloud({}, options_.refiner.points);
  waiting_.push_back(std::move(task));
  changed_.notify_all();
  return state_.T_world_odom * keyframe.T_world_ref;
}

void MapRefinement::finish() {
  {
    std::unique_lock<std::mutex> lock(mutex_);
    changed_.wait(
        lock, [this] { return error_ || !options_.background || (waiting_.empty() && !busy_); });
    if (error_) std::rethrow_exception(error_);
  }
  // The thread is idle: the refiner may be used here.
  double seconds = 0;
  double cpu_seconds = 0;
  {
    const SecondsScope scope(seconds, cpu_seconds);
    refiner_.finish();
  }
  publish(seconds, cpu_seconds);
}

std::map<std::size_t, Rigid3> MapRefinement::takeMoved() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return std::exchange(moved_, {});
}

RefinementState MapRefinement::state() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  RefinementState state = state_;
  state.waiting = waiting_.size() + (busy_ ? 1 : 0);
  return state;
}

void MapRefinement::refine(Task task) {
  double seconds = 0;
  double cpu_seconds = 0;
  {
    const SecondsScope scope(seconds, cpu_seconds);
    refiner_.add(std::move(task.cloud), task.T_odom_ref, task.stated);
  }
  publish(seconds, cpu_seconds);
}

/// Copies the refiner's results for the other thread.
void MapRefinement::publish(double seconds, double cpu_seconds) {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (const std::size_t number : refiner_.takeMoved()) {
    moved_[number] = refiner_.T_world_ref(number);
  }
  state_.T_world_odom = refiner_.T_world_odom();
  state_.T_world_ref_denoised = refiner_.T_world_ref_denoised();
  state_.covariance = refiner_.covariance();
  state_.counts = refiner_.counts();
  state_.tracker = refiner_.trackerErrors();
  state_.seconds += seconds;
  state_.cpu_seconds += cpu_seconds;
}

void MapRefinement::runInBackground() {
  std::unique_lock<std::mutex> lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return stop_ || !waiting_.empty(); });
    if (stop_) return;
    Task task = std::move(waiting_.front());
    waiting_.pop_front();
    busy_ = true;
    lock.unlock();
    std::exception_ptr error;
    try {
      refine(std::move(task));
    } catch (...) {
      error = std::current_exception();
    }
    lock.lock();
    busy_ = false;
    changed_.notify_all();
    if (!error) continue;
    error_ = error;
    return;
  }
}

}  // namespace efm
