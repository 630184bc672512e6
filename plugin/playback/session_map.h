// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "mapping/events/window.h"
#include "mapping/geometry/rigid3.h"
#include "mapping/geometry/trajectory.h"
#include "mapping/keyframes/keyframe_depth_map.h"
#include "maps/refinement/map_registration.h"
#include "plugin/session/event_fusion_options.h"
#include "plugin/session/map_snapshot.h"
#include "plugin/session_file/session_file.h"

namespace efm {

/// A box in the world, metres. Points on its surface belong to it.
struct Box {
  Eigen::Vector3d min_m, max_m;

  /// @param corners x0 y0 z0 x1 y1 z1. @throws std::invalid_argument unless they are a box.
  static Box of(const std::vector<double>& corners);
  bool contains(const Eigen::Vector3d& p_world) const;
};

/// Returns the session file that a path names: a file with the topic /efm/keyframe, or the
/// session.mcap of a folder. std::nullopt: it is neither.
std::optional<std::filesystem::path> sessionAt(const std::filesystem::path& path);

/// A map to make again from session files, without the recording.
struct SessionExport {
  /// One after the other: the keyframes of the next session follow those of the one before it. The
  /// options are those of the first one, and the highest depth.min_probability of all.
  std::vector<std::filesystem::path> sessions;
  /// "map.voxel_size_m=0.02": options of [map], and a higher depth.min_probability.
  std::vector<std::string> sets;
  TimeLimits limits;       ///< Keyframes whose t_ref is outside are left out.
  std::optional<Box> box;  ///< Points outside are left out.
  bool refined = true;     ///< false: the poses are the tracker's.
  /// Poses that replace those of the keyframes. In a simplemap, or if most of the poses between
  /// the first t_ref and the last lie at a t_ref, as in trajectory.txt: T_world_ref. Else those of
  /// the rig, interpolated. Empty: none.
  std::filesystem::path poses;
  /// Of the second session and further ones; none: identity.
  std::vector<std::optional<Rigid3>> T_first_this;
  bool registers = false;  ///< Correct T_first_this by the keyframes: `registerMap`.
  /// Called before each keyframe is read, with the part of the work that is done. May throw.
  std::function<void(double fraction)> on_progress = [](double) {};
};

/// The map of sessions, made again: that of a new run with these options, bit for bit
/// (docs/session.md names the exceptions). A refinement is that of the stored poses.
class SessionMap {
 public:
  /// Opens the sessions, and finds the options and the poses.
  /// @throws std::invalid_argument naming a wrong option; std::runtime_error naming a file that
  /// cannot be used.
  explicit SessionMap(SessionExport what);

  const SessionExport& what() const { return what_; }
  const EventFusionOptions& options() const { return options_; }
  const std::vector<std::unique_ptr<const SessionFile>>& sessions() const { return sessions_; }
  /// T_world_ref of the chosen keyframes, one session after the other.
  const std::vector<StampedPose>& trajectory() const { return T_world_ref_; }
  /// The registrations of the second session and further ones, by option.
  const std::vector<MapRegistration>& registrations() const { return registrations_; }

  /// Returns whether SessionExport::poses has poses of the keyframes; false: of the rig.
  bool posesAreOfKeyframes() const { return poses_are_of_keyframes_; }
  /// Adds SessionExport::poses to the session, as one more generation.
  void storePoses() const;

  /// Reads a chosen keyframe: with its poses in this map, and without the depths that are not
  /// probable enough.
  KeyframeDepthMap keyframe(std::size_t chosen) const;

  static constexpr std::size_t kOneSlab = std::numeric_limits<std::size_t>::max();
  /// Returns the points of a keyframe that the map is made of.
  std::vector<ViewPoint> pointsOf(const KeyframeDepthMap& keyframe) const;

  using OnKeyframe = std::function<void(std::size_t chosen, const KeyframeDepthMap& keyframe)>;
  /// Makes the points of the map slab by slab, from low x to high x, each sorted as in the map.
  /// Reads the keyframes again for each slab, but for those that do not reach it.
  /// @param max_voxels of a slab in the memory: it takes about 0.4 kB each.
  /// @param on_keyframe gets each keyframe once.
  /// @return keyframes without points in the map: see EventFusionOptions::min_keyframe_quality.
  std::set<std::size_t> visitSlabs(
      std::size_t max_voxels, const OnKeyframe& on_keyframe,
      const std::function<void(std::vector<CloudPoint>)>& on_slab) const;

  /// Makes the map in the memory.
  /// @param keeps_keyframes whether it has the points of each keyframe.
  /// @throws std::runtime_error if there is no point.
  /// @param left_out if given, gets what `visitSlabs` returns.
  MapSnapshot snapshot(bool keeps_keyframes, const OnKeyframe& on_keyframe = {},
                       std::set<std::size_t>* left_out = nullptr) const;
  /// Returns points of the map in their order, without those outside the box.
  /// @param origin of the whole map: `CloudOrigin`.
  MapCloud::Ptr cloudOf(const Eigen::Vector3f& origin, const std::vector<CloudPoint>& points) const;
  /// @throws std::runtime_error if there is no point.
  void requirePoints(std::size_t points) const;

 private:
  struct Chosen {
    std::size_t session, number;
  };

  void openSessions();
  void readOptions();
  void chooseKeyframes();
  void registerSession(std::size_t session);

  SessionExport what_;
  std::vector<std::unique_ptr<const SessionFile>> sessions_;
  EventFusionOptions options_;
  std::vector<Chosen> chosen_;
  std::vector<StampedPose> T_world_ref_;  // of the chosen keyframes
  std::vector<StampedPose> corrected_;    // of all, by SessionExport::poses
  bool poses_are_of_keyframes_ = true;
  std::vector<MapRegistration> registrations_;
};

}  // namespace efm
