// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/rays/pose_packets.h"

#include <algorithm>
#include <optional>

#include "mapping/base/option_check.h"
#include "mapping/geometry/camera_motion.h"
#include "mapping/rays/vote_displacement.h"

namespace efm {
namespace {

/// Splits the events of one camera during one segment of the trajectory into packets.
class PacketSplitter {
 public:
  PacketSplitter(EventSpan events, const CameraMotion& camera, const VoteGrid& grid,
                 double error_px, std::vector<PosePacket>& packets)
      : events_(events), camera_(camera), grid_(grid), error_px_(error_px), packets_(packets) {}

  /// Splits events [begin, end) at the middle of their time until the error of each part is within
  /// the bound. Where votes move evenly, the error of smaller parts follows from their speed.
  void split(std::size_t begin, std::size_t end) const {
    const TimeSpan span = spanOf(begin, end);
    if (span.first_ns == span.last_ns) return append(begin, end, camera_.poseAt(span.first_ns));
    const Rigid3 T_ref_cam = camera_.poseAt(span.middle_ns);
    const std::optional<VoteDisplacement> displacement = measure(span, T_ref_cam);
    if (displacement && displacement->fromMiddle() <= error_px_)
      return append(begin, end, T_ref_cam);
    const std::size_t second_half = firstAfter(span.middle_ns, begin, end);
    if (displacement && displacement->isEven()) {
      splitBySpeed(*displacement, begin, second_half);
      splitBySpeed(*displacement, second_half, end);
    } else {
      split(begin, second_half);
      split(second_half, end);
    }
  }

 private:
  /// The times of a part's events.
  struct TimeSpan {
    std::int64_t first_ns;
    std::int64_t middle_ns;
    std::int64_t last_ns;
  };

  TimeSpan spanOf(std::size_t begin, std::size_t end) const {
    const std::int64_t first_ns = events_[begin].t_ns;
    const std::int64_t last_ns = events_[end - 1].t_ns;
    return {first_ns, first_ns + (last_ns - first_ns) / 2, last_ns};
  }

  std::size_t firstAfter(std::int64_t t_ns, std::size_t begin, std::size_t end) const {
    const Event* first =
        std::upper_bound(events_.begin() + begin, events_.begin() + end, t_ns,
                         [](std::int64_t time, const Event& event) { return time < event.t_ns; });
    return static_cast<std::size_t>(first - events_.begin());
  }

  std::optional<VoteDisplacement> measure(const TimeSpan& span, const Rigid3& T_ref_cam) const {
    const GridVotes first = grid_.votesFrom(camera_.poseAt(span.first_ns));
    const GridVotes middle = grid_.votesFrom(T_ref_cam);
    const GridVotes last = grid_.votesFrom(camera_.poseAt(span.last_ns));
    return VoteDisplacement::measure(span.first_ns, span.last_ns, {&first, &middle, &last});
  }

  void splitBySpeed(const VoteDisplacement& displacement, std::size_t begin,
                    std::size_t end) const {
    const TimeSpan span = spanOf(begin, end);
    if (span.first_ns == span.last_ns ||
        (displacement.between(span.first_ns, span.middle_ns) <= error_px_ &&
         displacement.between(span.middle_ns, span.last_ns) <= error_px_)) {
      return append(begin, end, camera_.poseAt(span.middle_ns));
    }
    const std::size_t second_half = firstAfter(span.middle_ns, begin, end);
    splitBySpeed(displacement, begin, second_half);
    splitBySpeed(displacement, second_half, end);
  }

  void append(std::size_t begin, std::size_t end, const Rigid3& T_ref_cam) const {
    packets_.push_back({begin, end, T_ref_cam});
  }

  EventSpan events_;
  const CameraMotion& camera_;
  const VoteGrid& grid_;
  double error_px_;
  std::vector<PosePacket>& packets_;
};

/// One past the last event in the segment of event `begin`. An event at the segment's end is in the
/// next segment; at the last pose it is in the last one.
std::size_t endOfSegment(EventSpan events, std::size_t begin, const TrajectorySegment& segment) {
  const std::int64_t end_ns = std::max(segment.last.t_ns, events[begin].t_ns + 1);
  const Event* end =
      std::lower_bound(events.begin() + begin, events.end(), end_ns,
                       [](const Event& event, std::int64_t t_ns) { return event.t_ns < t_ns; });
  return static_cast<std::size_t>(end - events.begin());
}

}  // namespace

void PosePacketsOptions::validate() const {
  requireOption(packet_error_px >= 0 && packet_error_px <= 10, "packet_error_px", packet_error_px,
                "0 to 10");
}

PosePackets splitIntoPosePackets(EventSpan events, const RigCamera& camera,
                                 const UndistortionTable& undistortion,
                                 const Trajectory& trajectory, const PacketGeometry& geometry,
                                 const PosePacketsOptions& options) {
  const VoteGrid grid(undistortion, geometry.view, geometry.nearest_depth_m,
                      geometry.farthest_depth_m);
  PosePackets result;
  std::size_t cursor = 0;
  std::size_t begin = 0;
  while (begin < events.size()) {
    const auto segment = trajectory.segmentAt(events[begin].t_ns, cursor);
    if (!segment) {
      ++result.without_pose;
      ++begin;
      continue;
    }
    const std::size_t end = endOfSegment(events, begin, *segment);
    const CameraMotion motion(*segment, geometry.T_ref_world, camera.T_rig_cam);
    PacketSplitter(events, motion, grid, options.packet_error_px, result.packets).split(begin, end);
    begin = end;
  }
  return result;
}

}  // namespace efm
