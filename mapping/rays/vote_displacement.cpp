// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/rays/vote_displacement.h"

#include <algorithm>
#include <cmath>

#include "mapping/geometry/plane_transfer.h"

namespace efm {
namespace {

constexpr std::size_t kGridSide = 3;
static_assert(kGridSide * kGridSide == GridVotes::kRays);

/// With a change of speed by this fraction, parabolas err by a percent.
constexpr double kEvenChange = 0.1;

bool isNear(const ReferenceView& view, double x, double y) {
  return x >= -view.width && x <= 2 * view.width && y >= -view.height && y <= 2 * view.height;
}

/// Squares of the largest steps of votes, in pixels per half of the interval.
struct MaxSteps {
  double first = 0;   ///< From the start to the middle.
  double second = 0;  ///< From the middle to the end.
  double start = 0;   ///< The speed at the start and at the end.
  double end = 0;
  double change = 0;  ///< From the first to the second half.
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

}  // namespace efm
