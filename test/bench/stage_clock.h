// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ctime>

#include "mapping/keyframes/keyframe_depth_map.h"

namespace efm::bench {

/// Returns the CPU time of all threads of this process since its start, in milliseconds.
inline double processCpu_ms() {
  constexpr double kMsPerSecond = 1e3;
  constexpr double kMsPerNanosecond = 1e-6;
  std::timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return kMsPerSecond * static_cast<double>(now.tv_sec) +
         kMsPerNanosecond * static_cast<double>(now.tv_nsec);
}

/// Adds up the CPU time of the stages of keyframes. A keyframe enters the sweep stage twice: first
/// for pose packets and back-projection (`warp_ms`), then for votes and fusion (`sweep_ms`).
class StageClock : public StageHook {
 public:
  double warp_ms = 0;
  double sweep_ms = 0;
  double depth_ms = 0;

  void begin(Stage) override { begin_ms_ = processCpu_ms(); }
  void end(Stage stage) override {
    const double spent_ms = processCpu_ms() - begin_ms_;
    if (stage == Stage::kDepth) {
      depth_ms += spent_ms;
      warped_ = false;
    } else {
      (warped_ ? sweep_ms : warp_ms) += spent_ms;
      warped_ = true;
    }
  }

 private:
  double begin_ms_ = 0;
  bool warped_ = false;
};

}  // namespace efm::bench
