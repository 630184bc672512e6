// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "mapping/geometry/rigid3.h"
#include "maps/refinement/keyframe_registration.h"
#include "maps/refinement/loop_closing.h"
#include "maps/refinement/pose_refinement.h"
#include "maps/refinement/refined_keyframe.h"
#include "maps/refinement/registration_cloud.h"
#include "maps/refinement/tracker_errors.h"
#include "maps/refinement/window_graph.h"

namespace efm {

struct RefinementOptions {
  TrackerErrors tracker;      ///< What is expected of the poses that come in.
  bool adapt_tracker = true;  ///< Learn from the keyframes how large those errors are.
  RegistrationCloudOptions points;
  KeyframeRegistrationOptions registration;
  /// The last keyframes that are moved together; those before stay, until a loop is closed. Range:
  /// 1 to 1000.
  int window = 10;
  /// Of these keyframes, those that a new one is registered with: that have most of its points in
  /// view. Range: 1 to 100.
  int map_keyframes = 3;
  LoopOptions loop;
  PoseGraphOptions graph;

  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

struct RefinementCounts {
  std::uint64_t registered = 0;     ///< Keyframes whose points found their place in the map.
  std::uint64_t loop_checks = 0;    ///< Candidates that were registered.
  std::uint64_t loops = 0;          ///< Those that hold.
  std::uint64_t loops_dropped = 0;  ///< Of these, those that the rest contradicted.
};

/// Refines the poses of keyframes by their points, one after the other:
/// 1. the tracker's motion since the last keyframe says where the new one should be;
/// 2. it is registered with those of the last keyframes that share its view;
/// 3. the window of the last keyframes is solved: what registrations say of each two of them and of
///    older ones, and what the tracker says: its poses are right but for noise, one by one, and for
///    a drift, bit by bit;
/// 4. where it has come back to a place of long ago, and registration confirms it, all keyframes
///    since then are solved.
/// The first keyframe stays where the tracker put it. Where points say nothing, or nothing that can
/// be believed, the tracker's motion stands.
///
/// Deterministic. Cost of a keyframe: registrations of a bounded number of points, a window, and,
/// spread over the keyframes, loops in proportion to their length. Memory: 48 bytes a point. Not
/// thread-safe.
class KeyframeRefiner {
 public:
  /// @throws std::invalid_argument where the options are not valid.
  explicit KeyframeRefiner(const RefinementOptions& options);

  /// Takes the next keyframe; its number is the one before plus 1, the first one's 0.
  /// @param stated what the tracker itself says that this pose errs by, in place of what is
  /// expected of all; where errors are learnt, this is corrected by the factor that the expected
  /// ones are.
  /// @throws std::invalid_argument where the pose is not finite or beyond a million kilometres, or
  /// what is stated is not finite or below 0: nothing is taken then.
  void add(RegistrationCloud cloud, const Rigid3& T_odom_ref,
           const std::optional<PoseNoise>& stated = std::nullopt);
  /// Checks a loop that somebody else suspects, and closes it where it holds.
  /// @return whether it does.
  /// @throws std::invalid_argument where a keyframe is not there, or is the other one too.
  bool propose(const LoopCandidate& candidate);
  /// No more will come: solves all keyframes together.
  void finish();

  std::size_t keyframes() const { return keyframes_.size(); }
  /// The refined pose.
  const Rigid3& T_world_ref(std::size_t number) const { return keyframes_.at(number).T_world_ref; }
  /// Those that were moved since this was last asked, ascending: those added since too.
  std::vector<std::size_t> takeMoved();

  /// What brings the tracker's poses of now to the world of the refined ones; the identity before
  /// the first keyframe.
  Rigid3 T_world_odom() const;
  /// Where the tracker would have put the newest keyframe without noise; the identity before one.
  Rigid3 T_world_ref_denoised() const;
  /// Of a pose of the tracker that is there, after that correction, as `poseCovariance` has it:
  /// against the oldest keyframes that the last window leaves in place. Before the second keyframe
  /// that of a pose's noise.
  const Matrix6d& covariance() const { return covariance_; }
  const TrackerErrors& trackerErrors() const { return errors_; }
  const RefinementCounts& counts() const { return counts_; }

 private:
  double overlapOf(std::size_t newer, std::size_t older) const;
  std::vector<std::size_t> bestOverlaps(const std::vector<std::size_t>& older, double least,
                                        int count) const;
  std::vector<std::size_t> nearestBefore(std::size_t last) const;
  TrackerErrors cautiousErrors() const;
  PoseNoise timesOthers(const std::optional<PoseNoise>& stated) const;
  void registerNewest();
  void learnFrom(const RelativePoseFactor& factor);
  WindowGraph solveFrom(std::size_t first_free, const PoseGraphOptions& graph);
  void takeCovariance(const WindowGraph& window);
  void solveLoops();
  std::vector<RelativePoseFactor*> contradicted(double sigmas);
  bool check(const LoopCandidate& candidate);
  void closeLoops();
  void dropContradicted();

  RefinementOptions options_;
  std::vector<RefinedKeyframe> keyframes_;
  std::vector<RelativePoseFactor> factors_;  // by points; in the order of `to`, but loops proposed
  std::deque<MotionSample> samples_;
  TrackerErrors errors_;
  double drift_factor_ = 1;  // by which loops have shown drift to be larger than that
  Matrix6d covariance_;
  RefinementCounts counts_;
  std::optional<std::size_t> open_loop_;  // the oldest keyframe of loops that are not solved yet
  std::size_t solved_loops_at_ = 0;
};

}  // namespace efm
