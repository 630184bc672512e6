// SPDX-License-Identifier: BSD-3-Clause
#include <malloc.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <map>
#include <memory>
#include <numeric>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "mapping/dsi/dsi_grid.h"
#include "mapping/keyframes/keyframe_mapper.h"
#include "test/bench/benches.h"
#include "test/bench/unfused_keyframe.h"

namespace efm::bench {
namespace {

/// A keyframe of a window, with the paper's fusion and depth extraction or with the defaults.
struct KeyframeCase {
  VotingKernel kernel = VotingKernel::kPlain;
  int threads = 1;
  int planes = kPlanes;
  int subintervals = 1;
  bool as_shipped = false;

  KeyframeMapper mapper(const SyntheticWindow& made) const {
    KeyframeMapperOptions options = made.options;
    if (as_shipped) {
      options.split = SplitFusionOptions();
      options.extraction = DepthExtractionOptions();
    }
    options.planes.num_planes = planes;
    options.subintervals.count = subintervals;
    options.sweep.threads = threads;
    options.sweep.kernel = kernel;
    std::vector<int> cameras(made.events.size());
    std::iota(cameras.begin(), cameras.end(), 0);
    return {made.rig, cameras, options};
  }
};

const std::set<VotingKernel>& plainAndFastest() {
  static const std::set<VotingKernel> both = {VotingKernel::kPlain, fastestKernel()};
  return both;
}

std::vector<EventSpan> spansOf(const SyntheticWindow& made) {
  return {made.events.begin(), made.events.end()};
}

void countVotes(benchmark::State& state, const SyntheticWindow& made, int planes) {
  double events = 0;
  for (const auto& of_camera : made.events) events += static_cast<double>(of_camera.size());
  countRate(state, "events/s", events);
  countRate(state, "votes/s", events * planes);
}

void makeKeyframes(benchmark::State& state, const SyntheticWindow& made, const KeyframeCase& what) {
  const std::vector<EventSpan> events = spansOf(made);
  KeyframeMapper mapper = what.mapper(made);
  for (auto _ : state) benchmark::DoNotOptimize(mapper.map(made.window, events, made.trajectory));
  countVotes(state, made, what.planes);
}

/// Returns a line of /proc/self/status in MB (1e6 bytes); 0 if the line is missing.
double statusLine_mb(const std::string& key) {
  constexpr double kMbPerKib = 1024e-6;
  std::ifstream status("/proc/self/status");
  double kib = 0;
  for (std::string word; status >> word;) {
    if (word == key + ":" && status >> kib) break;
  }
  return kMbPerKib * kib;
}

/// Returns the additional peak memory of this process while `work` runs; NaN if the system cannot
/// reset the peak (Linux can). Google Benchmark's MemoryManager would run every benchmark again.
template <typename Work>
double peakMemory_mb(const Work& work) {
  malloc_trim(0);  // kept free memory would hide new memory
  const bool reset = (std::ofstream("/proc/self/clear_refs") << "5" << std::flush).good();
  if (!reset) return std::numeric_limits<double>::quiet_NaN();
  const double before_mb = statusLine_mb("VmRSS");
  work();
  return statusLine_mb("VmHWM") - before_mb;
}

/// Adds a keyframe with its stages and its memory without the events.
/// @param prepare returns a function that maps the keyframe of a window. The memory of `prepare`
/// counts as the keyframe's, its time does not.
template <typename LazyWindow, typename Prepare>
void addStages(const std::string& name, const LazyWindow& window, const Prepare& prepare) {
  add(name, [=, peak_mb = std::optional<double>()](benchmark::State& state) mutable {
    const SyntheticWindow& made = window();
    if (!peak_mb) peak_mb = peakMemory_mb([&] { prepare(made)(nullptr); });
    auto map = prepare(made);
    StageTimes times;
    for (auto _ : state) map(&times);
    countVotes(state, made, kPlanes);
    constexpr auto kMean = benchmark::Counter::kAvgIterations;
    state.counters["warp_ms"] = benchmark::Counter(1e3 * times.cpu.rays, kMean);
    state.counters["sweep_ms"] = benchmark::Counter(1e3 * times.cpu.sweep, kMean);
    state.counters["depth_ms"] = benchmark::Counter(1e3 * times.cpu.depth, kMean);
    state.counters["peak_mb"] = *peak_mb;
  });
}

/// Adds stereo keyframes, fused and unfused. Kernels other than the plain and the fastest kernel
/// run with the smallest sensor on one thread only.
void addStereo(const SensorSize& sensor, bool smallest) {
  const auto window = lazily([=] { return makeSyntheticWindow(sensor.window(2)); });
  const std::string name = "keyframe/" + sensor.name() + "/";
  addStages(name + "unfused/threads:1", window, [](const SyntheticWindow& made) {
    return [&made, events = spansOf(made),
            keyframe = UnfusedKeyframe(made.rig, made.options)](StageTimes* times) mutable {
      benchmark::DoNotOptimize(keyframe.map(made.window, events, made.trajectory, times));
    };
  });
  for (const VotingKernel kernel : availableKernels()) {
    const bool outermost = plainAndFastest().count(kernel) > 0;
    for (const int threads : {1, 2}) {
      if (!outermost && (threads > 1 || !smallest)) continue;
      KeyframeCase what;
      what.kernel = kernel;
      what.threads = threads;
      addStages(name + std::string(nameOf(kernel)) + "/threads:" + std::to_string(threads), window,
                [=](const SyntheticWindow& made) {
                  return [&made, events = spansOf(made),
                          mapper = what.mapper(made)](StageTimes* times) mutable {
                    benchmark::DoNotOptimize(
                        mapper.map(made.window, events, made.trajectory, nullptr, times));
                  };
                });
    }
  }
}

/// Adds a keyframe with the default options and with the paper's options, by the kernels of most
/// machines.
void addMotion(const std::string& name, const SyntheticWindowOptions& window,
               int subintervals = 1) {
  const auto made = lazily([=] { return makeSyntheticWindow(window); });
  for (const bool as_shipped : {true, false}) {
    for (const VotingKernel kernel : availableKernels()) {
      if (plainAndFastest().count(kernel) == 0 && kernel != VotingKernel::kAvx2) continue;
      const KeyframeCase what{kernel, 1, kPlanes, subintervals, as_shipped};
      add("motion/" + name + (as_shipped ? "/as shipped/" : "/paper/") +
              std::string(nameOf(kernel)),
          [=](benchmark::State& state) { makeKeyframes(state, made(), what); });
    }
  }
}

/// Adds stereo keyframes for several motions and rigs.
void addMotions(const Sensors& sensors) {
  const std::vector<WindowMotion> motions = {
      {"sideways", {0.5 * kNearLimit_m, 0, 0}},
      {"forward, half the near limit", {0, 0, 0.5 * kNearLimit_m}},
      {"forward, the near limit", {0, 0, kNearLimit_m}},
      {"forward, 3 near limits", {0, 0, 3 * kNearLimit_m}},
      {"driving", {0, 0, 1.8 * kNearLimit_m}},  // 0.9 s at 7 m/s, near limit 3.5 m
      {"backward, the near limit", {0, 0, -kNearLimit_m}},
      {"rotation alone", {0, 0, 0}, 20},
      {"turn on the spot", {0, 0, 0}, 90},
      {"circling", {0, 0, 0}, 30, 2},
  };
  const SensorSize& smallest = sensors.front();
  for (const SensorSize& sensor : sensors) {
    addMotion(sensor.name() + " hand-held", sensor.window(2));
    for (const WindowMotion& motion : motions) {
      const std::string name = motion.name;
      const bool everywhere =
          name == "sideways" || name == "forward, 3 near limits" || name == "driving";
      if (&sensor != &smallest && !everywhere) continue;
      SyntheticWindowOptions window = sensor.window(2);
      window.motion = motion;
      addMotion(sensor.name() + " " + name, window);
    }
  }
  SyntheticWindowOptions strong = smallest.window(2);
  strong.strong_lens = true;
  addMotion(smallest.name() + " strong lens", strong);
  addMotion(smallest.name() + " 1 camera", smallest.window(1));
  addMotion(smallest.name() + " 3 cameras", smallest.window(3));
  addMotion(smallest.name() + " 8 sub-intervals", smallest.window(2), 8);
}

/// Adds stereo keyframes with one size multiplied by 1, 2, 4, 8 and 16.
/// @param grow multiplies the size in the window or in the case by `factor`.
template <typename Grow>
void addGrowth(const std::string& name, const SyntheticWindowOptions& smallest, const Grow& grow) {
  const auto windows = std::make_shared<std::map<int, SyntheticWindow>>();  // by factor
  for (const VotingKernel kernel : plainAndFastest()) {
    add("growth/" + name + "/" + std::string(nameOf(kernel)),
        [=](benchmark::State& state) {
          const auto factor = static_cast<int>(state.range(0));
          SyntheticWindowOptions window = smallest;
          KeyframeCase what;
          what.kernel = kernel;
          grow(window, what, factor);
          SyntheticWindow& made = (*windows)[factor];
          if (made.events.empty()) made = makeSyntheticWindow(window);
          makeKeyframes(state, made, what);
          state.SetComplexityN(factor);
        })
        ->RangeMultiplier(2)
        ->Range(1, 16)
        ->Complexity();
  }
}

}  // namespace

void addKeyframes(const Sensors& sensors) {
  const SensorSize& smallest = sensors.front();
  for (const SensorSize& sensor : sensors) addStereo(sensor, &sensor == &smallest);
  addMotions(sensors);
  addGrowth("events", smallest.window(2),
            [](SyntheticWindowOptions& window, KeyframeCase&, unsigned factor) {
              window.events_per_camera *= factor;
            });
  addGrowth("planes", smallest.window(2),
            [](SyntheticWindowOptions&, KeyframeCase& what, int factor) {
              what.planes = kPlanes / 2 * factor;
            });
  addGrowth(
      "cameras", smallest.window(2),
      [](SyntheticWindowOptions& window, KeyframeCase&, int factor) { window.cameras = factor; });
  addGrowth(
      "subintervals", smallest.window(2),
      [](SyntheticWindowOptions&, KeyframeCase& what, int factor) { what.subintervals = factor; });
  addGrowth("pixels", smallest.window(2),
            [](SyntheticWindowOptions& window, KeyframeCase&, int factor) {
              const double scale = std::sqrt(0.25 * factor);
              window.width = static_cast<int>(std::round(window.width * scale));
              window.height = static_cast<int>(std::round(window.height * scale));
            });
}

}  // namespace efm::bench
