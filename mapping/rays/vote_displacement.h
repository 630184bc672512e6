// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include <Eigen/Core>

#include "mapping/geometry/reference_view.h"
#include "mapping/geometry/rigid3.h"
#include "mapping/geometry/undistortion.h"

namespace efm {

/// The pixels of the reference view where the rays of a grid over the sensor, corners included,
/// meet the nearest and the farthest plane. A pixel outside the lens stands for the next one
/// inside.
struct GridVotes {
  static constexpr std::size_t kRays = 9;
  static constexpr std::size_t kVotes = 2 * kRays;

  std::array<double, kVotes> x{};
  std::array<double, kVotes> y{};
  std::array<bool, kVotes> in_front{};   ///< The plane lies before the camera, along the ray.
  std::array<bool, kVotes> near_view{};  ///< Inside the view or at most its own size away from it.
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

/// How far votes move with the camera in an interval of time: along parabolas through their pixels
/// at its start, middle and end. The vote that moves most counts. Votes far from the view count
/// only where no vote is near it.
class VoteDisplacement {
 public:
  /// @param votes at the start, in the middle and at the end.
  /// @return nothing where a vote comes or goes between the three times.
  static std::optional<VoteDisplacement> measure(std::int64_t start_ns, std::int64_t end_ns,
                                                 const std::array<const GridVotes*, 3>& votes);

  /// Pixels from the middle to the start or the end, whichever is farther.
  double fromMiddle() const { return from_middle_px_; }
  /// Whether the speed changes so little that the parabolas hold at all times: their error is about
  /// the square of the relative change.
  bool isEven() const { return even_; }
  /// A bound of the displacement between two times of the interval, pixels. Along parabolas the
  /// speed of the fastest vote is convex in time: interpolated between the ends it is never too
  /// small.
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

}  // namespace efm
