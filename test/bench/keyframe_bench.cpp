// SPDX-License-Identifier: BSD-3-Clause
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mapping/dsi/voting_kernel.h"
#include "mapping/keyframes/keyframe_mapper.h"
#include "test/bench/benches.h"
#include "test/bench/peak_memory.h"
#include "test/bench/performance_ratios.h"
#include "test/bench/stage_clock.h"
#include "test/bench/synthetic_window.h"
#include "test/bench/unfused_keyframe.h"

namespace efm::bench {
namespace {

/// Makes the keyframe of a window once.
using KeyframeRun = std::function<void(StageHook*)>;
/// Prepares a run. Its memory counts as the keyframe's, its time does not.
using Preparation = std::function<KeyframeRun()>;

std::vector<EventSpan> spansOf(const SyntheticWindow& made) {
  return {made.events.begin(), made.events.end()};
}

Preparation fused(const SyntheticWindow& made, VotingKernel kernel, int threads) {
  return [&made, kernel, threads] {
    KeyframeMapperOptions options = made.options;
    options.sweep.kernel = kernel;
    options.sweep.threads = threads;
    const auto mapper = std::make_shared<KeyframeMapper>(made.rig, std::vector<int>{0, 1}, options);
    return [&made, mapper, events = spansOf(made)](StageHook* stages) {
      benchmark::DoNotOptimize(mapper->map(made.window, events, made.trajectory, nullptr, stages));
    };
  };
}

Preparation unfused(const SyntheticWindow& made) {
  return [&made] {
    const auto mapper = std::make_shared<UnfusedKeyframe>(made.rig, made.options);
    return [&made, mapper, events = spansOf(made)](StageHook* stages) {
      benchmark::DoNotOptimize(mapper->map(made.window, events, made.trajectory, stages));
    };
  };
}

void countEvents(benchmark::State& state, const SyntheticWindow& made) {
  double events = 0;
  for (const auto& of_camera : made.events) events += static_cast<double>(of_camera.size());
  const double votes = events * made.options.planes.num_planes;
  countRate(state, "events/s", events);
  countRate(state, "votes/s", votes);
}

/// Measures the memory without the events, then the time.
void addKeyframe(BenchSession& session, const BenchCase& what, const SyntheticWindow& made,
                 const Preparation& prepare) {
  const std::optional<double> peak_mb = peakMemory_mb([&] { prepare()(nullptr); });
  session.add(what, [&made, prepare, peak_mb](benchmark::State& state) {
    const KeyframeRun run = prepare();
    StageClock stages;
    for (auto _ : state) run(&stages);
    countEvents(state, made);
    constexpr auto kMean = benchmark::Counter::kAvgIterations;
    state.counters["warp_ms"] = benchmark::Counter(stages.warp_ms, kMean);
    state.counters["sweep_ms"] = benchmark::Counter(stages.sweep_ms, kMean);
    state.counters["depth_ms"] = benchmark::Counter(stages.depth_ms, kMean);
    if (peak_mb) state.counters["peak_mb"] = *peak_mb;
  });
}

}  // namespace

void benchKeyframes(BenchSession& session) {
  for (const SensorSize& sensor : session.plan().sensors) {
    SyntheticWindow made = makeSyntheticWindow(sensor.window(2));
    made.options.planes.num_planes = session.plan().planes;
    addKeyframe(session, {"keyframe", sensor.name(), kUnfused}, made, unfused(made));
    const bool smallest = sensor.width == session.plan().sensors.front().width;
    for (const VotingKernel kernel : availableKernels()) {
      const bool outermost = kernel == VotingKernel::kPlain || kernel == fastestKernel();
      if (!outermost && !smallest) continue;
      for (const int threads : {1, 2}) {
        if (!outermost && threads > 1) continue;
        addKeyframe(session, {"keyframe", sensor.name(), std::string(nameOf(kernel)), threads},
                    made, fused(made, kernel, threads));
      }
    }
    session.run();
  }
}

}  // namespace efm::bench
