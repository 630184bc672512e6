// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>

#include "mapping/keyframes/stage.h"

namespace efm {

/// Seconds of a run, by stage.
struct StageSeconds {
  double total = 0;   ///< The whole run.
  double read = 0;    ///< Reading the recording.
  double sweep = 0;   ///< Packets, back-projection, votes and fusion.
  double depth = 0;   ///< Extraction of depth maps.
  double refine = 0;  ///< Refinement of poses.
  double map = 0;     ///< Insertion into the global cloud and its export.
};

/// Adds the time from its construction to its destruction to a sum.
class SecondsScope {
 public:
  explicit SecondsScope(double& seconds) : seconds_(seconds) {}
  ~SecondsScope() {
    seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
  }
  SecondsScope(const SecondsScope&) = delete;
  SecondsScope& operator=(const SecondsScope&) = delete;

 private:
  double& seconds_;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

/// Measures the stages of the mapping.
class StageTimer : public StageHook {
 public:
  explicit StageTimer(StageSeconds& seconds) : seconds_(seconds) {}

  void begin(Stage) override { begin_ = std::chrono::steady_clock::now(); }
  void end(Stage stage) override {
    double& sum = stage == Stage::kSweep ? seconds_.sweep : seconds_.depth;
    sum += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
  }

 private:
  StageSeconds& seconds_;
  std::chrono::steady_clock::time_point begin_;
};

}  // namespace efm
