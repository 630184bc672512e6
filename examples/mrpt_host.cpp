// SPDX-License-Identifier: BSD-3-Clause
// The map builder in an MRPT program with a driver and a tracker of its own: mrpt_host
// RECORDING.rawlog makes mrpt.pcd. The builder is made by its name, and used through MRPT's
// interface.
#include <mrpt/io/CFileGZInputStream.h>
#include <mrpt/obs/CActionCollection.h>
#include <mrpt/obs/CObservationComment.h>
#include <mrpt/obs/CObservationRobotPose.h>
#include <mrpt/obs/CRawlog.h>
#include <mrpt/obs/CSensoryFrame.h>
#include <mrpt/serialization/CArchive.h>
#include <mrpt/slam/CMetricMapBuilder.h>
#include <plugin/mrpt/CObservationEvents.h>

#include <iostream>
#include <stdexcept>

namespace {

/// Stands for a driver, which fills its packets itself: here from a recorded packet.
efm::CObservationEvents::Ptr packetOf(const efm::CObservationEvents& recorded) {
  auto packet = std::make_shared<efm::CObservationEvents>();
  packet->sensorLabel = "cam" + std::to_string(recorded.camera_index);
  packet->timestamp = recorded.timestamp;
  packet->camera_index = recorded.camera_index;
  packet->camera = recorded.camera;            // size, focal lengths, centre, distortion
  packet->camera_pose = recorded.camera_pose;  // T_rig_cam
  packet->time_offset_ns = recorded.time_offset_ns;
  for (const efm::Event& event : recorded.events) {
    packet->events.push_back({event.t_ns, event.x, event.y, event.polarity});
  }
  packet->covered_until_ns = recorded.covered_until_ns;  // there are no further events before it
  return packet;
}

/// Stands for a tracker: T_world_rig at a time, here a recorded pose.
mrpt::obs::CObservationRobotPose::Ptr poseOf(const mrpt::obs::CObservationRobotPose& recorded) {
  auto pose = std::make_shared<mrpt::obs::CObservationRobotPose>();
  pose->sensorLabel = "my_tracker";
  pose->timestamp = recorded.timestamp;
  pose->pose = recorded.pose;
  pose->sensorPose = recorded.sensorPose;
  return pose;
}

void give(const mrpt::obs::CObservation::Ptr& observation, mrpt::slam::CMetricMapBuilder& builder) {
  mrpt::obs::CActionCollection no_action;
  mrpt::obs::CSensoryFrame frame;
  frame.insert(observation);
  builder.processActionObservation(no_action, frame);
}

void run(const std::string& rawlog) {
  const auto builder = std::dynamic_pointer_cast<mrpt::slam::CMetricMapBuilder>(
      mrpt::rtti::classFactory("efm::CEventFusionMapBuilder"));
  if (!builder) throw std::runtime_error("efm::CEventFusionMapBuilder is not registered");

  mrpt::io::CFileGZInputStream stream(rawlog);
  auto archive = mrpt::serialization::archiveFrom(stream);
  mrpt::obs::CActionCollection::Ptr action;
  mrpt::obs::CSensoryFrame::Ptr frame;
  mrpt::obs::CObservation::Ptr observation;
  std::size_t entry = 0;
  while (mrpt::obs::CRawlog::getActionObservationPairOrObservation(archive, action, frame,
                                                                   observation, entry)) {
    if (const auto packet = std::dynamic_pointer_cast<efm::CObservationEvents>(observation)) {
      give(packetOf(*packet), *builder);
    }
    if (const auto pose =
            std::dynamic_pointer_cast<mrpt::obs::CObservationRobotPose>(observation)) {
      give(poseOf(*pose), *builder);
    }
  }
  auto end = mrpt::obs::CObservationComment::Create();
  end->text = "event_fusion: finish";  // maps what still waits
  give(end, *builder);

  const auto& maps = *builder->getCurrentlyBuiltMetricMap();  // the first is a CEventFusionMap
  if (maps.maps.empty()) throw std::runtime_error("there is no map");
  maps.maps.front()->saveMetricMapRepresentationToFile("mrpt");
  std::cout << builder->getCurrentlyBuiltMapSize() << " keyframes in mrpt.pcd\n";
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 2) throw std::runtime_error("usage: mrpt_host RECORDING.rawlog");
  run(argv[1]);
} catch (const std::exception& error) {
  std::cerr << "mrpt_host: " << error.what() << '\n';
  return 1;
}
