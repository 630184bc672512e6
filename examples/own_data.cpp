// SPDX-License-Identifier: BSD-3-Clause
// Events and poses in memory to depth maps and a cloud: own_data RECORDING POSES.txt makes own.pcd.
#include <event_fusion/engine.h>

#include <iostream>

/// @param events of each camera; integer pixels of the raw image, nanoseconds.
/// @param poses T_world_rig, on the clock of the events.
efm::MapCloud::ConstPtr mapOf(const std::vector<efm::RigCamera>& cameras,
                              std::vector<std::vector<efm::Event>> events,
                              const std::vector<efm::StampedPose>& poses) {
  efm::Mapper::Callbacks callbacks;
  callbacks.on_keyframe = [](const efm::Keyframe& keyframe) {
    std::cout << "keyframe at " << keyframe.window.t_ref_ns
              << " ns: " << cv::countNonZero(keyframe.map.depth)
              << " depths\n";  // keyframe.map.depth: metres
  };
  efm::Mapper mapper(efm::Options(), callbacks);
  for (const efm::RigCamera& camera : cameras) mapper.addCamera(camera);
  for (const efm::StampedPose& pose : poses) mapper.addPose(pose);
  for (std::size_t i = 0; i < events.size(); ++i) mapper.addEvents(int(i), std::move(events[i]));
  mapper.finish();
  for (const efm::Warning& warning : mapper.warnings()) std::cerr << warning.text << '\n';
  return mapper.points();
}

int main(int argc, char** argv) try {
  if (argc != 3) throw std::runtime_error("usage: own_data RECORDING POSES.txt");
  // Your driver and your tracker fill these arrays. Here a recording and a file of poses do.
  std::vector<efm::StampedPose> poses;
  const auto recording = efm::openRecording({argv[1]}, {argv[2]});
  std::vector<std::vector<efm::Event>> events(recording->rig().cameras.size());
  while (const auto sample = recording->next()) {
    if (const auto* packet = std::get_if<efm::EventPacket>(&*sample)) {
      std::vector<efm::Event>& all = events[packet->camera];
      all.insert(all.end(), packet->events.begin(), packet->events.end());
    } else if (const auto* pose = std::get_if<efm::PoseSample>(&*sample)) {
      poses.push_back({pose->t_ns, pose->T_world_rig()});
    }
  }
  const auto map = mapOf(recording->rig().cameras, std::move(events), poses);
  efm::writePcd("own.pcd", *map);
  std::cout << map->size() << " points in own.pcd\n";
} catch (const std::exception& error) {
  std::cerr << "error: " << error.what() << '\n';
  return 1;
}
