// SPDX-License-Identifier: BSD-3-Clause
// A program that makes a map with the builder and works on it with PCL's own classes.
//
//     pcl_host CONFIG.ini RECORDING.rawlog
//
// prints the result of each class.

#define PCL_NO_PRECOMPILE  // before PCL: its templates are compiled for the points of a map

#include <mrpt/config/CConfigFile.h>
#include <mrpt/io/CFileGZInputStream.h>
#include <mrpt/obs/CRawlog.h>
#include <mrpt/serialization/CArchive.h>
#include <pcl/common/transforms.h>
#include <pcl/filters/radius_outlier_removal.h>
#include <pcl/filters/statistical_outlier_removal.h>
#include <pcl/filters/voxel_grid.h>
#include <pcl/kdtree/kdtree_flann.h>
#include <pcl/octree/octree_search.h>
#include <pcl/registration/icp.h>

#include <iostream>
#include <string>

#include "plugin/mrpt/CEventFusionMapBuilder.h"

using efm::MapCloud;
using efm::MapPoint;

namespace {

MapCloud::ConstPtr mapOf(const std::string& config, const std::string& recording) {
  efm::CEventFusionMapBuilder builder;
  builder.loadFromConfigFile(mrpt::config::CConfigFile(config), "");
  mrpt::io::CFileGZInputStream stream(recording);
  auto archive = mrpt::serialization::archiveFrom(stream);
  mrpt::obs::CActionCollection::Ptr action;
  mrpt::obs::CSensoryFrame::Ptr frame;
  mrpt::obs::CObservation::Ptr observation;
  std::size_t entry = 0;
  while (mrpt::obs::CRawlog::getActionObservationPairOrObservation(archive, action, frame,
                                                                   observation, entry)) {
    if (observation) builder.processObservation(observation);
  }
  builder.finish();
  return builder.points();
}

void filter(const MapCloud::ConstPtr& map) {
  MapCloud filtered;
  pcl::VoxelGrid<MapPoint> grid;
  grid.setInputCloud(map);
  grid.setLeafSize(0.2F, 0.2F, 0.2F);
  grid.filter(filtered);
  std::cout << "voxel grid: " << filtered.size() << "\n";

  pcl::RadiusOutlierRemoval<MapPoint> radius;
  radius.setInputCloud(map);
  radius.setRadiusSearch(0.2);
  radius.setMinNeighborsInRadius(1);
  radius.filter(filtered);
  std::cout << "with a neighbour: " << filtered.size() << "\n";

  pcl::StatisticalOutlierRemoval<MapPoint> statistical;
  statistical.setInputCloud(map);
  statistical.setMeanK(4);
  statistical.filter(filtered);
  std::cout << "near their neighbours: " << filtered.size() << "\n";
}

void search(const MapCloud::ConstPtr& map) {
  constexpr double kRadiusM = 0.5;
  const MapPoint& middle = map->at(map->size() / 2);
  pcl::Indices indices;
  std::vector<float> squared_distances;
  pcl::KdTreeFLANN<MapPoint> tree;
  tree.setInputCloud(map);
  std::cout << "neighbours in the k-d tree: "
            << tree.radiusSearch(middle, kRadiusM, indices, squared_distances) << "\n";

  pcl::octree::OctreePointCloudSearch<MapPoint> octree(0.1);
  octree.setInputCloud(map);
  octree.addPointsFromInputCloud();
  std::cout << "neighbours in the octree: "
            << octree.radiusSearch(middle, kRadiusM, indices, squared_distances) << "\n";
}

void align(const MapCloud::ConstPtr& map) {
  const auto moved = pcl::make_shared<MapCloud>();
  pcl::transformPointCloud(*map, *moved, Eigen::Affine3f(Eigen::Translation3f(0.01F, 0, -0.02F)));
  pcl::IterativeClosestPoint<MapPoint, MapPoint> icp;
  icp.setInputSource(moved);
  icp.setInputTarget(map);
  MapCloud aligned;
  icp.align(aligned);
  std::cout << "ICP moved by: " << icp.getFinalTransformation().block<3, 1>(0, 3).transpose()
            << "\n";
}

}  // namespace

int main(int count, char** arguments) try {
  if (count != 3) {
    std::cerr << "usage: pcl_host CONFIG.ini RECORDING.rawlog\n";
    return 2;
  }
  const MapCloud::ConstPtr map = mapOf(arguments[1], arguments[2]);
  std::cout << "points: " << map->size() << "\n";
  filter(map);
  search(map);
  align(map);
  return 0;
} catch (const std::exception& error) {
  std::cerr << error.what() << "\n";
  return 1;
}
