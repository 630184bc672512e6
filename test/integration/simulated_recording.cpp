// SPDX-License-Identifier: BSD-3-Clause
#include "test/integration/simulated_recording.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "mapping/depth/peak_fit.h"
#include "maps/cloud/keyframe_cloud.h"
#include "plugin/recordings/open/open_recording.h"
#include "test/paths.h"
#include "test/tracking_stub/truth/nearest_surface.h"
#include "tracking_stub/rendering/frame_renderer.h"

namespace efm::test {

namespace {

std::vector<std::vector<Event>> eventsOf(const Simulation& simulation) {
  std::vector<std::vector<Event>> events;
  for (CameraRecording& camera : simulateEvents(simulation)) {
    events.push_back(std::move(camera.events));
  }
  return events;
}

std::vector<std::vector<Event>> eventsOfDesk() {
  std::vector<std::vector<Event>> events(2);
  RecordingSource source;
  source.files = {EFM_RECORDINGS "/desk_stereo"};
  const auto recording = openRecording(source);
  while (const auto sample = recording->next()) {
    const auto* packet = std::get_if<EventPacket>(&*sample);
    if (!packet) continue;
    auto& camera = events.at(static_cast<std::size_t>(packet->camera));
    camera.insert(camera.end(), packet->events.begin(), packet->events.end());
  }
  return events;
}

}  // namespace

SimulatedRecording::SimulatedRecording(Simulation simulation,
                                       std::vector<std::vector<Event>> events)
    : simulation_(std::move(simulation)),
      events_(std::move(events)),
      poses_(samplePoses(simulation_)) {}

SimulatedRecording::SimulatedRecording(const SimulationOptions& options)
    : SimulatedRecording(makeSimulation(options), eventsOf(makeSimulation(options))) {}

const SimulatedRecording& SimulatedRecording::desk() {
  static const SimulatedRecording desk(makeSimulation({"desk_stereo", std::nullopt, 1}),
                                       eventsOfDesk());
  return desk;
}

std::vector<KeyframeDepthMap> SimulatedRecording::map(const FusionMapperOptions& options) const {
  FusionMapper mapper(options);
  for (const RigCamera& camera : simulation_.rig.cameras) mapper.addCamera(camera);
  for (const StampedPose& pose : poses_) mapper.addPose(pose);
  for (std::size_t c = 0; c < events_.size(); ++c) {
    mapper.addEvents(static_cast<int>(c), CheckedEvents(events_[c]));
  }
  mapper.finish();
  std::vector<KeyframeDepthMap> keyframes;
  while (auto keyframe = mapper.next()) keyframes.push_back(std::move(*keyframe));
  return keyframes;
}

cv::Mat1f SimulatedRecording::truthOf(const KeyframeDepthMap& keyframe) const {
  return renderDepth(simulation_.scene, keyframe.T_world_ref, keyframe.view);
}

std::vector<DepthPair> SimulatedRecording::pairs(const KeyframeDepthMap& keyframe) const {
  DepthPairingOptions pairing;
  pairing.tolerance_px = 1;
  return pairDepths({keyframe.map.depth, truthOf(keyframe)}, pairing);
}

double SimulatedRecording::medianDistanceToSurfaces(const MapCloud& cloud) const {
  std::vector<double> distances;
  for (const MapPoint& point : cloud) {
    distances.push_back(nearestSurface(simulation_.scene, positionIn(cloud, point)).distance_m);
  }
  if (distances.empty()) return std::numeric_limits<double>::infinity();
  return upperMedian(distances);
}

double SimulatedRecording::shareBeyond(const MapCloud& cloud, double distance_m) const {
  const auto beyond = std::count_if(cloud.begin(), cloud.end(), [&](const MapPoint& point) {
    return nearestSurface(simulation_.scene, positionIn(cloud, point)).distance_m > distance_m;
  });
  return static_cast<double>(beyond) / static_cast<double>(cloud.size());
}

MapCloud::ConstPtr globalCloudOf(const std::vector<KeyframeDepthMap>& keyframes,
                                 const GlobalCloudOptions& options) {
  GlobalCloud cloud(options);
  for (const KeyframeDepthMap& keyframe : keyframes) {
    cloud.insert(cloud.keyframes(), pointsInWorld(viewPoints(keyframe), keyframe.T_world_ref),
                 keyframe.T_world_ref);
  }
  return cloud.points();
}

}  // namespace efm::test
