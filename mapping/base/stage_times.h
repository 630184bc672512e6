// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>

namespace efm {

/// Seconds of a run, by stage: real time or processor time.
struct StageSeconds {
  double total = 0;   ///< The whole run.
  double read = 0;    ///< Reading the recording.
  double look = 0;    ///< First look: choice of options, checks of poses and cameras.
  double rays = 0;    ///< Pose packets and back-projection.
  double sweep = 0;   ///< Votes and fusion.
  double depth = 0;   ///< Extraction of depth maps.
  double motion = 0;  ///< Correction of the motion within windows, with the sweeps that it needs.
  double refine = 0;  ///< Refinement of poses.
  double map = 0;     ///< Insertion into the global cloud; in real time also its export.
  double filter = 0;  ///< Checks, buffering and noise filters of events.
  double images = 0;  ///< Images of keyframes.
  double start = 0;   ///< Loading of the program and its libraries, before the command.
  double tables = 0;  ///< Set-up of the rig and the undistortion tables of its cameras.
  double output = 0;  ///< Export of the map and its files; in processor time only.
};

/// Real and processor time of the same stages.
struct StageTimes {
  StageSeconds real;
  StageSeconds cpu;
};

/// Return the processor time of all threads of this process, of this thread, and of all threads of
/// WorkAside.
double processSeconds();
double threadSeconds();
double asideSeconds();

/// While it exists, the current thread's processor time does not count for the stages of others.
/// Make it first in a thread, and destroy it there: the thread's whole time counts as aside.
class WorkAside {
 public:
  WorkAside();
  ~WorkAside();
  WorkAside(const WorkAside&) = delete;
  WorkAside& operator=(const WorkAside&) = delete;
};

/// The threads whose processor time a stage has: this one, or all except those of WorkAside.
enum class Processors { kThis, kAll };

/// Adds the time from its construction to its destruction to a stage.
class StageScope {
 public:
  /// @param times may be null: then no clock is read.
  StageScope(StageTimes* times, double StageSeconds::*stage, Processors of = Processors::kAll);
  ~StageScope();
  StageScope(const StageScope&) = delete;
  StageScope& operator=(const StageScope&) = delete;

 private:
  StageTimes* times_;
  double StageSeconds::*stage_;
  Processors of_;
  double cpu_begin_s_ = 0;
  std::chrono::steady_clock::time_point begin_;
};

}  // namespace efm
