// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>
#include <mrpt/obs/CObservationRobotPose.h>

#include <cstddef>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "plugin/mrpt/CEventFusionMapBuilder.h"
#include "plugin/mrpt/CObservationEvents.h"
#include "plugin/mrpt/pose_observation.h"
#include "test/maps/cloud/cloud_points.h"
#include "test/plugin/session/synthetic_recording.h"

namespace efm {

inline CObservationEvents::Ptr packetObservation(const SyntheticRecording& recording, int camera) {
  const RigCamera& calibration = recording.cameras[static_cast<std::size_t>(camera)];
  auto packet = CObservationEvents::Create();
  packet->sensorLabel = "cam" + std::to_string(camera);
  packet->camera_index = camera;
  packet->camera = calibration.model;
  packet->camera_pose = mrptPoseFrom(calibration.T_rig_cam);
  return packet;
}

/// The recording as in a rawlog: packets of 10 ms of each camera, then the pose at their end.
inline std::vector<mrpt::obs::CObservation::Ptr> observationsOf(
    const SyntheticRecording& recording) {
  std::vector<mrpt::obs::CObservation::Ptr> observations;
  std::vector<std::size_t> begin(recording.cameras.size(), 0);
  for (const StampedPose& pose : recording.poses) {
    for (std::size_t c = 0; c < recording.cameras.size(); ++c) {
      auto packet = packetObservation(recording, static_cast<int>(c));
      packet->timestamp = mrptTimeFrom(pose.t_ns);
      packet->covered_until_ns = pose.t_ns;
      const std::vector<Event>& events = recording.events[c];
      for (; begin[c] < events.size() && events[begin[c]].t_ns < pose.t_ns; ++begin[c]) {
        packet->events.push_back(events[begin[c]]);
      }
      observations.push_back(packet);
    }
    auto robot = mrpt::obs::CObservationRobotPose::Create();
    robot->timestamp = mrptTimeFrom(pose.t_ns);
    robot->sensorLabel = "pose";
    robot->pose.mean = mrptPoseFrom(pose.T_world_rig);
    observations.push_back(robot);
  }
  return observations;
}

inline void expectSameBits(const MapCloud::ConstPtr& a, const MapCloud::ConstPtr& b) {
  EXPECT_EQ(a->size(), b->size());
  EXPECT_TRUE(test::sameBits(*a, *b));
}

/// A simplemap has no place for the sigma of its points.
inline MapCloud::ConstPtr withoutSigma(const MapCloud::ConstPtr& cloud) {
  auto copy = pcl::make_shared<MapCloud>(*cloud);
  for (MapPoint& point : *copy) point.sigma = MapPoint().sigma;
  return copy;
}

/// The same points up to a distance, with the same support.
inline void expectNear(const MapCloud::ConstPtr& a, const MapCloud::ConstPtr& b,
                       double tolerance_m) {
  ASSERT_EQ(a->size(), b->size());
  for (std::size_t i = 0; i < a->size(); ++i) {
    EXPECT_LT((positionIn(*a, a->at(i)) - positionIn(*b, b->at(i))).norm(), tolerance_m);
    EXPECT_EQ(a->at(i).support, b->at(i).support);
  }
}

inline void feed(CEventFusionMapBuilder& builder,
                 const std::vector<mrpt::obs::CObservation::Ptr>& observations) {
  for (const auto& observation : observations) builder.processObservation(observation);
}
/// Feeds a whole recording.
inline void play(CEventFusionMapBuilder& builder,
                 const std::vector<mrpt::obs::CObservation::Ptr>& observations) {
  feed(builder, observations);
  builder.finish();
}

}  // namespace efm
