// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "mapping/dsi/voting_kernel.h"
#include "mapping/keyframes/keyframe_mapper.h"
#include "test/bench/benches.h"
#include "test/bench/synthetic_window.h"

namespace efm::bench {
namespace {

/// A keyframe with one changed size.
struct GrownKeyframe {
  SyntheticWindowOptions window;
  int planes = 0;
  int subintervals = 1;
  double size = 0;  // the changed size
};

/// A size of a keyframe.
struct Growth {
  std::string name;
  /// Makes the keyframe 2^step times as large. @return its size.
  std::function<double(GrownKeyframe&, int step)> grow;
};

const std::vector<Growth>& growths() {
  static const std::vector<Growth> all = {
      {"events",
       [](GrownKeyframe& keyframe, int step) {
         keyframe.window.events_per_camera <<= step;
         return static_cast<double>(keyframe.window.events_per_camera);
       }},
      {"planes",
       [](GrownKeyframe& keyframe, int step) {
         keyframe.planes = keyframe.planes / 2 << step;
         return static_cast<double>(keyframe.planes);
       }},
      {"cameras",
       [](GrownKeyframe& keyframe, int step) {
         keyframe.window.cameras = 1 << step;
         return static_cast<double>(keyframe.window.cameras);
       }},
      {"subintervals",
       [](GrownKeyframe& keyframe, int step) {
         keyframe.subintervals = 1 << step;
         return static_cast<double>(keyframe.subintervals);
       }},
      {"pixels",
       [](GrownKeyframe& keyframe, int step) {
         const double scale = std::sqrt(0.25 * (1 << step));
         keyframe.window.width = static_cast<int>(std::round(keyframe.window.width * scale));
         keyframe.window.height = static_cast<int>(std::round(keyframe.window.height * scale));
         return static_cast<double>(keyframe.window.width) * keyframe.window.height;
       }},
  };
  return all;
}

void makeKeyframes(benchmark::State& state, const GrownKeyframe& grown, const SyntheticWindow& made,
                   VotingKernel kernel) {
  KeyframeMapperOptions options = made.options;
  options.planes.num_planes = grown.planes;
  options.subintervals.count = grown.subintervals;
  options.sweep.threads = 1;
  options.sweep.kernel = kernel;
  std::vector<int> cameras;
  for (int camera = 0; camera < grown.window.cameras; ++camera) cameras.push_back(camera);
  const std::vector<EventSpan> events(made.events.begin(), made.events.end());
  KeyframeMapper mapper(made.rig, cameras, options);
  for (auto _ : state) benchmark::DoNotOptimize(mapper.map(made.window, events, made.trajectory));
  state.counters["size"] = grown.size;
}

}  // namespace

void benchGrowth(BenchSession& session) {
  for (const Growth& growth : growths()) {
    for (int step = 0; step < session.plan().growth_steps; ++step) {
      GrownKeyframe grown;
      grown.window = session.plan().sensors.front().window(2);
      grown.planes = session.plan().planes;
      grown.size = growth.grow(grown, step);
      const auto made = std::make_shared<SyntheticWindow>(makeSyntheticWindow(grown.window));
      for (const VotingKernel kernel : std::set{VotingKernel::kPlain, fastestKernel()}) {
        session.add({"growth", growth.name + "/" + std::to_string(std::llround(grown.size)),
                     std::string(nameOf(kernel))},
                    [=](benchmark::State& state) { makeKeyframes(state, grown, *made, kernel); });
      }
    }
    session.run();
  }
}

}  // namespace efm::bench
