// SPDX-License-Identifier: BSD-3-Clause
// Rawlogs of both kinds that MRPT wrote, through the program and through the builder.

#include <gmock/gmock.h>
#include <mrpt/io/CFileGZInputStream.h>
#include <mrpt/obs/CActionRobotMovement2D.h>
#include <mrpt/obs/CActionRobotMovement3D.h>
#include <mrpt/obs/CObservationOdometry.h>
#include <mrpt/obs/CRawlog.h>
#include <mrpt/serialization/CArchive.h>

#include <cstring>

#include "plugin/mrpt/CEventFusionMapBuilder.h"
#include "plugin/mrpt/registration.h"
#include "test/plugin/mrpt/observations.h"
#include "test/plugin/program_test.h"

namespace efm {
namespace {

using mrpt::obs::CActionCollection;
using mrpt::obs::CObservation;
using mrpt::obs::CObservationRobotPose;
using mrpt::obs::CRawlog;
using mrpt::obs::CSensoryFrame;
using testing::HasSubstr;

/// How a rawlog says where the rig is.
enum class Says { kPoses, kOdometry, kMovements2d, kMovements3d };

class RawlogKinds : public ProgramTest {
 protected:
  RawlogKinds() {
    registerClasses();
    write(recording);
  }

  void save(const CRawlog& rawlog, const std::string& name) const {
    ASSERT_TRUE(rawlog.saveToRawLogFile((folder() / name).string()));
  }

  /// The position in the recording's plane: it moves along x alone.
  static mrpt::poses::CPose2D planar(const StampedPose& pose) {
    return {pose.T_world_rig.translation.x(), pose.T_world_rig.translation.y(), 0};
  }

  static CObservation::Ptr odometryOf(const StampedPose& pose) {
    auto odometry = mrpt::obs::CObservationOdometry::Create();
    odometry->sensorLabel = "wheels";
    odometry->timestamp = mrptTimeFrom(pose.t_ns);
    odometry->odometry = planar(pose);
    return odometry;
  }

  /// Observations alone.
  CRawlog observationsOnly(Says says) const {
    CRawlog rawlog;
    std::size_t k = 0;
    for (const CObservation::Ptr& observation : observationsOf(recording)) {
      const bool is_pose = IS_CLASS(*observation, CObservationRobotPose);
      rawlog.insert(is_pose && says == Says::kOdometry ? odometryOf(recording.poses[k])
                                                       : observation);
      if (is_pose) ++k;
    }
    return rawlog;
  }

  /// Pairs of an action and a frame: the packets until a pose, and that pose.
  CRawlog pairs(Says says) const {
    CRawlog rawlog;
    auto frame = CSensoryFrame::Create();
    std::size_t k = 0;
    for (const CObservation::Ptr& observation : observationsOf(recording)) {
      if (!IS_CLASS(*observation, CObservationRobotPose)) {
        frame->insert(observation);
        continue;
      }
      const StampedPose& pose = recording.poses[k];
      auto actions = CActionCollection::Create();
      const mrpt::poses::CPose2D change =
          planar(pose) - (k > 0 ? planar(recording.poses[k - 1]) : mrpt::poses::CPose2D());
      if (says == Says::kPoses) {
        frame->insert(observation);
      } else if (says == Says::kMovements2d) {
        mrpt::obs::CActionRobotMovement2D movement;
        movement.timestamp = mrptTimeFrom(pose.t_ns);
        movement.computeFromOdometry(change, {});
        actions->insert(movement);
      } else {
        mrpt::obs::CActionRobotMovement3D movement;
        movement.timestamp = mrptTimeFrom(pose.t_ns);
        movement.poseChange.mean = mrpt::poses::CPose3D(change);
        actions->insert(movement);
      }
      rawlog.insert(actions);
      rawlog.insert(frame);
      frame = CSensoryFrame::Create();
      ++k;
    }
    return rawlog;
  }

  /// The points of a binary PCD file with the fields x y z intensity.
  std::vector<Eigen::Vector4f> pointsOfMap() const {
    const std::string pcd = contentOf("out/map.pcd");
    const std::string last_of_header = "DATA binary\n";
    const std::size_t begin = pcd.find(last_of_header) + last_of_header.size();
    std::vector<Eigen::Vector4f> points((pcd.size() - begin) / sizeof(Eigen::Vector4f));
    std::memcpy(static_cast<void*>(points.data()), pcd.data() + begin,
                points.size() * sizeof(Eigen::Vector4f));
    return points;
  }

  std::vector<Eigen::Vector4f> mapOf(const std::string& rawlog,
                                     const std::string& options = "") const {
    const Result result = run("map rig.ini " + rawlog + " --out out " + options);
    EXPECT_EQ(result.status, 0) << result.err;
    return pointsOfMap();
  }

  const SyntheticRecording recording;
};

void expectNear(const std::vector<Eigen::Vector4f>& a, const std::vector<Eigen::Vector4f>& b) {
  ASSERT_EQ(a.size(), b.size());
  ASSERT_GT(a.size(), 30U);
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_LT((a[i] - b[i]).norm(), 1e-4);
}

TEST_F(RawlogKinds, OdometryAndMovementsGiveTheMapThatPosesGive) {
  save(observationsOnly(Says::kPoses), "poses.rawlog");
  save(observationsOnly(Says::kOdometry), "odometry.rawlog");
  save(pairs(Says::kMovements2d), "planar.rawlog");
  save(pairs(Says::kMovements3d), "spatial.rawlog");
  save(pairs(Says::kPoses), "pairs.rawlog");
  ASSERT_EQ(run("import planar.rawlog --out imported.rawlog").status, 0);
  const auto map = mapOf("poses.rawlog");
  mapOf("pairs.rawlog");
  EXPECT_TRUE(pointsOfMap() == map) << "to the bit";
  for (const char* name : {"odometry", "planar", "spatial", "imported"}) {
    SCOPED_TRACE(name);
    expectNear(mapOf(name + std::string(".rawlog")), map);
  }
  EXPECT_THAT(run("info imported.rawlog").out, HasSubstr("actions:\n  51 poses from 10.0"));
  EXPECT_THAT(run("info odometry.rawlog --t1 10.2").out,
              HasSubstr("odometry 'wheels':\n  21 poses from 10.0"));
}

TEST_F(RawlogKinds, TheBuilderMapsBothAsMrptReadsThem) {
  save(observationsOnly(Says::kPoses), "observations.rawlog");
  save(pairs(Says::kMovements3d), "pairs.rawlog");
  std::vector<std::vector<Eigen::Vector4f>> maps;
  for (const char* name : {"observations.rawlog", "pairs.rawlog"}) {
    mrpt::io::CFileGZInputStream file((folder() / name).string());
    auto archive = mrpt::serialization::archiveFrom<mrpt::io::CStream>(file);
    CEventFusionMapBuilder builder(syntheticOptions());
    CActionCollection::Ptr action;
    CSensoryFrame::Ptr frame;
    CObservation::Ptr observation;
    std::size_t entry = 0;
    while (CRawlog::getActionObservationPairOrObservation(archive, action, frame, observation,
                                                          entry)) {
      if (observation) {
        builder.processObservation(observation);
      } else {
        builder.processActionObservation(*action, *frame);
      }
    }
    builder.finish();
    std::vector<Eigen::Vector4f>& map = maps.emplace_back();
    const MapCloud::ConstPtr points = builder.points();
    for (const MapPoint& point : *points) {
      map.emplace_back(point.x, point.y, point.z, point.intensity);
    }
    mrpt::poses::CPose3D pose;
    builder.getCurrentPoseEstimation()->getMean(pose);
    EXPECT_NEAR(pose.x(), recording.poses.back().T_world_rig.translation.x(), 1e-9);
  }
  expectNear(maps[0], maps[1]);
}

TEST_F(RawlogKinds, AHandEyeTransformAppliesToOdometryToo) {
  std::ofstream(folder() / "up.yaml")
      << "T_body_rig: [[1, 0, 0, 0], [0, 1, 0, 7], [0, 0, 1, 0], [0, 0, 0, 1]]\n";
  save(observationsOnly(Says::kOdometry), "odometry.rawlog");
  mapOf("odometry.rawlog", "--hand-eye up.yaml");
  EXPECT_NEAR(readTumTrajectory(folder() / "out/trajectory.txt")[0].T_world_rig.translation.y(), 7,
              1e-9);
  const Result result = run("import odometry.rawlog --out r.rawlog --hand-eye up.yaml");
  EXPECT_EQ(result.status, 0);
  EXPECT_THAT(result.err, HasSubstr("cannot hold the hand-eye transform: give it to map as well"));
}

}  // namespace
}  // namespace efm
