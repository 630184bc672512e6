// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "mapping/base/option.h"
#include "mapping/events/event.h"
#include "mapping/geometry/lens.h"
#include "mapping/geometry/reference_view.h"
#include "mapping/geometry/rig.h"
#include "mapping/geometry/rigid3.h"
#include "mapping/geometry/trajectory.h"

namespace efm {

/// The pixels of the reference view where the rays of a grid over the sensor, corners included,
/// meet the nearest and the farthest plane. A grid pixel outside the lens is replaced by the next
/// pixel inside, towards the optical axis.
struct GridVotes {
  static constexpr std::size_t kRays = 9;
  static constexpr std::size_t kVotes = 2 * kRays;

  std::array<double, kVotes> x{};
  std::array<double, kVotes> y{};
  std::array<bool, kVotes> in_front{};   ///< True if the plane is ahead along the ray.
  std::array<bool, kVotes> near_view{};  ///< True if inside the view or at most its size away.
};

class VoteGrid {
 public:
  VoteGrid(const UndistortionTable& undistortion, const ReferenceView& view, double nearest_depth_m,
           double farthest_depth_m);

  GridVotes votesFrom(const Rigid3& T_ref_cam) const;

 private:
  std::array<Eigen::Vector3d, GridVotes::kRays> rays_cam_;
  ReferenceView view_;
  std::array<double, 2> depths_m_;
};

/// The displacement of votes due to the camera's motion in an interval of time. Votes move along
/// parabolas through their pixels at the interval's start, middle and end. The vote that moves most
/// counts. Votes far from the view count only if no vote is near it.
class VoteDisplacement {
 public:
  /// @param votes votes at the start, in the middle and at the end.
  /// @return std::nullopt if a vote appears or disappears between the three times.
  static std::optional<VoteDisplacement> measure(std::int64_t start_ns, std::int64_t end_ns,
                                                 const std::array<const GridVotes*, 3>& votes);

  /// Returns the displacement from the middle to the start or to the end (the larger one), pixels.
  double fromMiddle() const { return from_middle_px_; }
  /// Returns whether the speed changes so little that the parabolas hold at all times. Their error
  /// is about the square of the relative change.
  bool isEven() const { return even_; }
  /// Returns an upper bound of the displacement between two times of the interval, pixels. Along
  /// parabolas the speed of the fastest vote is convex in time, so linear interpolation between the
  /// speeds at the ends is never too small.
  double between(std::int64_t t0_ns, std::int64_t t1_ns) const {
    const double middle_ns =
        0.5 * (static_cast<double>(t0_ns - start_ns_) + static_cast<double>(t1_ns - start_ns_));
    return static_cast<double>(t1_ns - t0_ns) * (start_speed_ + middle_ns * acceleration_);
  }

 private:
  std::int64_t start_ns_ = 0;
  double start_speed_ = 0;   // pixels per nanosecond
  double acceleration_ = 0;  // pixels per nanosecond^2
  double from_middle_px_ = 0;
  bool even_ = true;
};

struct PosePacketsOptions {
  /// Maximum error of a vote that results from a shared pose, in pixels of the reference view.
  /// Range: 0 to 10; 0 gives every event its own pose. The default keeps the L1 error of the DSI
  /// near 2e-3 of its mass. A larger value saves at most 3 % of a keyframe's processor time. On the
  /// simulated scenes 0.25 has the same depth errors, but on the real slider recording 0.05 already
  /// raises the wrong points of the paper's extraction from 22.7 to 23.5 %.
  double packet_error_px = 0.02;

  template <typename Self, typename Visit>
  static void fields(Self& self, Visit&& visit) {
    visit("packet_error_px", self.packet_error_px, Allowed::from(0, 10, "0 to 10"));
  }
  void validate() const { requireFields(*this); }
};

/// Consecutive events that share one pose.
struct PosePacket {
  std::size_t begin = 0;  ///< Index of the first event.
  std::size_t end = 0;    ///< One past the index of the last event.
  Rigid3 T_ref_cam;       ///< Pose of the event camera in the reference view.
};

/// The packets of one camera's events, in time order. Events between the packets have no pose.
struct PosePackets {
  std::vector<PosePacket> packets;
  std::uint64_t without_pose = 0;
};

/// The reference view and the depth range on which a packet's error is measured.
struct PacketGeometry {
  Rigid3 T_ref_world;
  ReferenceView view;
  double nearest_depth_m = 0;
  double farthest_depth_m = 0;
};

/// Splits events into packets. The events are in time order and already shifted by the camera's
/// time offset. A packet has the pose at the middle of its time. It ends where that pose would
/// misplace a vote by more than the bound. Events of small packets are kept, too.
///
/// The error is measured on a grid of rays over the whole sensor, at both ends of the packet. It is
/// measured on the nearest and the farthest plane, because a camera that rotates around a near
/// point moves votes only on the planes behind it. In an interval of even motion the error is
/// computed from the speed of the votes; this is exact to 1 %, and more often too large than too
/// small. A packet does not cross a recorded pose, so its motion is smooth, with the extremes at
/// the ends. Rays far outside the view count only if no ray is near the view.
PosePackets splitIntoPosePackets(EventSpan events, const RigCamera& camera,
                                 const UndistortionTable& undistortion,
                                 const Trajectory& trajectory, const PacketGeometry& geometry,
                                 const PosePacketsOptions& options);

/// One camera's events as rays of the reference view. A ray is its pixel on the plane at infinity;
/// a scale and an offset lead from it to the pixel on any other plane (`transferToPlane`).
///
/// This is the first step of the transfer of Rebecq et al. (IJCV 2018, Eq. 15). Z0 is the plane at
/// infinity, because no camera centre can lie on it. Rays parallel to the planes get non-finite
/// coordinates and are never inside a view.
struct RayBundle {
  std::vector<float> x_inf;  ///< Pixels of the reference view.
  std::vector<float> y_inf;
  std::vector<RayPacket> packets;

  std::size_t size() const { return x_inf.size(); }
};

/// One camera's rays, one bundle per slot. A slot is a sub-interval of one group of events
/// (`EventGroups`). All cameras of a sweep have the same number of slots.
using CameraRays = std::vector<RayBundle>;

/// Back-projects the events of the packets. Events between packets and events outside the lens are
/// left out. All events must lie inside the sensor.
RayBundle backProject(EventSpan events, const PosePackets& packets,
                      const UndistortionTable& undistortion, const ReferenceView& view);

}  // namespace efm
