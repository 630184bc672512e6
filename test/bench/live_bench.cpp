// SPDX-License-Identifier: BSD-3-Clause
#include <mrpt/obs/CObservationRobotPose.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <deque>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "plugin/mrpt/CEventFusionMapBuilder.h"
#include "plugin/mrpt/CObservationEvents.h"
#include "plugin/mrpt/pose_observation.h"
#include "test/bench/benches.h"
#include "test/bench/synthetic_window.h"

namespace efm::bench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::int64_t kPacketNs = 1'000'000;

double secondsSince(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

/// Sensors that see a window forward, backward, forward again, without end: a packet of each camera
/// and a pose every millisecond.
class EndlessSensors {
 public:
  explicit EndlessSensors(const SyntheticWindow& made) : made_(made) {}

  /// Returns what ends at the next millisecond, in the order of time.
  std::vector<mrpt::obs::CObservation::Ptr> next() {
    const auto [t0_ns, t1_ns, t_ref_ns] = made_.window;
    const std::int64_t count = (t1_ns - t0_ns) / kPacketNs;
    const bool backward = number_ / count % 2 == 1;
    const std::int64_t index = backward ? count - 1 - number_ % count : number_ % count;
    const std::int64_t from_ns = t0_ns + index * kPacketNs;
    const std::int64_t until_ns = from_ns + kPacketNs;
    const std::int64_t begin_ns = t0_ns + number_ * kPacketNs;
    const auto moved = [&, from = from_ns](std::int64_t t_ns) {
      return begin_ns + (backward ? until_ns - 1 - t_ns : t_ns - from);
    };
    ++number_;

    auto pose = mrpt::obs::CObservationRobotPose::Create();
    pose->sensorLabel = "tracker";
    pose->timestamp = mrptTimeFrom(begin_ns);
    pose->pose.mean = mrptPoseFrom(*made_.trajectory.poseAt(backward ? until_ns : from_ns));
    std::vector<mrpt::obs::CObservation::Ptr> observations = {pose};
    for (std::size_t camera = 0; camera < made_.events.size(); ++camera) {
      const RigCamera& calibration = made_.rig.cameras[camera];
      auto packet = CObservationEvents::Create();
      packet->sensorLabel = "cam" + std::to_string(camera);
      packet->timestamp = mrptTimeFrom(begin_ns);
      packet->camera_index = static_cast<int>(camera);
      packet->camera = calibration.model;
      packet->camera_pose = mrptPoseFrom(calibration.T_rig_cam);
      const EventSpan all = made_.events[camera];
      for (Event event : all.between(from_ns, until_ns)) {
        event.t_ns = moved(event.t_ns);
        packet->events.push_back(event);
      }
      if (backward) std::reverse(packet->events.begin(), packet->events.end());
      observations.push_back(packet);
    }
    return observations;
  }

 private:
  const SyntheticWindow& made_;
  std::int64_t number_ = 0;
};

/// Feeds the builder at the speed of the sensors, and measures the calls that the host waits for.
void feedAtSensorSpeed(benchmark::State& state, const SyntheticWindow& made) {
  EventFusionOptions options;
  options.live.enabled = true;
  options.mapper.policy.window_s = options.mapper.policy.stride_s = 0.2;
  options.mapper.keyframe.planes = made.options.planes;
  options.rig.time_offsets_ns.resize(made.rig.cameras.size());  // so it knows how many there are
  CEventFusionMapBuilder builder(options);
  builder.logging_enable_console_output = false;
  std::mutex mutex;
  std::deque<std::pair<std::int64_t, Clock::time_point>> fed;
  std::vector<double> delays_ms;  // from the last event of a window to its keyframe
  builder.setKeyframeCallback([&](const KeyframeDepthMap& keyframe) {
    const std::lock_guard<std::mutex> lock(mutex);
    while (fed.size() > 1 && fed.front().first < keyframe.window.t1_ns) fed.pop_front();
    delays_ms.push_back(1e3 * secondsSince(fed.front().second));
  });

  EndlessSensors sensors(made);
  std::int64_t t_ns = made.window.t0_ns;
  double slowest_ms = 0;
  const Clock::time_point begin = Clock::now();
  for (auto _ : state) {
    const auto observations = sensors.next();
    t_ns += kPacketNs;
    std::this_thread::sleep_until(begin + std::chrono::nanoseconds(t_ns - made.window.t0_ns));
    const Clock::time_point call = Clock::now();
    for (const auto& observation : observations) builder.processObservation(observation);
    builder.snapshot();
    const double call_s = secondsSince(call);
    state.SetIterationTime(call_s);
    slowest_ms = std::max(slowest_ms, 1e3 * call_s);
    const std::lock_guard<std::mutex> lock(mutex);
    fed.emplace_back(t_ns, call);
  }
  builder.finish();
  const SessionStatus status = builder.status();
  const std::lock_guard<std::mutex> lock(mutex);
  std::sort(delays_ms.begin(), delays_ms.end());
  state.counters["slowest_ms"] = slowest_ms;
  state.counters["keyframes"] = static_cast<double>(status.counts.keyframes);
  state.counters["delay_ms"] = delays_ms.empty() ? 0 : delays_ms[delays_ms.size() / 2];
  state.counters["lost"] = status.live->dropRatio();
}

}  // namespace

void addLive(const Sensors& sensors) {
  for (const int cameras : {1, 2}) {
    const auto made =
        lazily([window = sensors.front().window(cameras)] { return makeSyntheticWindow(window); });
    add("live/cameras:" + std::to_string(cameras), [=](benchmark::State& state) {
      feedAtSensorSpeed(state, made());
    })->UseManualTime();
  }
}

}  // namespace efm::bench
