// SPDX-License-Identifier: BSD-3-Clause
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mapping/dsi/voting_kernel.h"
#include "mapping/keyframes/keyframe_mapper.h"
#include "test/bench/benches.h"
#include "test/bench/performance_ratios.h"
#include "test/bench/synthetic_window.h"

namespace efm::bench {
namespace {

const std::vector<WindowMotion>& motions() {
  static const std::vector<WindowMotion> all = {
      {"sideways", {0.5 * kNearLimit_m, 0, 0}},
      {"forward, half the near limit", {0, 0, 0.5 * kNearLimit_m}},
      {"forward, the near limit", {0, 0, kNearLimit_m}},
      {"forward, 3 near limits", {0, 0, 3 * kNearLimit_m}},
      {"backward, the near limit", {0, 0, -kNearLimit_m}},
      {"rotation alone", {0, 0, 0}, 20},
      {"turn on the spot", {0, 0, 0}, 90},
      {"circling", {0, 0, 0}, 30, 2},
  };
  return all;
}

KeyframeMapperOptions asShipped(KeyframeMapperOptions options) {
  options.split = SplitFusionOptions();
  options.extraction = DepthExtractionOptions();
  return options;
}

/// Adds a keyframe with the default options and with the paper's, on the fastest kernel and on the
/// plain one.
void addKeyframes(BenchSession& session, const std::string& name,
                  const SyntheticWindowOptions& window, int subintervals = 1) {
  // Made by the first benchmark that runs: a filter may leave out all of them.
  const auto lazy = std::make_shared<std::optional<SyntheticWindow>>();
  std::vector<int> cameras;
  for (int camera = 0; camera < window.cameras; ++camera) cameras.push_back(camera);
  for (const char* group : {kAsShipped, kAsPaper}) {
    for (const VotingKernel kernel : {VotingKernel::kPlain, fastestKernel()}) {
      const int planes = session.plan().planes;
      session.add({group, name, std::string(nameOf(kernel))}, [=](benchmark::State& state) {
        if (!*lazy) *lazy = makeSyntheticWindow(window);
        const SyntheticWindow* made = &**lazy;
        KeyframeMapperOptions options =
            group == kAsShipped ? asShipped(made->options) : made->options;
        options.planes.num_planes = planes;
        options.subintervals.count = subintervals;
        options.sweep.threads = 1;
        options.sweep.kernel = kernel;
        const std::vector<EventSpan> events(made->events.begin(), made->events.end());
        KeyframeMapper mapper(made->rig, cameras, options);
        for (auto _ : state) {
          benchmark::DoNotOptimize(mapper.map(made->window, events, made->trajectory));
        }
        const double count = static_cast<double>(cameras.size() * window.events_per_camera);
        countRate(state, "votes/s", count * planes);
      });
    }
  }
  session.run();
}

}  // namespace

void benchMotions(BenchSession& session) {
  const std::vector<SensorSize>& sensors = session.plan().sensors;
  for (const SensorSize& sensor : sensors) {
    const bool smallest = &sensor == &sensors.front();
    addKeyframes(session, sensor.name() + " hand-held", sensor.window(2));
    for (const WindowMotion& motion : motions()) {
      const std::string name = motion.name;
      if (!smallest && name != "sideways" && name != "forward, 3 near limits") continue;
      SyntheticWindowOptions window = sensor.window(2);
      window.motion = motion;
      addKeyframes(session, sensor.name() + " " + name, window);
    }
  }
  const SensorSize& sensor = sensors.front();
  SyntheticWindowOptions strong = sensor.window(2);
  strong.strong_lens = true;
  addKeyframes(session, sensor.name() + " strong lens", strong);
  addKeyframes(session, sensor.name() + " 1 camera", sensor.window(1));
  addKeyframes(session, sensor.name() + " 3 cameras", sensor.window(3));
  addKeyframes(session, sensor.name() + " 8 sub-intervals", sensor.window(2), 8);
}

}  // namespace efm::bench
