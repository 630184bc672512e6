// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/rays/rays.h"

#include <algorithm>
#include <cmath>

#include "mapping/base/option.h"

namespace efm {
namespace {

constexpr std::size_t kGridSide = 3;
static_assert(kGridSide * kGridSide == GridVotes::kRays);

/// If the speed changes by this fraction, parabolas have an error of 1 %.
constexpr double kEvenChange = 0.1;

bool isNear(const ReferenceView& view, double x, double y) {
  return x >= -view.width && x <= 2 * view.width && y >= -view.height && y <= 2 * view.height;
}

/// Squares of the largest displacements and speeds of votes, in pixels per half of the interval.
struct MaxSteps {
  double first = 0;   ///< Displacement from the start to the middle.
  double second = 0;  ///< Displacement from the middle to the end.
  double start = 0;   ///< Speed at the start.
  double end = 0;     ///< Speed at the end.
  double change = 0;  ///< Change of speed from the first to the second half.
  bool any = false;

  void add(const Eigen::Vector2d& first_half, const Eigen::Vector2d& second_half) {
    const Eigen::Vector2d half_change = 0.5 * (second_half - first_half);
    first = std::max(first, first_half.squaredNorm());
    second = std::max(second, second_half.squaredNorm());
    start = std::max(start, (first_half - half_change).squaredNorm());
    end = std::max(end, (second_half + half_change).squaredNorm());
    change = std::max(change, 4 * half_change.squaredNorm());
    any = true;
  }
};

}  // namespace

VoteGrid::VoteGrid(const UndistortionTable& undistortion, const ReferenceView& view,
                   double nearest_depth_m, double farthest_depth_m)
    : view_(view), depths_m_{nearest_depth_m, farthest_depth_m} {
  const auto spread = [](std::size_t i, int side) {
    return static_cast<int>(i) * (side - 1) / static_cast<int>(kGridSide - 1);
  };
  for (std::size_t i = 0; i < rays_cam_.size(); ++i) {
    const int x = spread(i % kGridSide, undistortion.width());
    const int y = spread(i / kGridSide, undistortion.height());
    rays_cam_[i] = undistortion.rayNear(x, y).homogeneous();
  }
}

GridVotes VoteGrid::votesFrom(const Rigid3& T_ref_cam) const {
  const Eigen::Matrix3d R_ref_cam = T_ref_cam.rotation.toRotationMatrix();
  const RayPacket forward{0, 0, T_ref_cam.translation, true};
  const std::array<PlaneTransfer, 2> transfers{transferToPlane(forward, view_, depths_m_[0]),
                                               transferToPlane(forward, view_, depths_m_[1])};
  GridVotes votes;
  for (std::size_t i = 0; i < rays_cam_.size(); ++i) {
    const Eigen::Vector3d direction_ref = R_ref_cam * rays_cam_[i];
    const Eigen::Vector2d at_infinity = view_.project(direction_ref);
    for (std::size_t plane = 0; plane < transfers.size(); ++plane) {
      const PlaneTransfer& transfer = transfers[plane];
      const std::size_t vote = plane * GridVotes::kRays + i;
      votes.x[vote] = transfer.scale * at_infinity.x() + transfer.offset_x;
      votes.y[vote] = transfer.scale * at_infinity.y() + transfer.offset_y;
      votes.in_front[vote] = transfer.scale * direction_ref.z() > 0;
      votes.near_view[vote] = isNear(view_, votes.x[vote], votes.y[vote]);
    }
  }
  return votes;
}

std::optional<VoteDisplacement> VoteDisplacement::measure(
    std::int64_t start_ns, std::int64_t end_ns, const std::array<const GridVotes*, 3>& votes) {
  const auto& [start, middle, end] = votes;
  MaxSteps near_view;
  MaxSteps anywhere;
  for (std::size_t i = 0; i < GridVotes::kVotes; ++i) {
    const bool in_front = middle->in_front[i];
    if (start->in_front[i] != in_front || end->in_front[i] != in_front) return std::nullopt;
    if (!in_front) continue;
    const Eigen::Vector2d first(middle->x[i] - start->x[i], middle->y[i] - start->y[i]);
    const Eigen::Vector2d second(end->x[i] - middle->x[i], end->y[i] - middle->y[i]);
    anywhere.add(first, second);
    if (start->near_view[i] || middle->near_view[i] || end->near_view[i]) {
      near_view.add(first, second);
    }
  }
  const MaxSteps& steps = near_view.any ? near_view : anywhere;
  const double half_ns = 0.5 * static_cast<double>(end_ns - start_ns);
  VoteDisplacement displacement;
  displacement.start_ns_ = start_ns;
  displacement.start_speed_ = std::sqrt(steps.start) / half_ns;
  displacement.acceleration_ =
      (std::sqrt(steps.end) / half_ns - displacement.start_speed_) / (2 * half_ns);
  displacement.from_middle_px_ = std::sqrt(std::max(steps.first, steps.second));
  displacement.even_ =
      steps.change <= kEvenChange * kEvenChange * std::max(steps.first, steps.second);
  return displacement;
}

namespace {

/// Splits the events of one camera during one segment of the trajectory into packets.
class PacketSplitter {
 public:
  PacketSplitter(EventSpan events, const CameraMotion& camera, const VoteGrid& grid,
                 double error_px, std::vector<PosePacket>& packets)
      : events_(events), camera_(camera), grid_(grid), error_px_(error_px), packets_(packets) {}

  /// Splits events [begin, end) at the middle of their time until the error of each part is within
  /// the bound. If votes move evenly, the error of smaller parts follows from the votes' speed.
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

/// Returns the index after the last event in the segment of event `begin`. An event at the
/// segment's end is in the next segment, but an event at the last pose is in the last segment.
std::size_t endOfSegment(EventSpan events, std::size_t begin, const TrajectorySegment& segment) {
  const std::int64_t end_ns = std::max(segment.last.t_ns, events[begin].t_ns + 1);
  return begin + events.part(begin, events.size()).indexOf(end_ns);
}

}  // namespace

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

namespace {

/// A ray of the reference view.
struct ProjectedRay {
  float x = 0;  ///< Pixel on the plane at infinity.
  float y = 0;
  float z = 0;  ///< Negative if the ray runs towards smaller z.
};

/// Maps a camera's rays to pixels on the reference view's plane at infinity: the homography of
/// Ghosh and Gallego 2022, Eq. 4, with Z at infinity. The principal point is added last, so that
/// rounding errors grow with the distance from it.
///
/// The type is float: the error is at most 3e-4 pixels at HD, and any x86-64 processor computes
/// four rays at once.
class InfinityHomography {
 public:
  InfinityHomography(const Rigid3& T_ref_cam, const ReferenceView& view)
      : cx_(static_cast<float>(view.cx)), cy_(static_cast<float>(view.cy)) {
    const Eigen::Matrix3d R_ref_cam = T_ref_cam.rotation.toRotationMatrix();
    const Eigen::Matrix3d H_ref_cam = Eigen::Vector3d(view.fx, view.fy, 1).asDiagonal() * R_ref_cam;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) H_ref_cam_[i][j] = static_cast<float>(H_ref_cam(i, j));
    }
  }

  ProjectedRay operator()(float ray_x, float ray_y) const {
    const auto row = [&](int i) {
      return H_ref_cam_[i][0] * ray_x + H_ref_cam_[i][1] * ray_y + H_ref_cam_[i][2];
    };
    const float z = row(2);
    const float inverse_z = 1.0F / z;
    return {row(0) * inverse_z + cx_, row(1) * inverse_z + cy_, z};
  }

 private:
  float H_ref_cam_[3][3];
  float cx_;
  float cy_;
};

/// Appends the rays of packets to a bundle.
class BundleBuilder {
 public:
  BundleBuilder(EventSpan events, const UndistortionTable& undistortion, const ReferenceView& view,
                RayBundle& bundle)
      : events_(events), undistortion_(undistortion), view_(view), bundle_(bundle) {}

  void append(const PosePacket& packet) {
    const InfinityHomography project(packet.T_ref_cam, view_);
    const std::size_t begin = bundle_.size();
    lookUp(packet);
    if (projectFrom(begin, project) == 0) {
      close(packet, begin, true);
      return;
    }
    // Rare: the camera looks sideways or back. Forward rays come first, then backward rays.
    resize(begin);
    appendDirection(packet, project, true);
    appendDirection(packet, project, false);
  }

 private:
  const Eigen::Vector2f& rayOf(const Event& event) const {
    return undistortion_
        .rays()[std::size_t{event.y} * static_cast<std::size_t>(undistortion_.width()) + event.x];
  }

  static bool isRay(const Eigen::Vector2f& ray) { return !std::isnan(ray.x()); }

  void resize(std::size_t rays) {
    bundle_.x_inf.resize(rays);
    bundle_.y_inf.resize(rays);
  }

  /// Appends the rays in frame `cam`. This loop is separate: table look-ups cannot be vectorised.
  void lookUp(const PosePacket& packet) {
    const std::size_t first = bundle_.size();
    resize(first + packet.end - packet.begin);
    float* x = bundle_.x_inf.data();
    float* y = bundle_.y_inf.data();
    std::size_t end = first;
    for (std::size_t i = packet.begin; i < packet.end; ++i) {
      const Eigen::Vector2f& ray = rayOf(events_[i]);
      x[end] = ray.x();
      y[end] = ray.y();
      end += isRay(ray) ? 1 : 0;  // otherwise the next ray overwrites it
    }
    resize(end);
  }

  /// Projects the rays from `begin` on, in place. `project` is a copy, so it stays in registers.
  /// @return the number of backward rays.
  std::uint32_t projectFrom(std::size_t begin, const InfinityHomography project) {
    const std::size_t count = bundle_.size() - begin;
    float* x = bundle_.x_inf.data() + begin;
    float* y = bundle_.y_inf.data() + begin;
    std::uint32_t backward = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const ProjectedRay ray = project(x[i], y[i]);
      x[i] = ray.x;
      y[i] = ray.y;
      backward += ray.z < 0 ? 1 : 0;
    }
    return backward;
  }

  void appendDirection(const PosePacket& packet, const InfinityHomography& project, bool forward) {
    const std::size_t begin = bundle_.size();
    for (std::size_t i = packet.begin; i < packet.end; ++i) {
      const Eigen::Vector2f& ray_cam = rayOf(events_[i]);
      if (!isRay(ray_cam)) continue;
      const ProjectedRay ray = project(ray_cam.x(), ray_cam.y());
      if ((ray.z < 0) == forward) continue;
      bundle_.x_inf.push_back(ray.x);
      bundle_.y_inf.push_back(ray.y);
    }
    close(packet, begin, forward);
  }

  void close(const PosePacket& packet, std::size_t begin, bool forward) {
    if (bundle_.size() == begin) return;
    bundle_.packets.push_back({begin, bundle_.size(), packet.T_ref_cam.translation, forward});
  }

  EventSpan events_;
  const UndistortionTable& undistortion_;
  ReferenceView view_;
  RayBundle& bundle_;
};

}  // namespace

RayBundle backProject(EventSpan events, const PosePackets& packets,
                      const UndistortionTable& undistortion, const ReferenceView& view) {
  std::size_t rays = 0;
  for (const PosePacket& packet : packets.packets) rays += packet.end - packet.begin;
  RayBundle bundle;
  bundle.x_inf.reserve(rays);
  bundle.y_inf.reserve(rays);
  bundle.packets.reserve(packets.packets.size());
  BundleBuilder builder(events, undistortion, view, bundle);
  for (const PosePacket& packet : packets.packets) builder.append(packet);
  return bundle;
}

}  // namespace efm
