// SPDX-License-Identifier: BSD-3-Clause
#include "test/studies/refinement/pose_refinement_run.h"

#include <algorithm>
#include <chrono>
#include <ctime>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "mapping/geometry/timestamp.h"
#include "maps/cloud/keyframe_cloud.h"
#include "maps/refinement/registration_points.h"
#include "plugin/session/mapping_session.h"

namespace efm::studies {
namespace {

constexpr std::int64_t kPacketNs = 50'000'000;
constexpr std::int64_t kPosePeriodNs = 5'000'000;

/// Windows begin at the first event with a pose. Poses begin with the recording.
std::int64_t firstEventNs(const Recording& recording) {
  std::int64_t first_ns = recording.simulation.endNs();
  for (const std::vector<Event>& events : recording.events) {
    if (!events.empty()) first_ns = std::min(first_ns, events.front().t_ns);
  }
  return first_ns;
}

/// Moves the finished keyframes to the run, with the tracker's poses.
void takeDue(MappingSession& session, PoseRefinementRun& run) {
  while (std::optional<KeyframeDepthMap> keyframe = session.next()) {
    keyframe->T_world_ref = session.T_odom_ref().back();
    run.keyframes.push_back(std::move(*keyframe));
  }
}

}  // namespace

PoseRefinementRun mapRefined(const Recording& recording, const EventFusionOptions& options,
                             TrackerFaults faults) {
  const Simulation& simulation = recording.simulation;
  const std::int64_t first_window_ns = firstEventNs(recording);
  faults.perturbation.keyframe.start_ns = first_window_ns;
  faults.perturbation.keyframe.length_ns = durationFromSeconds(options.mapper.policy.window_s);
  const std::vector<StampedPose> poses = withFaults(samplePoses(simulation, kPosePeriodNs), faults);

  PoseRefinementRun run;
  MappingSession session(options);
  auto pose = poses.begin();
  for (std::int64_t t_ns = simulation.start_ns; t_ns <= simulation.endNs(); t_ns += kPacketNs) {
    const Window packet{t_ns, t_ns + kPacketNs, t_ns};
    for (; pose != poses.end() && pose->t_ns < packet.t1_ns; ++pose) {
      session.addPose({{}, pose->t_ns, pose->T_world_rig, {}});
    }
    for (std::size_t c = 0; c < recording.events.size(); ++c) {
      const EventSpan events = recording.eventsOf(c, packet);
      session.addEvents({static_cast<int>(c),
                         simulation.rig.cameras[c],
                         {events.begin(), events.end()},
                         packet.t1_ns});
    }
    takeDue(session, run);
  }
  session.finish();
  takeDue(session, run);
  if (run.keyframes.empty() || run.keyframes.front().window.t0_ns != first_window_ns) {
    throw std::logic_error("the first window does not begin at " + formatSeconds(first_window_ns));
  }
  run.T_odom_ref = session.T_odom_ref();
  run.T_world_ref = session.T_world_ref();
  run.refined_map = session.cloud().points();
  if (const auto state = session.status().refinement) run.counts = state->counts;
  return run;
}

MapCloud::ConstPtr mapAt(const std::vector<KeyframeDepthMap>& keyframes,
                         const std::vector<Rigid3>& T_world_ref,
                         const GlobalCloudOptions& options) {
  GlobalCloud cloud(options);
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    cloud.insert(i, pointsInWorld(viewPoints(keyframes[i]), T_world_ref[i]), T_world_ref[i]);
  }
  return cloud.points();
}

RefinerRun refineKeyframes(const std::vector<KeyframeDepthMap>& keyframes,
                           const RefinementOptions& options,
                           const std::function<void(KeyframeRefiner&, std::size_t)>& after) {
  RefinerRun run;
  KeyframeRefiner refiner(options);
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    const auto began = std::chrono::steady_clock::now();
    const std::clock_t processor_began = std::clock();
    refiner.add(RegistrationCloud(keyframes[i], options.points), keyframes[i].T_world_ref);
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - began;
    run.seconds.push_back(took.count());
    run.processor_seconds.push_back(static_cast<double>(std::clock() - processor_began) /
                                    CLOCKS_PER_SEC);
    if (after) after(refiner, i);
  }
  refiner.finish();
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    run.T_world_ref.push_back(refiner.T_world_ref(i));
  }
  run.counts = refiner.counts();
  return run;
}

}  // namespace efm::studies
