// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "mapping/base/option.h"
#include "mapping/geometry/rigid3.h"
#include "maps/refinement/keyframe_graph.h"
#include "maps/refinement/keyframe_registration.h"
#include "maps/refinement/loop_closing.h"
#include "maps/refinement/pose_refinement.h"
#include "maps/refinement/registration_points.h"
#include "maps/refinement/tracker_model.h"

namespace efm {

struct RefinementOptions {
  TrackerErrors tracker;      ///< The expected errors of the incoming poses.
  bool adapt_tracker = true;  ///< True: these errors are learnt from the keyframes.
  RegistrationCloudOptions points;
  KeyframeRegistrationOptions registration;
  /// Number of last keyframes that are solved together. Earlier keyframes stay until a loop closes.
  /// Range: 1 to 1000.
  int window = 10;
  /// Number of keyframes of the window that a new keyframe is registered with, by largest overlap.
  /// Range: 1 to 100.
  int map_keyframes = 3;
  LoopOptions loop;
  PoseGraphOptions graph;

  template <typename Self, typename Visit>
  static void fields(Self& self, Visit&& visit) {
    visit("window", self.window, Allowed::from(1, 1000, "from 1 to 1000 (keyframes)"));
    visit("map_keyframes", self.map_keyframes, Allowed::from(1, 100, "from 1 to 100"));
    visit(self.points);
    visit(self.tracker);
    visit("adapt_tracker", self.adapt_tracker);
    visit(self.registration);
    visit(self.loop);
    visit(self.graph);
  }
  void validate() const { requireFields(*this); }
};

/// Finds loops, verifies them, and solves the keyframes since the oldest new loop.
class LoopCloser {
 public:
  explicit LoopCloser(const RefinementOptions& options) : options_(options) {}

  /// Checks the earlier keyframes with the largest overlap with the newest one.
  void search(KeyframeGraph& graph);
  /// Registers the keyframes of a candidate with each other. Adds a factor if the results agree.
  /// @return whether the results agree.
  bool check(KeyframeGraph& graph, const LoopCandidate& candidate);
  /// Solves new loops if the path has grown enough since the last time.
  /// @return the solved graph; std::nullopt if nothing was solved.
  std::optional<WindowGraph> solveWhenDue(KeyframeGraph& graph);
  /// Solves all keyframes.
  /// @param graph has at least two keyframes.
  WindowGraph solveAll(KeyframeGraph& graph);

  /// The counts of loops; the other counts are 0.
  const RefinementCounts& counts() const { return counts_; }

 private:
  WindowGraph solve(KeyframeGraph& graph, std::size_t first_free);

  RefinementOptions options_;
  RefinementCounts counts_;
  std::optional<std::size_t> oldest_unsolved_;  // the oldest keyframe of the new loops
  std::size_t solved_at_ = 0;                   // the newest keyframe at the last solve
};

/// Refines the poses of keyframes by their points, one keyframe after the other:
/// 1. The motion of the tracker since the last keyframe predicts the pose.
/// 2. The keyframe is registered with the last keyframes that share its view.
/// 3. The window of the last keyframes is solved (WindowGraph): the registrations, and the motions
///    of the tracker with their noise and drift.
/// 4. A loop back to an earlier keyframe is verified by registration. Then all keyframes since that
///    keyframe are solved (LoopCloser).
/// The first keyframe keeps its pose by the tracker. Without a plausible registration the motion of
/// the tracker is kept.
///
/// Deterministic. A keyframe costs registrations of a bounded number of points and one window. The
/// cost of a loop is proportional to its length and is spread over the keyframes. Memory: 48 bytes
/// per point. Not thread-safe.
class KeyframeRefiner {
 public:
  explicit KeyframeRefiner(const RefinementOptions& options);

  /// Checks the input of `add`. @throws std::invalid_argument if the pose is not finite or beyond a
  /// million kilometres, or the stated noise is not finite or below 0.
  static void requireUsable(const Rigid3& T_odom_ref, const std::optional<PoseNoise>& stated);

  /// Adds the next keyframe. Numbers count from 0.
  /// @param stated the noise of this pose as the tracker states it. It replaces the expected noise.
  /// If errors are learnt, it is corrected by the same factor.
  /// @param T_last_ref pose relative to the last keyframe by events that both windows have.
  /// @throws std::invalid_argument as `requireUsable`. Then the keyframe is not added. After any
  /// other error, `keyframes` shows whether it was added. If so, it has lost its points, and keeps
  /// the tracker's motion. In both cases the next keyframe may be added.
  void add(RegistrationCloud cloud, const Rigid3& T_odom_ref,
           const std::optional<PoseNoise>& stated = std::nullopt,
           const std::optional<Rigid3>& T_last_ref = std::nullopt);
  /// Checks a loop that the caller proposes.
  /// @return whether it was verified.
  bool propose(const LoopCandidate& candidate);
  /// Solves all keyframes together, after the last one.
  void finish();

  std::size_t keyframes() const { return graph_.keyframes.size(); }
  /// Returns the refined pose.
  const Rigid3& T_world_ref(std::size_t number) const {
    return graph_.keyframes.at(number).T_world_ref;
  }
  /// Returns T_world_ref of the keyframes that were added or moved since the last call, by number.
  std::map<std::size_t, Rigid3> takeMoved();

  /// Returns the transform from tracker poses to the refined world; the identity without keyframes.
  Rigid3 T_world_odom() const;
  /// Returns the newest keyframe's tracker pose without noise; the identity without keyframes.
  Rigid3 T_world_ref_denoised() const {
    return graph_.keyframes.empty() ? Rigid3{} : graph_.keyframes.back().T_world_ref_denoised;
  }
  /// Returns the covariance of a corrected pose of the tracker at the newest keyframe, as in
  /// `poseCovariance`, relative to the oldest fixed keyframes of the last window. With fewer than
  /// two keyframes it is the covariance of the noise.
  const Matrix6d& covariance() const { return covariance_; }
  const TrackerErrors& trackerErrors() const { return graph_.tracker.errors(); }
  RefinementCounts counts() const;

 private:
  static void predict(const RefinedKeyframe& last, RefinedKeyframe& keyframe);
  void refineNewest(const std::optional<Rigid3>& T_last_ref);
  void dropNewestPoints();
  void useCommonEvents(const Rigid3& T_last_ref);
  void registerNewest();
  Registration registrationOf(const std::vector<MapKeyframe>& map,
                              const Matrix6d& covariance) const;
  void updateCovariance(const WindowGraph& solved);

  RefinementOptions options_;
  KeyframeGraph graph_;
  LoopCloser loops_;
  Matrix6d covariance_;
  std::uint64_t registered_ = 0;
};

}  // namespace efm
