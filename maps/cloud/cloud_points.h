// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "mapping/base/option.h"

namespace efm {

/// A point on its way into a map, or from a file of any origin. Double, because maps may lie far
/// from the origin of the world. A map gives its points as a cloud of PCL (`MapPoint`).
struct CloudPoint {
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();  ///< Metres, frame `world`.
  float confidence = 0;                               ///< Fused ray density at the point, above 0.
  std::uint32_t support = 1;                          ///< Number of keyframes that saw it.
  /// In a global cloud, the lowest number of a keyframe that saw the point.
  std::uint64_t first_keyframe = 0;
  /// Standard deviation of depth, metres; NaN if it is not known.
  float sigma = std::numeric_limits<float>::quiet_NaN();
  /// Probability that the depth is right (`DepthMap::probability`); NaN if it is not known.
  float probability = std::numeric_limits<float>::quiet_NaN();
};

/// A point of a keyframe in its reference view. It is float like the depth map, so a stored
/// keyframe has exactly the points of the map, anywhere in the world.
struct ViewPoint {
  Eigen::Vector3f p_ref = Eigen::Vector3f::Zero();  ///< Metres, frame `ref`.
  float confidence = 0;                             ///< Fused ray density at the point, above 0.
  /// Standard deviation of depth, metres; NaN if it is not known.
  float sigma = std::numeric_limits<float>::quiet_NaN();
  float probability = std::numeric_limits<float>::quiet_NaN();  ///< See CloudPoint.
};

/// Returns a text for messages, with all digits: "(1, 2.5, -3) with confidence 7".
std::string pointText(const CloudPoint& point);

struct OutlierRemovalOptions {
  /// Points with too few neighbours within this distance are removed. Metres; 0 (no point is
  /// removed) or 1e-6 to 1e6. There is no default: it depends on the depth of the scene.
  double outlier_radius_m = 0;
  /// A point is kept if at least this number of other points lie within the radius. Range: 1 to
  /// 10000. The default is that of the published code of EMVS (Rebecq et al., IJCV 2018).
  int outlier_min_neighbors = 3;

  template <typename Self, typename Visit>
  static void fields(Self& self, Visit&& visit) {
    visit("outlier_radius_m", self.outlier_radius_m,
          Allowed::from(1e-6, 1e6, "0 or from 1e-6 to 1e6 (metres)").orZero());
    visit("outlier_min_neighbors", self.outlier_min_neighbors,
          Allowed::from(1, 10'000, "from 1 to 10000"));
  }
  void validate() const { requireFields(*this); }
};

/// Returns the points that are not isolated, in the same order. Use it on the cloud of one keyframe
/// before the cloud is merged with others: no edge of its depth map supports an isolated point.
///
/// Distances are computed in float, relative to the median position: they are exact to 1e-7 of the
/// extent of the cloud at any distance from the origin of the world.
std::vector<CloudPoint> removeOutliers(std::vector<CloudPoint> points,
                                       const OutlierRemovalOptions& options);

// The searches of PCL. They work on floats, which are precise near the origin only.

/// Returns the median of each coordinate. A few points far away do not move it, unlike the mean.
/// @param points at least one.
Eigen::Vector3d medianPosition(const std::vector<CloudPoint>& points);

/// Returns the positions relative to `origin`, in the same order.
std::vector<Eigen::Vector3f> offsetsFrom(const Eigen::Vector3d& origin,
                                         const std::vector<CloudPoint>& points);

/// A k-d tree.
class PointTree {
 public:
  struct Neighbor {
    std::size_t index = 0;
    float squared_distance = 0;
  };

  /// @param points at least one, all finite.
  explicit PointTree(const std::vector<Eigen::Vector3f>& points);
  ~PointTree();

  /// @param point finite.
  Neighbor nearest(const Eigen::Vector3f& point) const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

}  // namespace efm
