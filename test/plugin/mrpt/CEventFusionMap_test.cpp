// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/mrpt/CEventFusionMap.h"
#include "maps/io/point_cloud_file.h"
#include "plugin/mrpt/points_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <mrpt/config/CConfigFileMemory.h>
#include <mrpt/maps/CMultiMetricMap.h>
#include <mrpt/maps/CSimpleMap.h>
#include <mrpt/obs/CObservationComment.h>
#include <mrpt/opengl/CPointCloudColoured.h>
#include <mrpt/opengl/CSetOfObjects.h>
#include <mrpt/serialization/CArchive.h>
#include <mrpt/serialization/archiveFrom_std_vector.h>

#include <random>

#include "plugin/mrpt/mrpt_pose.h"
#include "plugin/mrpt/registration.h"
#include "test/plugin/mrpt/observations.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using mrpt::config::CConfigFileMemory;
using mrpt::maps::CMultiMetricMap;
using mrpt::maps::CPointsMapXYZI;
using mrpt::obs::CObservationPointCloud;
using testing::HasSubstr;

StoredKeyframe randomKeyframe(unsigned seed, int count = 200) {
  std::mt19937 random(seed);
  const auto draw = [&](double from, double to) {
    return from + (to - from) * (static_cast<double>(random()) / 4294967296.0);
  };
  StoredKeyframe keyframe;
  keyframe.t_ref_ns = 1'700'000'000'123'456'789 + seed;
  const Eigen::Vector3d axis(draw(-1, 1), draw(-1, 1), draw(-1, 1));
  keyframe.T_world_ref.rotation = Eigen::AngleAxisd(draw(0, 3), axis.normalized());
  keyframe.T_world_ref.translation = {draw(-5, 5), draw(-5, 5), draw(-5, 5)};
  keyframe.points = CPointsMapXYZI::Create();
  for (int i = 0; i < count; ++i) {
    keyframe.points->insertPointFast(static_cast<float>(draw(-1, 1)),
                                     static_cast<float>(draw(-1, 1)),
                                     static_cast<float>(draw(0.5, 3)));
    keyframe.points->setPointIntensity(static_cast<std::size_t>(i),
                                       static_cast<float>(draw(0.001, 1000)));
  }
  return keyframe;
}

GlobalCloudOptions bigVoxels() {
  GlobalCloudOptions options;
  options.voxel_size_m = 0.25;
  return options;
}

CEventFusionMap mapOf(unsigned keyframes, const GlobalCloudOptions& options = bigVoxels()) {
  CEventFusionMap map(options);
  for (unsigned k = 0; k < keyframes; ++k) map.insertKeyframe(randomKeyframe(k));
  return map;
}

void expectSamePoints(const CEventFusionMap& a, const CEventFusionMap& b) {
  expectSameBits(a.cloud().points(), b.cloud().points());
}

template <typename Object>
std::vector<std::uint8_t> bytesOf(const Object& object) {
  std::vector<std::uint8_t> bytes;
  auto archive = mrpt::serialization::archiveFrom(bytes);
  archive << object;
  return bytes;
}

template <typename Object>
std::shared_ptr<Object> objectFrom(const std::vector<std::uint8_t>& bytes) {
  registerClasses();
  auto archive = mrpt::serialization::archiveFrom(bytes);
  return std::dynamic_pointer_cast<Object>(archive.ReadObject());
}

/// Made as MRPT's programs make their maps.
CMultiMetricMap mapsFrom(const std::string& ini) {
  registerClasses();
  mrpt::maps::TSetOfMetricMapInitializers list;
  list.loadFromConfigFile(CConfigFileMemory(ini), "maps");
  CMultiMetricMap maps;
  maps.setListOfMaps(list);
  return maps;
}

std::string errorOfMaking(const std::string& ini) {
  try {
    mapsFrom("[maps]\neventFusionMap_count = 1\n" + ini);
  } catch (const std::exception& error) {
    return error.what();
  }
  return "no error";
}

CObservationPointCloud observationOf(const StoredKeyframe& keyframe) {
  CObservationPointCloud observation;
  observation.pointcloud = keyframe.points;
  return observation;
}

TEST(CEventFusionMap, IsMadeByTheMapFactoryWithItsOptions) {
  const CMultiMetricMap maps = mapsFrom(
      "[maps]\neventFusionMap_count = 2\npointsMap_count = 1\n"
      "[maps_eventFusionMap_00_insertOpts]\nvoxel_size_m = 0.5\n"
      "[maps_eventFusionMap_01_insertOpts]\nmin_keyframes = 3 // of all\n"
      "[maps_eventFusionMap_01_creationOpts]\nenableObservationInsertion = false\n");
  ASSERT_EQ(maps.maps.size(), 3U);
  const auto first = maps.mapByClass<CEventFusionMap>(0);
  const auto second = maps.mapByClass<CEventFusionMap>(1);
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->cloud().options().voxel_size_m, 0.5);
  EXPECT_EQ(second->cloud().options().min_keyframes, 3);
  EXPECT_TRUE(first->genericMapParams.enableObservationInsertion);
  EXPECT_FALSE(second->genericMapParams.enableObservationInsertion);
  EXPECT_TRUE(first->isEmpty());
}

TEST(CEventFusionMap, WrongOptionsAreErrorsThatNameThem) {
  const std::string section = "maps_eventFusionMap_00_insertOpts";
  const auto with = [&](const std::string& line) {
    return errorOfMaking("[" + section + "]\n" + line + "\n");
  };
  EXPECT_THAT(with("voxel_size_m = abc"),
              HasSubstr("options, section " + section + ": voxel_size_m = abc: must be a number"));
  EXPECT_THAT(with("voxel_size = 1"), HasSubstr(section + ": voxel_size: unknown key"));
  EXPECT_THAT(with("min_keyframes = 0"), HasSubstr(section + ": min_keyframes = 0: must be"));
  EXPECT_THAT(errorOfMaking("[maps_eventFusionMap_00_inserts]\nvoxel_size_m = 1\n"),
              HasSubstr("maps_eventFusionMap_00_inserts: unknown section"));
  EXPECT_THAT(errorOfMaking("[maps_eventFusionMap_00_creationOpts]\nvoxel_size_m = 1\n"),
              HasSubstr("maps_eventFusionMap_00_creationOpts: voxel_size_m: unknown key"));
}

TEST(CEventFusionMap, InsertsCloudsWithIntensitiesAtTheRobotsPose) {
  const StoredKeyframe keyframe = randomKeyframe(1);
  CEventFusionMap expected;
  expected.insertKeyframe(keyframe);

  CObservationPointCloud observation = observationOf(keyframe);
  observation.sensorPose = mrpt::poses::CPose3D(0.1, 0.2, 0.3, 1, 0.2, -0.4);
  const mrpt::poses::CPose3D robot =
      mrptPoseFrom(keyframe.T_world_ref * rigidFrom(observation.sensorPose).inverse());
  CEventFusionMap map;
  ASSERT_TRUE(map.insertObservation(observation, robot));

  const auto points = map.cloud().points();
  const auto expected_points = expected.cloud().points();
  expectNear(points, expected_points, 1e-6);
  for (std::size_t i = 0; i < points->size(); ++i) {
    EXPECT_EQ(points->at(i).intensity, expected_points->at(i).intensity);
  }
}

TEST(CEventFusionMap, DoesNotChangeWithTheCallersCloud) {
  const StoredKeyframe keyframe = randomKeyframe(1);
  CEventFusionMap map;
  map.insertObservation(observationOf(keyframe));
  keyframe.points->setPointIntensity(0, 7);
  EXPECT_NE(map.keyframes()[0].points->getPointIntensity(0), 7);
}

TEST(CEventFusionMap, IgnoresOtherObservations) {
  CEventFusionMap map;
  EXPECT_FALSE(map.insertObservation(mrpt::obs::CObservationComment()));
  CObservationPointCloud no_intensities;
  no_intensities.pointcloud = mrpt::maps::CSimplePointsMap::Create();
  no_intensities.pointcloud->insertPoint(1, 2, 3);
  EXPECT_FALSE(map.insertObservation(no_intensities));
  EXPECT_FALSE(map.insertObservation(CObservationPointCloud())) << "without a cloud";
  EXPECT_TRUE(map.isEmpty());
  EXPECT_FALSE(map.canComputeObservationLikelihood(mrpt::obs::CObservationComment()));
}

TEST(CEventFusionMap, RefusesAnInvalidPointAndDoesNotChange) {
  CEventFusionMap map = mapOf(2);
  const CEventFusionMap before = map;
  const StoredKeyframe wrong = randomKeyframe(5);
  wrong.points->setPointIntensity(3, -1);
  EXPECT_THROW(map.insertKeyframe(wrong), std::invalid_argument);
  expectSamePoints(map, before);
  EXPECT_EQ(map.keyframes().size(), 2U);
}

TEST(CEventFusionMap, StoredAndReadIsTheSameBitForBitAlsoAfterMoreKeyframes) {
  // No option is the default, and each decides which points there are.
  GlobalCloudOptions options = bigVoxels();
  options.voxel_size_m = 2;
  options.min_keyframes = 2;
  options.outliers.outlier_radius_m = 0.6;
  options.outliers.outlier_min_neighbors = 2;
  options.consistency = {Consistency::kSupport, 0.5, 5.0, 1};
  CEventFusionMap map = mapOf(3, options);
  ASSERT_GT(map.cloud().points()->size(), 0U);
  const auto read = objectFrom<CEventFusionMap>(bytesOf(map));
  ASSERT_TRUE(read);
  EXPECT_EQ(read->cloud().options().voxel_size_m, 2);
  EXPECT_EQ(read->cloud().options().min_keyframes, 2);
  EXPECT_EQ(read->cloud().options().outliers.outlier_radius_m, 0.6);
  EXPECT_EQ(read->cloud().options().outliers.outlier_min_neighbors, 2);
  EXPECT_EQ(read->cloud().options().consistency.consistency, Consistency::kSupport);
  EXPECT_EQ(read->cloud().options().consistency.consistency_tolerance, 0.5);
  EXPECT_EQ(read->cloud().options().consistency.consistency_cell_deg, 5);
  EXPECT_EQ(read->cloud().options().consistency.max_contradictions, 1);
  EXPECT_EQ(read->keyframes()[2].t_ref_ns, map.keyframes()[2].t_ref_ns);
  expectSamePoints(*read, map);

  map.insertKeyframe(randomKeyframe(9));
  read->insertKeyframe(randomKeyframe(9));
  expectSamePoints(*read, map);
}

TEST(CEventFusionMap, GoesThroughAnArchiveInsideAMultiMetricMap) {
  CMultiMetricMap maps = mapsFrom("[maps]\neventFusionMap_count = 1\n");
  const auto map = maps.mapByClass<CEventFusionMap>();
  for (unsigned k = 0; k < 3; ++k) map->insertKeyframe(randomKeyframe(k));

  const auto read = objectFrom<CMultiMetricMap>(bytesOf(maps));

  ASSERT_TRUE(read && read->mapByClass<CEventFusionMap>());
  expectSamePoints(*read->mapByClass<CEventFusionMap>(), *map);
}

TEST(CEventFusionMap, DamagedBytesAreAnError) {
  const std::vector<std::uint8_t> bytes = bytesOf(mapOf(2));
  for (const std::size_t kept : {bytes.size() / 3, bytes.size() / 2, bytes.size() - 20}) {
    std::vector<std::uint8_t> cut(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(kept));
    EXPECT_THROW(objectFrom<CEventFusionMap>(cut), std::exception) << kept;
  }
}

TEST(CEventFusionMap, CopiesAreIndependent) {
  CEventFusionMap map = mapOf(2);
  const CEventFusionMap copy = map;
  map.clear();
  EXPECT_TRUE(map.isEmpty());
  EXPECT_TRUE(map.keyframes().empty());
  expectSamePoints(copy, mapOf(2));
  EXPECT_EQ(map.cloud().options().voxel_size_m, 0.25);
}

TEST(CEventFusionMap, IsFilledFromASimplemap) {
  mrpt::maps::CSimpleMap simple;
  for (unsigned k = 0; k < 3; ++k) insertInto(simple, randomKeyframe(k));
  CEventFusionMap map(mapOf(0).cloud().options());
  map.loadFromSimpleMap(simple);

  const auto points = map.cloud().points();
  const auto expected = mapOf(3).cloud().points();
  expectNear(points, expected, 1e-6);
}

TEST(CEventFusionMap, IsDrawnWithAPointForEachOfItsPoints) {
  CEventFusionMap map = mapOf(2);
  const auto drawn = map.getVisualization()->getByClass<mrpt::opengl::CPointCloudColoured>();
  ASSERT_TRUE(drawn);
  EXPECT_EQ(drawn->size(), map.cloud().points()->size());
  map.genericMapParams.enableSaveAs3DObject = false;
  EXPECT_TRUE(map.getVisualization()->empty());
  EXPECT_EQ(CEventFusionMap().getVisualization()->size(), 1U) << "an empty cloud";
}

TEST(CEventFusionMap, ReturnsItsPointsAsMrptsSimplestMap) {
  CEventFusionMap map = mapOf(1);
  EXPECT_EQ(map.getAsSimplePointsMap()->size(), map.cloud().points()->size());
  map.insertKeyframe(randomKeyframe(4));
  EXPECT_EQ(map.getAsSimplePointsMap()->size(), map.cloud().points()->size()) << "after it grew";
}

TEST(CEventFusionMap, WarnsWhereMrptsFloatsRoundItsPoints) {
  const MapCloud::ConstPtr near = mapOf(1).cloud().points();
  EXPECT_FALSE(roundingWarning(*near, 0.25));
  StoredKeyframe keyframe = randomKeyframe(1);
  keyframe.T_world_ref.translation += Eigen::Vector3d(450'000, 5'400'000, 100);
  GlobalCloudOptions options;
  options.voxel_size_m = 0.01;
  CEventFusionMap map(options);
  map.insertKeyframe(keyframe);
  EXPECT_THAT(*roundingWarning(*map.cloud().points(), 0.01), HasSubstr("steps at the map's "
                                                                       "coordinates are 0.5 m"));
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  map.getAsSimplePointsMap();
  map.getVisualization();
  const std::string text =
      testing::internal::GetCapturedStdout() + testing::internal::GetCapturedStderr();
  EXPECT_THAT(text, HasSubstr("MRPT's maps have float points"));
  EXPECT_EQ(text.find("MRPT's maps"), text.rfind("MRPT's maps")) << "once";
}

TEST(CEventFusionMap, IsDescribedByKeyframesAndVoxelSize) {
  EXPECT_THAT(mapOf(3).asString(), HasSubstr("3 keyframes"));
  EXPECT_THAT(mapOf(3).asString(), HasSubstr("0.25 m"));
}

class CEventFusionMapFile : public TemporaryFolder {};

TEST_F(CEventFusionMapFile, IsSavedAsAPcdFile) {
  const CEventFusionMap map = mapOf(2);
  map.saveMetricMapRepresentationToFile((folder() / "saved").string());
  const auto cloud = readPointCloud(folder() / "saved.pcd").points;
  const auto points = map.cloud().points();
  ASSERT_EQ(cloud.size(), points->size());
  EXPECT_EQ(cloud[1].p_world.x(), points->at(1).x);
  EXPECT_EQ(cloud[1].confidence, points->at(1).intensity);
}

}  // namespace
}  // namespace efm
