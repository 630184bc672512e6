// SPDX-License-Identifier: BSD-3-Clause
#define PCL_NO_PRECOMPILE  // see EfmPcl.cmake
#include "plugin/evaluation/cloud_evaluation.h"

#include <fmt/format.h>
#include <pcl/console/print.h>
#include <pcl/features/normal_3d.h>
#include <pcl/kdtree/kdtree_flann.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/registration/correspondence_rejection.h>
#include <pcl/registration/icp.h>
#include <pcl/registration/transformation_estimation_point_to_plane_lls.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <stdexcept>
#include <vector>

#include "mapping/depth/peak_fit.h"

namespace efm {
namespace {

using PclPoint = pcl::PointNormal;
using PclCloud = pcl::PointCloud<PclPoint>;

constexpr std::size_t kMinPoints = 50;
constexpr std::size_t kMaxCompared = 20'000;
constexpr int kNormalNeighbors = 12;  // about two rings around a point of a grid
constexpr int kMaxRounds = 200;
/// A round that moves less than this is the last round. It is far below the errors of map points.
constexpr double kLastStepM = 1e-5;
constexpr double kLastStepRad = 1e-6;

/// ICP that gives access to the points that it used.
struct Icp : pcl::IterativeClosestPoint<PclPoint, PclPoint, double> {
  const pcl::Correspondences& used() const { return *correspondences_; }
};

/// Rejects pairs of points that are more than three times the median distance apart.
class FarFromMedian : public pcl::registration::CorrespondenceRejector {
 public:
  void getRemainingCorrespondences(const pcl::Correspondences& pairs,
                                   pcl::Correspondences& remaining) override {
    std::vector<float> squared_distances;
    for (const pcl::Correspondence& pair : pairs) squared_distances.push_back(pair.distance);
    remaining.clear();
    if (pairs.empty()) return;
    const float limit = 9 * upperMedian(squared_distances);
    std::copy_if(pairs.begin(), pairs.end(), std::back_inserter(remaining),
                 [limit](const pcl::Correspondence& pair) { return pair.distance <= limit; });
  }

 private:
  void applyRejection(pcl::Correspondences& remaining) override {
    getRemainingCorrespondences(*input_correspondences_, remaining);
  }
};

std::runtime_error undetermined() {
  return std::runtime_error(
      "the true surfaces near the map do not tell how it is moved along them: expected surfaces in "
      "three directions, not a single wall");
}

using PointToPlane =
    pcl::registration::TransformationEstimationPointToPlaneLLS<PclPoint, PclPoint, double>;

/// Rejects a step of ICP that is not finite: it would end the process in the next search.
struct CheckedPointToPlane : PointToPlane {
  using PointToPlane::estimateRigidTransformation;
  void estimateRigidTransformation(const PclCloud& map, const PclCloud& truth,
                                   const pcl::Correspondences& pairs,
                                   Eigen::Matrix4d& T_next_map) const override {
    constexpr double kMaxStepM = 1e9;  // the square of 200 such steps is still a finite float
    PointToPlane::estimateRigidTransformation(map, truth, pairs, T_next_map);
    if (!T_next_map.allFinite() || T_next_map.cwiseAbs().maxCoeff() > kMaxStepM) {
      throw undetermined();
    }
  }
};

PclCloud::Ptr pclCloudOf(const std::vector<Eigen::Vector3f>& points, std::size_t step) {
  auto cloud = pcl::make_shared<PclCloud>();
  cloud->reserve(points.size() / step + 1);
  for (std::size_t i = 0; i < points.size(); i += step) {
    PclPoint point;
    point.getVector3fMap() = points[i];
    cloud->push_back(point);
  }
  return cloud;
}

/// Sets each normal to the normal of the plane through the nearest points, with any sign.
void addNormals(const PclCloud::Ptr& cloud) {
  pcl::KdTreeFLANN<PclPoint> tree(false);
  tree.setInputCloud(cloud);
  pcl::Indices nearest;
  std::vector<float> squared_distances;
  for (PclPoint& point : *cloud) {
    tree.nearestKSearch(point, kNormalNeighbors, nearest, squared_distances);
    Eigen::Vector4f plane = Eigen::Vector4f::Zero();
    pcl::computePointNormal(*cloud, nearest, plane, point.curvature);
    point.getNormalVector3fMap() = plane.head<3>();
  }
}

/// Returns how well distances along the normals determine a motion. A motion of unit length changes
/// the distances by some mean square; the result is the smallest mean square of all such motions. A
/// rotation is measured by its displacement at the cloud's mean radius. The result is 1/3 for a
/// sphere's translation and 0 for one wall.
double leastDistance(const PclCloud& cloud, const pcl::Indices& indices) {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (const int i : indices) centre += cloud[i].getVector3fMap().cast<double>();
  centre /= static_cast<double>(indices.size());
  double squared_radius = 0;
  for (const int i : indices) {
    squared_radius += (cloud[i].getVector3fMap().cast<double>() - centre).squaredNorm();
  }
  const double radius = std::sqrt(squared_radius / static_cast<double>(indices.size()));
  Eigen::Matrix<double, 6, 6> information = Eigen::Matrix<double, 6, 6>::Zero();
  std::size_t count = 0;
  for (const int i : indices) {
    const Eigen::Vector3d normal = cloud[i].getNormalVector3fMap().cast<double>();
    if (!normal.allFinite()) continue;
    const Eigen::Vector3d offset = cloud[i].getVector3fMap().cast<double>() - centre;
    Eigen::Matrix<double, 6, 1> gradient;
    gradient << normal, offset.cross(normal) / radius;
    information += gradient * gradient.transpose();
    ++count;
  }
  if (count == 0 || !(radius > 0)) return 0;
  information /= static_cast<double>(count);
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>>(information).eigenvalues()[0];
}

/// Returns whether a step is small against the errors of map points. Pairs of points at the limit
/// of the rejection may come and go for ever, with such steps.
bool isSmall(const Eigen::Matrix4d& T_next_map) {
  constexpr double kStepM = 1e-3;
  constexpr double kStepRad = 2e-4;
  return T_next_map.topRightCorner<3, 1>().norm() < kStepM &&
         Eigen::AngleAxisd(Eigen::Matrix3d(T_next_map.topLeftCorner<3, 3>())).angle() < kStepRad;
}

Rigid3 aboutOrigin(const Eigen::Matrix4d& T_offset, const Eigen::Vector3d& origin) {
  const Eigen::Quaterniond rotation =
      Eigen::Quaterniond(T_offset.topLeftCorner<3, 3>()).normalized();
  return {rotation, T_offset.topRightCorner<3, 1>() + origin - rotation * origin};
}

}  // namespace

CloudAlignment alignCloud(const std::vector<CloudPoint>& map,
                          const std::vector<CloudPoint>& truth) {
  if (std::min(map.size(), truth.size()) < kMinPoints) {
    throw std::runtime_error(
        fmt::format("{} points of the map and {} true points: expected at least {} of each",
                    map.size(), truth.size(), kMinPoints));
  }
  const Eigen::Vector3d origin = medianPosition(truth);
  const PclCloud::Ptr surfaces = pclCloudOf(offsetsFrom(origin, truth), 1);
  addNormals(surfaces);
  const std::size_t step = std::max<std::size_t>(map.size() / kMaxCompared, 1);
  const PclCloud::Ptr points = pclCloudOf(offsetsFrom(origin, map), step);

  pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);  // errors are thrown, not printed
  Icp icp;
  icp.setInputSource(points);
  icp.setInputTarget(surfaces);
  icp.setTransformationEstimation(pcl::make_shared<CheckedPointToPlane>());
  icp.addCorrespondenceRejector(pcl::make_shared<FarFromMedian>());
  icp.setMaximumIterations(kMaxRounds);
  icp.setTransformationEpsilon(kLastStepM * kLastStepM);
  icp.setTransformationRotationEpsilon(std::cos(kLastStepRad));
  icp.getConvergeCriteria()->setFailureAfterMaximumIterations(true);
  icp.getConvergeCriteria()->setAbsoluteMSE(0);  // only the size of a step ends ICP
  PclCloud moved;
  icp.align(moved);
  const Eigen::Matrix4d T_offset = icp.getFinalTransformation();
  pcl::Indices matched;
  for (const pcl::Correspondence& pair : icp.used()) matched.push_back(pair.index_match);
  // One wall is not exactly 0, because its normals are noisy: 0.02 rad give 4e-4. Rooms and streets
  // have 0.03 and more.
  constexpr double kMinDistance = 2e-3;
  if (leastDistance(*surfaces, matched) < kMinDistance) throw undetermined();
  if (!icp.hasConverged() && !isSmall(icp.getLastIncrementalTransformation())) {
    throw std::runtime_error(
        fmt::format("the map cannot be aligned with the truth: ICP does not converge within {} "
                    "rounds: expected a map of the true surfaces in a frame near the truth's",
                    kMaxRounds));
  }

  CloudAlignment alignment;
  alignment.T_truth_map = aboutOrigin(T_offset, origin);
  alignment.points = points->size();
  alignment.points_used = matched.size();
  return alignment;
}

}  // namespace efm
