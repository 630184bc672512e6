// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "test/bench/bench_session.h"

namespace efm::bench {

/// Votes of one camera on one thread, per kernel and sensor, and the yardstick.
void benchVoting(BenchSession& session);
/// Whole stereo keyframes with stages and memory, fused and unfused. Kernels between the plain and
/// the fastest one run with the smallest size on one thread only.
void benchKeyframes(BenchSession& session);
/// Stereo keyframes as shipped and with the paper's options, for several motions and rigs, on the
/// fastest kernel and the plain one, on one thread.
void benchMotions(BenchSession& session);
/// The six rules and the running peaks.
void benchFusion(BenchSession& session);
/// From peaks to a depth map.
void benchExtraction(BenchSession& session);
/// Inserting a keyframe's cloud into small and large maps.
void benchGlobalCloud(BenchSession& session);
/// Events from text and from a rawlog.
void benchReading(BenchSession& session);
/// A keyframe's time over each of its sizes.
void benchGrowth(BenchSession& session);

}  // namespace efm::bench
