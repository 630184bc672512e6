// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/mrpt/CEventFusionMap.h"

#include <gmock/gmock.h>
#include <mrpt/config/CConfigFileMemory.h>
#include <mrpt/img/color_maps.h>
#include <mrpt/maps/CMultiMetricMap.h>
#include <mrpt/obs/CObservationComment.h>
#include <mrpt/opengl/CPointCloudColoured.h>
#include <mrpt/opengl/CSetOfObjects.h>

#include <random>

#include "plugin/mrpt/pose_observation.h"
#include "plugin/results/output/simple_map.h"
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
  std::vector<ViewPoint> points;
  for (int i = 0; i < count; ++i) {
    const auto x = static_cast<float>(draw(-1, 1));
    const auto y = static_cast<float>(draw(-1, 1));
    const auto z = static_cast<float>(draw(0.5, 3));
    points.push_back({{x, y, z},
                      static_cast<float>(draw(0.001, 1000)),
                      static_cast<float>(draw(0.01, 0.1)),
                      static_cast<float>(draw(0.5, 1))});
  }
  keyframe.points = std::make_shared<std::vector<ViewPoint>>(std::move(points));
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

/// Creates maps as MRPT's programs do.
CMultiMetricMap mapsFrom(const std::string& ini) {
  registerClasses();
  mrpt::maps::TSetOfMetricMapInitializers list;
  list.loadFromConfigFile(CConfigFileMemory(ini), "maps");
  CMultiMetricMap maps;
  maps.setListOfMaps(list);
  return maps;
}

/// Returns an object as MRPT's archive.
std::string archiveOf(const mrpt::serialization::CSerializable& object) {
  std::vector<std::uint8_t> bytes;
  mrpt::serialization::ObjectToOctetVector(&object, bytes);
  return {bytes.begin(), bytes.end()};
}

class SimpleMap : public TemporaryFolder {};

TEST_F(SimpleMap, IsWhatMrptWritesAndReads) {
  const std::vector<StoredKeyframe> keyframes = {randomKeyframe(1), randomKeyframe(2, 0),
                                                 randomKeyframe(3, 1000)};
  mrpt::maps::CSimpleMap by_mrpt;
  for (const StoredKeyframe& keyframe : keyframes) insertInto(by_mrpt, keyframe, cloudOf(keyframe));
  writeSimpleMap(folder() / "ours", keyframes);
  mrpt::maps::CSimpleMap ours;
  ASSERT_TRUE(ours.loadFromFile((folder() / "ours").string()));
  ASSERT_EQ(ours.size(), keyframes.size());
  // MRPT 2.5 writes what it has read as we have written it. A later one may have newer versions.
  EXPECT_EQ(archiveOf(ours), simpleMapArchive(keyframes));
  // The rotation matrix of a quaternion is rounded in another way.
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    constexpr double kRounding = 1e-15;
    const auto& [our_pose, our_frame] = *std::next(ours.begin(), static_cast<std::ptrdiff_t>(i));
    const auto& [pose, frame] = *std::next(by_mrpt.begin(), static_cast<std::ptrdiff_t>(i));
    EXPECT_EQ(archiveOf(*our_frame), archiveOf(*frame));
    const auto difference =
        our_pose->getMeanVal().getHomogeneousMatrixVal<mrpt::math::CMatrixDouble44>() -
        pose->getMeanVal().getHomogeneousMatrixVal<mrpt::math::CMatrixDouble44>();
    EXPECT_LE(difference.asEigen().cwiseAbs().maxCoeff(), kRounding);
  }
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
  const auto errorOfMaking = [](const std::string& ini) {
    return messageOf([&] { mapsFrom("[maps]\neventFusionMap_count = 1\n" + ini); });
  };
  const auto with = [&](const std::string& line) {
    return errorOfMaking("[" + section + "]\n" + line + "\n");
  };
  EXPECT_THAT(with("voxel_size_m = abc"),
              HasSubstr("options, section " + section + ": voxel_size_m = abc: must be a number"));
  EXPECT_THAT(with("voxel_size = 1"), HasSubstr(section + ": voxel_size: unknown key"));
  EXPECT_THAT(with("min_keyframes = 0"), HasSubstr(section + ": min_keyframes = 0: must be"));
  EXPECT_THAT(errorOfMaking("[maps_eventFusionMap_00_inserts]\nvoxel_size_m = 1\n"),
              HasSubstr("maps_eventFusionMap_00_inserts: unknown section; known: "
                        "maps_eventFusionMap_00_insertOpts, maps_eventFusionMap_00_creationOpts"));
  EXPECT_THAT(errorOfMaking("[maps_eventFusionMap_00_creationOpts]\nvoxel_size_m = 1\n"),
              HasSubstr("maps_eventFusionMap_00_creationOpts: voxel_size_m: unknown key"));
}

TEST(CEventFusionMap, InsertsCloudsWithIntensitiesAtTheRobotsPose) {
  const StoredKeyframe keyframe = randomKeyframe(1);
  CEventFusionMap expected;
  expected.insertKeyframe(keyframe);

  CObservationPointCloud observation;
  const CPointsMapXYZI::Ptr cloud = cloudOf(keyframe);
  observation.pointcloud = cloud;
  observation.timestamp = INVALID_TIMESTAMP;
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
  cloud->setPointIntensity(0, 7);
  EXPECT_NE(map.keyframes()[0].points->at(0).confidence, 7) << "the map has a copy";
  EXPECT_EQ(map.keyframes()[0].t_ref_ns, 0) << "the observation has no time";
  mrpt::maps::CSimpleMap simple;
  insertInto(simple, keyframe, cloudOf(keyframe));
  CEventFusionMap filled;
  filled.loadFromSimpleMap(simple);
  expectNear(filled.cloud().points(), expected_points, 1e-6);
  EXPECT_EQ(filled.keyframes()[0].t_ref_ns, 1'700'000'000'123'456'800) << "MRPT's tick";
}

TEST(CEventFusionMap, AKeyframeThatMovesIsThatOfItsNewPose) {
  CEventFusionMap map = mapOf(3);
  EXPECT_EQ(map.getAsSimplePointsMap()->size(), map.cloud().points()->size());
  const Rigid3 T_world_ref = randomKeyframe(77).T_world_ref;
  CEventFusionMap expected(bigVoxels());
  for (unsigned k = 0; k < 3; ++k) {
    StoredKeyframe keyframe = randomKeyframe(k);
    if (k == 1) keyframe.T_world_ref = T_world_ref;
    expected.insertKeyframe(keyframe);
  }
  Rigid3 far = T_world_ref;
  far.translation.x() = 1e19;  // so far away, voxels have no numbers
  const CEventFusionMap before = map;
  EXPECT_THROW(map.moveKeyframe(1, far), std::invalid_argument);
  expectSamePoints(map, before);
  EXPECT_TRUE(isSame(map.keyframes()[1].T_world_ref, before.keyframes()[1].T_world_ref));
  map.moveKeyframe(1, T_world_ref);
  expectSamePoints(map, expected);
  const auto* simple = map.getAsSimplePointsMap();
  const MapCloud::ConstPtr points = expected.cloud().points();
  ASSERT_EQ(simple->size(), points->size());
  float x = 0, y = 0, z = 0;
  simple->getPoint(5, x, y, z);
  EXPECT_EQ(Eigen::Vector3f(x, y, z), positionIn(*points, points->at(5)).cast<float>());
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

TEST(CEventFusionMap, RejectsAnInvalidPointAndDoesNotChangeWhichAClearedOneDoesAndNotItsCopies) {
  CEventFusionMap map = mapOf(2);
  const CEventFusionMap before = map;
  StoredKeyframe wrong = randomKeyframe(5);
  std::vector<ViewPoint> points = *wrong.points;
  points[3].confidence = -1;
  wrong.points = std::make_shared<std::vector<ViewPoint>>(points);
  EXPECT_THROW(map.insertKeyframe(wrong), std::invalid_argument);
  expectSamePoints(map, before);
  EXPECT_EQ(map.keyframes().size(), 2U);
  map.clear();
  EXPECT_TRUE(map.isEmpty() && map.keyframes().empty());
  EXPECT_EQ(map.cloud().options().voxel_size_m, 0.25);
  expectSamePoints(before, mapOf(2));
}

TEST(CEventFusionMap, StoredAndReadIsTheSameBitForBitAlsoAfterMoreKeyframes) {
  // Every option differs from its default.
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

/// Stores a map as earlier versions of this program did: without probabilities (2), sigmas (1) and
/// a consistency check (0).
Bytes storedAs(std::uint8_t version, const CEventFusionMap& map) {
  Bytes content;
  auto out = mrpt::serialization::archiveFrom(content);
  const GlobalCloudOptions& options = map.cloud().options();
  out << map.genericMapParams << options.voxel_size_m << std::int32_t{options.min_keyframes}
      << options.outliers.outlier_radius_m << std::int32_t{options.outliers.outlier_min_neighbors};
  if (version > 0) out << std::string("support") << 0.25 << 3.0 << std::int32_t{4};
  out << static_cast<std::uint32_t>(map.keyframes().size());
  for (const StoredKeyframe& keyframe : map.keyframes()) {
    out << keyframe.t_ref_ns;
    for (const double value : keyframe.T_world_ref.translation) out << value;
    for (const double value : keyframe.T_world_ref.rotation.coeffs()) out << value;
    out << *cloudOf(keyframe);
    std::vector<float> sigmas;
    for (const ViewPoint& point : *keyframe.points) sigmas.push_back(point.sigma);
    if (version > 1) out << sigmas;
  }
  Bytes bytes = bytesOf(map);
  constexpr std::size_t kVersionAt = sizeof("efm::CEventFusionMap");  // after length and name
  bytes.resize(kVersionAt);
  bytes.push_back(version);
  bytes.insert(bytes.end(), content.begin(), content.end());
  bytes.push_back(0x88);  // MRPT's mark for the end of an object
  return bytes;
}

TEST(CEventFusionMap, EarlierVersionsAreReadLaterAndDamagedOnesAreErrors) {
  const CEventFusionMap map = mapOf(2);
  for (const std::uint8_t version : {0, 1, 2}) {
    const auto read = objectFrom<CEventFusionMap>(storedAs(version, map));
    ASSERT_TRUE(read) << int{version};
    const ConsistencyOptions& options = read->cloud().options().consistency;
    EXPECT_EQ(options.consistency, version == 0 ? Consistency::kNone : Consistency::kSupport);
    EXPECT_EQ(options.max_contradictions,
              version == 0 ? ConsistencyOptions().max_contradictions : 4);
    const MapPoint point = read->cloud().points()->front();
    EXPECT_EQ(std::isnan(point.sigma), version < 2) << int{version};
    EXPECT_TRUE(std::isnan(point.probability)) << int{version};
    if (version == 0) {
      CEventFusionMap without(map.cloud().options());
      for (StoredKeyframe keyframe : map.keyframes()) {
        auto points = std::make_shared<std::vector<ViewPoint>>(*keyframe.points);
        for (ViewPoint& p : *points) p = {p.p_ref, p.confidence};
        keyframe.points = points;
        without.insertKeyframe(keyframe);
      }
      expectSamePoints(*read, without);
    }
    EXPECT_TRUE(isSame(read->keyframes()[1].T_world_ref, map.keyframes()[1].T_world_ref));
  }
  EXPECT_THAT(messageOf([&] { objectFrom<CEventFusionMap>(storedAs(4, map)); }),
              HasSubstr("an event fusion map of version 4: this program reads versions 0 to 3"));
  const Bytes bytes = bytesOf(map);
  for (const std::size_t kept : {bytes.size() / 3, bytes.size() / 2, bytes.size() - 20}) {
    const Bytes cut(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(kept));
    EXPECT_THROW(objectFrom<CEventFusionMap>(cut), std::exception) << kept;
  }
}

TEST(CEventFusionMap, IsDrawnInColoursUpToTheNinetyFifthPercentile) {
  StoredKeyframe keyframe;
  std::vector<ViewPoint> points;
  for (int i = 0; i < 40; ++i) {  // one voxel per point
    points.push_back({{static_cast<float>(i), 2, 3}, static_cast<float>(i + 1)});
  }
  keyframe.points = std::make_shared<std::vector<ViewPoint>>(points);
  CEventFusionMap map(bigVoxels());
  map.insertKeyframe(keyframe);
  EXPECT_EQ(map.asString(), "event fusion map of 1 keyframes with 40 points in voxels of 0.25 m");
  const auto drawn = map.getVisualization()->getByClass<mrpt::opengl::CPointCloudColoured>();
  ASSERT_TRUE(drawn);
  ASSERT_EQ(drawn->size(), 40U);
  for (std::size_t i = 0; i < 40; ++i) {
    const auto point = drawn->getPoint3Df(i);
    const auto colour = drawn->getPointColor(i);
    EXPECT_EQ(point.y, 2);
    EXPECT_EQ(point.z, 3);
    const auto expected = mrpt::img::colormap(mrpt::img::cmJET,  // value 38 of 40 is the scale
                                              std::min(1.0F, (point.x + 1) / 38));
    EXPECT_EQ(colour.R, expected.R) << point.x;
    EXPECT_EQ(colour.B, expected.B) << point.x;
  }
  map.genericMapParams.enableSaveAs3DObject = false;
  EXPECT_TRUE(map.getVisualization()->empty());
  EXPECT_EQ(CEventFusionMap().getVisualization()->size(), 1U) << "an empty cloud";
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

}  // namespace
}  // namespace efm
