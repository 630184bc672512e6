// SPDX-License-Identifier: BSD-3-Clause
#include "test/studies/frames/slider_keyframe.h"
#include "plugin/recordings/open/recording_formats.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "mapping/keyframes/keyframe_policy.h"
#include "plugin/recordings/streams/event_packets.h"
#include "plugin/recordings/text/event_text.h"
#include "test/studies/frames/posed_frames.h"

namespace efm::studies {

SliderRecording readSlider(const std::filesystem::path& folder) {
  SliderRecording recording;
  const CameraModel camera = uzhCamera(folder);
  recording.rig.cameras.push_back({camera, {}, 0});
  for (const StampedPose& pose : readPoses(folder / "groundtruth.txt")) {
    recording.trajectory.add(pose);
  }
  const std::int64_t first_pose_ns = recording.trajectory.poses().front().t_ns;
  EventPackets reader(std::make_unique<EventTextStream>(folder / "events.txt"),
                      {camera.width, camera.height});
  for (auto packet = reader.nextPacket(); !packet.empty(); packet = reader.nextPacket()) {
    for (const Event& event : packet) {
      if (event.t_ns >= first_pose_ns) recording.events.push_back(event);
    }
  }
  if (!reader.damage().empty()) throw std::runtime_error(reader.damage());
  if (recording.events.empty()) {
    throw std::runtime_error((folder / "events.txt").string() + ": no event has a pose");
  }
  const std::int64_t t0_ns = recording.events.front().t_ns;
  recording.window = windowOf(t0_ns, t0_ns + 150'000'000, ReferenceTime::kMiddle);
  const auto after = [&](const Event& event) { return event.t_ns >= recording.window.t1_ns; };
  recording.events.erase(std::find_if(recording.events.begin(), recording.events.end(), after),
                         recording.events.end());
  return recording;
}

KeyframeDepthMap sliderKeyframe(const SliderRecording& recording,
                                const KeyframeMapperOptions& options) {
  KeyframeMapper mapper(recording.rig, {0}, options);
  auto keyframe = mapper.map(recording.window, {EventSpan(recording.events)}, recording.trajectory);
  if (!keyframe) throw std::runtime_error("the slider has no pose in the middle of its window");
  return std::move(*keyframe);
}

}  // namespace efm::studies
