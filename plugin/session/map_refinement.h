// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <exception>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "mapping/keyframes/keyframe_depth_map.h"
#include "maps/refinement/keyframe_refiner.h"
#include "maps/refinement/refinement_state.h"

namespace efm {

struct MapRefinementOptions {
  bool enabled = false;
  /// True: refine in a background thread while the mapping continues (live operation). False:
  /// refine each keyframe before the next one is made; the same recording gives the same map.
  bool background = false;
  RefinementOptions refiner;
};

/// Returns the covariance of a corrected pose of the tracker, in the order of `poseCovariance`: the
/// newest keyframe's covariance, moved to the rig along the lever arm between both, plus the drift
/// over the distance from the keyframe.
Matrix6d covarianceAt(const RefinementState& state, const Rigid3& T_world_rig);

/// What a keyframe's window says about the motion.
struct WindowMotion {
  explicit WindowMotion(const KeyframeDepthMap& keyframe);

  std::int64_t t_ref_ns;
  Rigid3 T_world_ref;  ///< By the tracker.
  Rigid3 T_rig_ref;
  std::optional<MotionCorrection> correction;
};

/// Returns the motion between the reference times of two windows by the events around these times:
/// the mean of what both windows say. A correction far beyond the expected errors of the tracker
/// does not count: wrong depths may have bent it.
/// @return std::nullopt if no window has such a corrected motion that reaches the other's time.
std::optional<Rigid3> motionBetween(const WindowMotion& from, const WindowMotion& to);

/// Refines keyframes one after the other, optionally in a background thread. One thread calls it.
/// `finish` waits for the refinement; `add` waits only without the background thread. If the
/// background thread is 50 keyframes behind, further keyframes are added without their points: they
/// keep the tracker's motion. If the refinement of a keyframe fails, it keeps the tracker's motion,
/// too; the next keyframe is refined again. `state` counts failures. Without the background thread,
/// `throwFailure` throws them.
class MapRefinement {
 public:
  explicit MapRefinement(const MapRefinementOptions& options);
  /// Leaves waiting keyframes unrefined.
  ~MapRefinement();
  MapRefinement(const MapRefinement&) = delete;
  MapRefinement& operator=(const MapRefinement&) = delete;

  /// Adds the next keyframe; keyframes are numbered from 0.
  /// @param stated noise that the tracker states for the keyframe's pose.
  /// @return T_world_ref as known now.
  /// @throws std::invalid_argument as KeyframeRefiner::requireUsable. After any error the keyframe
  /// is not added.
  Rigid3 add(const KeyframeDepthMap& keyframe, const std::optional<PoseNoise>& stated);
  /// Waits for all keyframes and solves them together.
  void finish();

  /// Counts an error of the caller that could not use a refined pose.
  void fail(std::exception_ptr error) noexcept;
  /// Throws the first failure since the last call, but nothing with a background thread.
  void throwFailure();

  /// Returns T_world_ref of a keyframe that is not added yet, from its pose by the tracker.
  Rigid3 predict(const Rigid3& T_odom_ref) const;

  /// Returns T_world_ref of the keyframes that moved since the last call, by their numbers.
  std::map<std::size_t, Rigid3> takeMoved();
  RefinementState state() const;

 private:
  struct Task {
    RegistrationCloud cloud;
    Rigid3 T_odom_ref;
    std::optional<PoseNoise> stated;
    std::optional<Rigid3> T_last_ref;
  };

  bool refine(Task& task);
  template <typename Step>
  void work(const Step& step);
  void publish(double seconds, double cpu_seconds);
  void runInBackground();

  MapRefinementOptions options_;
  std::optional<WindowMotion> last_;
  KeyframeRefiner refiner_;  // used by the background thread alone, if there is one

  mutable std::mutex mutex_;  // guards the members below
  std::condition_variable changed_;
  std::deque<Task> waiting_;  // the first one is being refined
  std::size_t held_ = 0;      // number that waits for another keyframe: no memory for the first one
  bool stop_ = false;
  std::exception_ptr last_failure_;
  std::exception_ptr unthrown_;
  std::map<std::size_t, Rigid3> moved_;
  RefinementState state_;

  std::thread thread_;
};

}  // namespace efm
