// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "test/bench/bench_session.h"

namespace efm::bench {

/// Votes of one camera on one thread, per kernel and sensor, and the yardstick.
void benchVoting(BenchSession& session);
/// Whole stereo keyframes with their stages and memory, fused and unfused; of the kernels between
/// the plain and the fastest one only the smallest size on one thread.
void benchKeyframes(BenchSession& session);
/// The six rules, and the running peaks.
void benchFusion(BenchSession& session);
/// From peaks to a depth map.
void benchExtraction(BenchSession& session);
/// Inserting a keyframe's cloud into small and large maps.
void benchGlobalCloud(BenchSession& session);
/// Events from text, as `import` reads them, and from a rawlog, as `map` does.
void benchReading(BenchSession& session);
/// A keyframe's time against everything it grows with.
void benchGrowth(BenchSession& session);

}  // namespace efm::bench
