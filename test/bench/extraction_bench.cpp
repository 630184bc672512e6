// SPDX-License-Identifier: BSD-3-Clause
#include <vector>

#include "mapping/depth_extraction.h"
#include "mapping/keyframe_mapper.h"
#include "test/bench/benches.h"
#include "test/bench/synthetic_window.h"

namespace efm::bench {
namespace {

/// Keeps a DSI as it comes from the mapper.
class PeakSink : public DsiSink {
 public:
  explicit PeakSink(const ReferenceView& view) : view_(view), peaks_(view.pixels()) {}
  /// @param plane in order, which one thread ensures.
  void takePlane(int plane, const float* values) override {
    peaks_.take(plane, {values, values + view_.pixels()});
  }
  DsiPeaks peaks() const { return peaks_.images(view_); }

 private:
  ReferenceView view_;
  RunningPeaks peaks_;
};

/// The peaks of a stereo keyframe.
DsiPeaks peaksOf(const SyntheticWindow& made, const KeyframeMapperOptions& options) {
  KeyframeMapper mapper(made.rig, {0, 1}, options);
  PeakSink sink(mapper.view());
  mapper.map(made.window, {made.events.begin(), made.events.end()}, made.trajectory, &sink);
  return sink.peaks();
}

}  // namespace

void benchExtraction(BenchSession& session) {
  for (const SensorSize& sensor : session.plan().sensors) {
    const SyntheticWindow made = makeSyntheticWindow(sensor.window(2));
    KeyframeMapperOptions options = made.options;
    options.planes.num_planes = session.plan().planes;
    options.sweep.threads = 1;
    const DsiPeaks peaks = peaksOf(made, options);
    const DepthPlanes planes(options.planes);
    session.add({"extraction", sensor.name(), ""}, [&](benchmark::State& state) {
      for (auto _ : state) {
        benchmark::DoNotOptimize(extractDepth(peaks, planes, options.extraction));
      }
      state.counters["pixels/s"] = benchmark::Counter(
          static_cast<double>(peaks.plane.total()), benchmark::Counter::kIsIterationInvariantRate);
    });
    session.run();
  }
}

}  // namespace efm::bench
