// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <ctime>
#include <functional>
#include <optional>
#include <utility>

#include "mapping/keyframes/keyframe_depth_map.h"

namespace efm {

/// Seconds of a run, by stage: of real time, or of processor time.
struct StageSeconds {
  double total = 0;   ///< The whole run.
  double read = 0;    ///< Reading the recording.
  double sweep = 0;   ///< Packets, back-projection, votes and fusion.
  double depth = 0;   ///< Extraction of depth maps.
  double refine = 0;  ///< Refinement of poses.
  double map = 0;     ///< Insertion into the global cloud; of real time also its export.
  double filter = 0;  ///< Checks, buffering and noise filters of events.
  double images = 0;  ///< Images of keyframes.
  double start = 0;   ///< Before the command: the program and its libraries are loaded.
  double tables = 0;  ///< The rig and the undistortion tables of its cameras.
  double output = 0;  ///< Processor time alone: export of the map, and its files.
};

/// Real and processor time of the same stages.
struct StageTimes {
  StageSeconds real;
  StageSeconds cpu;
};

/// Reads a clock of processor time, in seconds.
using ProcessorClock = std::function<double()>;

inline double secondsOf(clockid_t clock) {
  std::timespec now{};
  clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}
/// Processor time of all threads of this process, or of this thread.
inline double processSeconds() { return secondsOf(CLOCK_PROCESS_CPUTIME_ID); }
inline double threadSeconds() { return secondsOf(CLOCK_THREAD_CPUTIME_ID); }

/// Adds the time from its construction to its destruction to two sums: real time, and the time of a
/// processor clock.
class SecondsScope {
 public:
  /// @param clock by default this thread's.
  SecondsScope(double& real_s, double& cpu_s, ProcessorClock clock = threadSeconds)
      : real_s_(real_s), cpu_s_(cpu_s), clock_(std::move(clock)), cpu_begin_s_(clock_()) {}
  ~SecondsScope() {
    real_s_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
    cpu_s_ += clock_() - cpu_begin_s_;
  }
  SecondsScope(const SecondsScope&) = delete;
  SecondsScope& operator=(const SecondsScope&) = delete;

 private:
  double& real_s_;
  double& cpu_s_;
  ProcessorClock clock_;
  double cpu_begin_s_;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

/// Measures the stages of the mapping, which do not overlap.
class StageTimer : public StageHook {
 public:
  /// @param clock of all threads of the mapping.
  StageTimer(StageTimes& times, const ProcessorClock& clock) : times_(times), clock_(clock) {}

  void begin(Stage stage) override {
    double StageSeconds::*const sum = sumOf(stage);
    scope_.emplace(times_.real.*sum, times_.cpu.*sum, clock_);
  }
  void end(Stage) override { scope_.reset(); }

 private:
  static double StageSeconds::*sumOf(Stage stage) {
    switch (stage) {
      case Stage::kFilter:
        return &StageSeconds::filter;
      case Stage::kSweep:
        return &StageSeconds::sweep;
      case Stage::kDepth:
        break;
    }
    return &StageSeconds::depth;
  }

  StageTimes& times_;
  const ProcessorClock& clock_;
  std::optional<SecondsScope> scope_;
};

}  // namespace efm
