// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pcl/point_cloud.h>
#include <pcl/register_point_struct.h>

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <vector>

#include "maps/cloud/cloud_points.h"

namespace pcl {
struct PointXYZI;
}

namespace efm {

/// A point of a map, registered as a point type of PCL: x, y, z, intensity, support, sigma and
/// probability are its fields in PCL's files. PCL's own templates compile for it if
/// PCL_NO_PRECOMPILE is defined before the first header of PCL.
///
/// The members of PCL_ADD_POINT4D are written out: the header of that macro takes 2 s to compile.
struct EIGEN_ALIGN16 MapPoint {
  __extension__ union EIGEN_ALIGN16 {
    float data[4] = {0, 0, 0, 1};
    __extension__ struct {
      float x, y, z;  ///< Metres, frame `world`, relative to the cloud's `sensor_origin_`.
    };
  };
  float intensity = 0;        ///< The confidence: fused ray density at the point.
  std::uint32_t support = 1;  ///< Number of keyframes that saw it.
  /// Standard deviation of its depth, metres; NaN if it is not known. See GlobalCloud.
  float sigma = std::numeric_limits<float>::quiet_NaN();
  /// Probability that its depth is right; NaN if it is not known. See GlobalCloud.
  float probability = std::numeric_limits<float>::quiet_NaN();
  std::uint32_t first_keyframe = 0;  ///< Lowest number of a keyframe that saw it; no field.

  auto getVector3fMap() { return Eigen::Vector3f::Map(data); }
  auto getVector3fMap() const { return Eigen::Vector3f::Map(data); }
  auto getVector4fMap() { return Eigen::Vector4f::MapAligned(data); }
  auto getVector4fMap() const { return Eigen::Vector4f::MapAligned(data); }
  auto getArray3fMap() { return Eigen::Array3f::Map(data); }
  auto getArray3fMap() const { return Eigen::Array3f::Map(data); }
  auto getArray4fMap() { return Eigen::Array4f::MapAligned(data); }
  auto getArray4fMap() const { return Eigen::Array4f::MapAligned(data); }
  PCL_MAKE_ALIGNED_OPERATOR_NEW
};

/// The cloud of a map or of a keyframe. `sensor_origin_` is the origin of its points in the world:
/// 0, or if they are far away, a position near them (`mapCloudOf`). `sensor_orientation_` is the
/// identity.
using MapCloud = pcl::PointCloud<MapPoint>;

/// Returns p_world of a point, metres.
inline Eigen::Vector3d positionIn(const MapCloud& cloud, const MapPoint& point) {
  return cloud.sensor_origin_.head<3>().cast<double>() + point.getVector3fMap().cast<double>();
}

/// Finds the origin for points of a cloud, which may come in parts: 0, or if floats are too coarse
/// for them (`coarseStepOf`), their median position, rounded to a multiple of a power of ten that
/// is fine enough itself. So it has few digits: PCL's programs write at most six.
class CloudOrigin {
 public:
  /// @param resolution_m for example the size of a voxel; above 0.
  explicit CloudOrigin(double resolution_m);
  void add(const std::vector<CloudPoint>& points);
  Eigen::Vector3f origin() const;

 private:
  double resolution_m_, unit_m_;
  std::size_t points_ = 0;
  std::size_t coarse_ = 0;                               // points for which floats are too coarse
  std::size_t far_ = 0;                                  // points that may not round to 0
  std::array<std::map<double, std::size_t>, 3> counts_;  // of these, by rounded coordinates
};

/// Returns the points in their order, with the origin of `CloudOrigin`.
MapCloud::Ptr mapCloudOf(const std::vector<CloudPoint>& points, double resolution_m);
/// Returns the points in their order, relative to an origin of few digits.
MapCloud::Ptr mapCloudAt(const Eigen::Vector3f& origin, const std::vector<CloudPoint>& points);

/// Returns the step of floats at the world coordinates of a map, metres, if it is more than a tenth
/// of the resolution: programs that use floats round these points. Considers 99.9 % of the points,
/// as a few wrong points may lie anywhere.
std::optional<double> coarseStepOf(const MapCloud& cloud, double resolution_m);
/// Returns the same for one coordinate.
std::optional<double> coarseStepAt(double coordinate_m, double resolution_m);

/// Converts a map for functions of PCL that take this type alone, with the same `sensor_origin_`.
pcl::PointCloud<pcl::PointXYZI>::Ptr xyziCloudOf(const MapCloud& cloud);

}  // namespace efm

POINT_CLOUD_REGISTER_POINT_STRUCT(efm::MapPoint, (float, x, x)(float, y, y)(float, z, z)  //
                                  (float, intensity, intensity)                           //
                                  (std::uint32_t, support, support)                       //
                                  (float, sigma, sigma)(float, probability, probability))
