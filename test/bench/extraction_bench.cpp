// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/depth/paper_extraction.h"
#include "mapping/sweep/space_sweep.h"
#include "test/bench/benches.h"
#include "test/bench/sweep_input.h"

namespace efm::bench {

void benchExtraction(BenchSession& session) {
  for (const SensorSize& sensor : session.plan().sensors) {
    const SweepInput input =
        makeSweepInput(makeSyntheticWindow(sensor.window(2)), session.plan().planes);
    const DsiPeaks peaks = sweepSpace(input.cameras, {input.view, input.planes}).fused.peaks;
    session.add({"extraction", sensor.name(), ""}, [&](benchmark::State& state) {
      for (auto _ : state) benchmark::DoNotOptimize(extractAsPaper(peaks, input.planes, {}));
      countRate(state, "pixels/s", static_cast<double>(input.view.pixels()));
    });
    session.run();
  }
}

}  // namespace efm::bench
