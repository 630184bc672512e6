// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "maps/cloud/map_point.h"
#include "maps/refinement/keyframe_refiner.h"
#include "test/studies/recordings/study_run.h"
#include "test/studies/refinement/false_loops.h"
#include "test/studies/refinement/map_truth.h"
#include "tracking_stub/sensor/simulated_rig.h"

namespace efm::studies {

/// A recording and its mapping options.
struct RefinementCase {
  std::string name;
  std::string file;  ///< Name in the cache.
  std::function<Simulation()> simulation;
  double min_depth_m;
  double max_depth_m;
  double window_s;
  bool is_loop = false;  ///< Returns to its first positions at the end.
};

/// The errors of the same keyframes at the tracker's poses and at refined poses.
struct RefinementOutcome {
  MapErrors without;
  MapErrors with;
};

/// Maps and trajectories for the pictures.
struct RefinementDrawing {
  MapCloud::ConstPtr tracker_map, refined_map;
  std::vector<Rigid3> T_world_true, T_odom_ref, T_world_ref;
};

/// The results of a recording, by seed.
struct RefinementResults {
  std::vector<RefinementOutcome> noise, drift, exact, small_noise, noise_feared, noise_denied;
  std::vector<FalseLoops> false_loops;
  std::vector<double> seconds, processor_seconds;  ///< Of keyframes with a full window.
  std::size_t keyframes = 0;
  std::vector<RefinementCounts> loops;  ///< With drift.
  RefinementDrawing drawing;            ///< Of the loop with drift, seed 1.
};

using RefinementStudyResults = std::vector<std::pair<RefinementCase, RefinementResults>>;

/// The recordings of the study; one in a quick run.
std::vector<RefinementCase> casesOf(const StudyRun& run);

/// Maps all recordings with tracker errors, in parallel. Then measures the time of each, one after
/// the other.
/// @param all gets the results.
void mapAll(const StudyRun& run, RefinementStudyResults& all);

}  // namespace efm::studies
