// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <map>
#include <mutex>
#include <optional>
#include <thread>

#include "mapping/keyframes/keyframe_depth_map.h"
#include "maps/refinement/keyframe_refiner.h"

namespace efm {

struct MapRefinementOptions {
  bool enabled = false;
  /// Refine beside the mapping, in a thread of its own, as fast as that goes: for live operation.
  /// Otherwise each keyframe is refined before the next one is made, and the same recording gives
  /// the same map.
  bool background = false;
  RefinementOptions refiner;

  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const { refiner.validate(); }
};

/// What a refinement knows by now.
struct RefinementState {
  Rigid3 T_world_odom;          ///< Takes the tracker's newest poses to the refined world.
  Rigid3 T_world_ref_denoised;  ///< The newest keyframe's, less its noise.
  Matrix6d covariance = Matrix6d::Zero();  ///< Of a pose there; see KeyframeRefiner.
  RefinementCounts counts;
  TrackerErrors tracker;    ///< As they seem to be.
  std::size_t waiting = 0;  ///< Keyframes that are not refined yet.
  double seconds = 0;       ///< Spent on it.
};

/// The covariance of a pose of the tracker after the correction: that of the newest keyframe,
/// turned about it with a lever, and what the way from there adds. As `poseCovariance` has it.
Matrix6d covarianceAt(const RefinementState& state, const Rigid3& T_world_rig);

/// Refines keyframes as they are made, beside the mapping where that is asked for. For one thread,
/// which it never lets wait but in `add` without a background, and in `finish`. Where the
/// background falls 50 keyframes behind, the next ones are given no points: the tracker's motion
/// stands there.
class MapRefinement {
 public:
  /// @throws std::invalid_argument where the options are not valid.
  explicit MapRefinement(const MapRefinementOptions& options);
  /// Leaves what is waiting unrefined.
  ~MapRefinement();
  MapRefinement(const MapRefinement&) = delete;
  MapRefinement& operator=(const MapRefinement&) = delete;

  /// Takes the next keyframe; their numbers count from 0.
  /// @param stated what the tracker says of its pose.
  /// @return T_world_ref as far as it is known now.
  /// @throws what refining an earlier keyframe in the background threw.
  Rigid3 add(const KeyframeDepthMap& keyframe, const std::optional<PoseNoise>& stated);
  /// Waits for all of them and solves them together. @throws as `add`.
  void finish();

  /// T_world_ref of the keyframes that were moved since this was asked last, by their numbers.
  std::map<std::size_t, Rigid3> takeMoved();
  RefinementState state() const;

 private:
  struct Task {
    RegistrationCloud cloud;
    Rigid3 T_odom_ref;
    std::optional<PoseNoise> stated;
  };

  void refine(Task task);
  void publish(double seconds);
  void runInBackground();

  MapRefinementOptions options_;
  KeyframeRefiner refiner_;  // of the thread while there is one

  mutable std::mutex mutex_;  // of what follows
  std::condition_variable changed_;
  std::deque<Task> waiting_;
  bool busy_ = false;
  bool stop_ = false;
  std::exception_ptr error_;
  std::map<std::size_t, Rigid3> moved_;
  RefinementState state_;

  std::thread thread_;
};

}  // namespace efm
