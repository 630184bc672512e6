// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>
#include <mrpt/obs/CObservationRobotPose.h>
#include <mrpt/serialization/CArchive.h>
#include <mrpt/serialization/archiveFrom_std_vector.h>

#include <cstdint>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "plugin/mrpt/CObservationEvents.h"
#include "plugin/mrpt/pose_observation.h"
#include "plugin/mrpt/registration.h"
#include "test/plugin/engine/mapper_of_rig.h"

namespace efm {

using Bytes = std::vector<std::uint8_t>;

/// Returns the object as an archive of MRPT stores it.
template <typename Object>
Bytes bytesOf(const Object& object) {
  Bytes bytes;
  auto archive = mrpt::serialization::archiveFrom(bytes);
  archive << object;
  return bytes;
}

/// Creates an object by its class name, like an object of a rawlog.
template <typename Object>
std::shared_ptr<Object> objectFrom(const Bytes& bytes) {
  registerClasses();
  auto archive = mrpt::serialization::archiveFrom(bytes);
  return std::dynamic_pointer_cast<Object>(archive.ReadObject());
}

/// Returns a packet of events as in a rawlog, of a camera of the synthetic rig.
inline CObservationEvents::Ptr observationOf(const EventPacket& packet) {
  static const std::vector<RigCamera> rig = SyntheticRecording(0.001, 3).cameras;
  const RigCamera& camera = rig.at(static_cast<std::size_t>(packet.camera));
  auto observation = CObservationEvents::Create();
  observation->sensorLabel = "cam" + std::to_string(packet.camera);
  observation->timestamp = mrptTimeFrom(packet.complete_until_ns.value_or(0));
  observation->camera_index = packet.camera;
  observation->camera = camera.model;
  observation->camera_pose = mrptPoseFrom(camera.T_rig_cam);
  observation->events = packet.events.all();
  observation->covered_until_ns = packet.complete_until_ns;
  return observation;
}

/// Returns a pose; its covariance is the stated noise.
inline mrpt::obs::CObservation::Ptr observationOf(const PoseSample& pose) {
  auto observation =
      std::dynamic_pointer_cast<mrpt::obs::CObservationRobotPose>(poseObservation(pose));
  for (int i = 0; pose.noise && i < 6; ++i) {
    const double sigma = i < 3 ? pose.noise->noise_m : pose.noise->noise_rad;
    observation->pose.cov(i, i) = sigma * sigma;
  }
  return observation;
}

/// Returns the samples of the recording as in a rawlog.
inline std::vector<mrpt::obs::CObservation::Ptr> observationsOf(const Samples& samples) {
  std::vector<mrpt::obs::CObservation::Ptr> observations;
  for (const Sample& sample : samples) {
    if (const auto* const packet = std::get_if<EventPacket>(&sample)) {
      observations.push_back(observationOf(*packet));
    } else {
      observations.push_back(observationOf(std::get<PoseSample>(sample)));
    }
  }
  return observations;
}
/// Returns the same, with the declaration of the rig at the beginning: see CObservationEvents.
inline std::vector<mrpt::obs::CObservation::Ptr> declaredObservationsOf(const Samples& samples) {
  std::vector<mrpt::obs::CObservation::Ptr> declarations, others;
  std::set<int> begun;
  for (const auto& observation : observationsOf(samples)) {
    const auto packet = std::dynamic_pointer_cast<CObservationEvents>(observation);
    const bool waits = packet && begun.count(packet->camera_index) == 0;
    if (waits && packet->events.empty()) continue;
    others.push_back(observation);
    if (!waits) continue;
    begun.insert(packet->camera_index);
    const auto empty = std::make_shared<CObservationEvents>(*packet);
    empty->events.clear();
    empty->covered_until_ns = packet->events.front().t_ns;
    declarations.push_back(empty);
  }
  declarations.insert(declarations.end(), others.begin(), others.end());
  return declarations;
}
inline std::vector<mrpt::obs::CObservation::Ptr> observationsOf(
    const SyntheticRecording& recording) {
  return observationsOf(samplesOf(recording));
}

inline void expectSameBits(const MapCloud::ConstPtr& a, const MapCloud::ConstPtr& b) {
  EXPECT_EQ(a->size(), b->size());
  EXPECT_TRUE(test::sameBits(*a, *b));
}

/// Expects points with the same support, at most a distance apart.
inline void expectNear(const MapCloud::ConstPtr& a, const MapCloud::ConstPtr& b,
                       double tolerance_m) {
  ASSERT_EQ(a->size(), b->size());
  for (std::size_t i = 0; i < a->size(); ++i) {
    EXPECT_LT((positionIn(*a, a->at(i)) - positionIn(*b, b->at(i))).norm(), tolerance_m);
    EXPECT_EQ(a->at(i).support, b->at(i).support);
  }
}

}  // namespace efm
