// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <opencv2/core/types.hpp>

#include <random>
#include <vector>

#include "mapping/geometry/reference_view.h"
#include "mapping/rays/rays.h"

namespace efm::test {

/// The centre of a packet's rays, and the plane on which a test chooses the positions of the rays.
struct RaySource {
  Eigen::Vector3d center_ref = Eigen::Vector3d::Zero();
  bool forward = true;
  double depth_m = 1;
};

/// Appends a packet of rays that meet the source's plane at the points, in pixels of the view.
inline void appendPacket(const RaySource& source, const ReferenceView& view,
                         const std::vector<Eigen::Vector2d>& points, RayBundle& bundle) {
  const RayPacket packet{bundle.size(), bundle.size() + points.size(), source.center_ref,
                         source.forward};
  const PlaneTransfer transfer = transferToPlane(packet, view, source.depth_m);
  for (const Eigen::Vector2d& point : points) {
    bundle.x_inf.push_back(static_cast<float>((point.x() - transfer.offset_x) / transfer.scale));
    bundle.y_inf.push_back(static_cast<float>((point.y() - transfer.offset_y) / transfer.scale));
  }
  bundle.packets.push_back(packet);
}

/// Returns rays from the view's own centre. They are exactly at the same pixels on every plane.
inline RayBundle raysFromOrigin(const std::vector<Eigen::Vector2d>& points) {
  RayBundle bundle;
  appendPacket({}, ReferenceView{1, 1, 1, 1, 0, 0}, points, bundle);
  return bundle;
}

/// Random input of a sweep, from one seed.
class RandomRays {
 public:
  explicit RandomRays(std::uint32_t seed) : random_(seed) {}

  double uniform(double from, double to) {
    return std::uniform_real_distribution<double>(from, to)(random_);
  }
  int integer(int from, int to) { return std::uniform_int_distribution<int>(from, to)(random_); }

  /// Draws a view with a field of view of about 60 to 120 degrees.
  ReferenceView view(const cv::Size& size) {
    const double focal = std::max(size.width, size.height) * uniform(0.3, 0.9);
    return {size.width,
            size.height,
            focal,
            focal * uniform(0.95, 1.05),
            size.width * uniform(0.4, 0.6),
            size.height * uniform(0.4, 0.6)};
  }

  DepthPlanes planes() {
    const double nearest = uniform(0.2, 2);
    return DepthPlanes({nearest, nearest * uniform(1.1, 20), integer(1, 30),
                        uniform(0, 1) < 0.5 ? PlaneSpacing::kInverse : PlaneSpacing::kLinear});
  }

  /// Draws packets of up to 200 rays that meet a random plane in or near the view. In half of the
  /// bundles all centres are close to the view's centre. In the others some centres are between or
  /// behind the planes, and one packet of eight looks backward.
  RayBundle bundle(const ReferenceView& view, const DepthPlanes& planes, int rays) {
    const double nearest = planes.depth(0);
    const double farthest = planes.depth(planes.size() - 1);
    const bool calm = uniform(0, 1) < 0.5;
    const double radius = calm ? 0.3 * nearest : 1.5 * farthest;
    RayBundle bundle;
    while (rays > 0) {
      const int count = std::min(rays, integer(1, 200));
      rays -= count;
      RaySource source;
      source.center_ref = radius * Eigen::Vector3d(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1));
      source.forward = calm || integer(0, 7) != 0;
      source.depth_m = planes.depth(integer(0, planes.size() - 1));
      appendPacket(source, view, points(view, count), bundle);
    }
    return bundle;
  }

  /// Draws points in the view and in a margin of a tenth of its size.
  std::vector<Eigen::Vector2d> points(const ReferenceView& view, int count) {
    std::vector<Eigen::Vector2d> points;
    for (int i = 0; i < count; ++i) {
      points.emplace_back(uniform(-0.1, 1.1) * view.width, uniform(-0.1, 1.1) * view.height);
    }
    return points;
  }

 private:
  std::mt19937 random_;
};

}  // namespace efm::test
