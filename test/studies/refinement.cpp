// SPDX-License-Identifier: BSD-3-Clause
// Poses of keyframes refined, with drift and noise of the tracker.
#include <algorithm>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "maps/metrics/sample_statistics.h"
#include "test/studies/refinement/refinement_pictures.h"
#include "test/studies/refinement/refinement_tables.h"
#include "test/studies/studies.h"

namespace efm::studies {
namespace {

void introduce(const RefinementStudyResults& all, StudySection& section) {
  std::string recordings;
  for (const auto& [what, results] : all) {
    recordings +=
        (recordings.empty() ? "" : "; ") + what.name + ": " + std::to_string(results.keyframes) +
        " keyframes of " + formatNumber(what.window_s, 1) + " s, planes from " +
        formatNumber(what.min_depth_m, 1) + " to " + formatNumber(what.max_depth_m, 1) + " m";
  }
  section.text(
      "The paper does not change poses. With `[refinement] enabled = true` keyframes are "
      "registered with each other, their poses are solved together, and the map is corrected. "
      "Three recordings: the preset `room_stereo`; a *loop* in the same room that returns to its "
      "first position after 20 s of 24; MVSEC's rig on its real trajectory, smoothed, for 20 s in "
      "a simulated room (" +
      recordings +
      "). The pipeline gets events and poses at 200 Hz. Only the depth range and the windows "
      "differ from the default options.");
  section.text(
      "Each cell: the error of the same keyframes at the tracker's poses → at the refined ones "
      "(the ratio). *Trajectory*: root mean square of the keyframes' errors; *map*: median "
      "distance of the exported points to the nearest surface; *rays*: median distance of "
      "keyframes' points to the true ends of their rays; *walls*: thickness of walls, floor and "
      "ceiling, which is half of the distance between the 16th and the 84th percentile of the "
      "distances from a wall, of points that are nearest to it, at most 0.3 m from it and at least "
      "0.3 m inside its borders; mean of all walls, weighted by points. Before these, a rigid "
      "motion aligns the trajectory and the map with the truth. *End to end*: the relative pose of "
      "the first and the last keyframe compared with the true one. Means are of the errors, with "
      "the ratio of the means.");
}
void judgeNoise(const RefinementStudyResults& all, StudySection& section) {
  for (const auto& [what, results] : all) {
    for (const auto& [name, figure] :
         {std::pair{"trajectory error", kTrajectory}, std::pair{"median map error", kMap}}) {
      section.trend(what.name + ": with noise the " + name + " is at most 0.75 times as large",
                    ratioOf(results.noise, figure) <= 0.75, ratiosOf(results.noise, figure));
    }
  }
}

void judgeDrift(const RefinementStudyResults& all, StudySection& section) {
  const std::string loops_lost =
      "Drift within a window distorts the depth map itself. No keyframe pose can correct this, and "
      "registrations then show half of the drift.";
  for (const auto& [what, results] : all) {
    if (!what.is_loop) continue;
    const double exact_m = meanOf(results.exact, &RefinementOutcome::without, kWalls);
    const std::string walls_too =
        " With exact poses the walls are " + formatNumber(100 * exact_m, 2) + " cm thick.";
    for (const auto& [name, figure, most, departure] :
         {std::tuple{"end-to-end error", kEnd, 0.3, loops_lost},
          std::tuple{"end-to-end turn", kEndRotation, 0.3, loops_lost},
          std::tuple{"walls' thickness", kWalls, 0.5, loops_lost + walls_too}}) {
      section.trend(what.name + ": with drift the " + name + " is at most " +
                        formatNumber(most, 1) + " times as large",
                    ratioOf(results.drift, figure) <= most, ratiosOf(results.drift, figure),
                    departure);
    }
  }
}

void judgeRest(const RefinementStudyResults& all, StudySection& section) {
  for (const auto& [what, results] : all) {
    section.trend(
        what.name + ": with exact poses the median map error is at most 1.02 times as large",
        ratioOf(results.exact, kMap) <= 1.02,
        formatNumber(ratioOf(results.exact, kMap), 3) + " times");
  }
  for (const auto& [what, results] : all) {
    double moved_m = 0;
    for (const FalseLoops& loops : results.false_loops) moved_m = std::max(moved_m, loops.moved_m);
    section.trend(what.name + ": false loops move no pose by more than 2 cm", moved_m <= 0.02,
                  formatNumber(100 * moved_m, 2) + " cm");
  }
  for (const auto& [what, results] : all) {
    const double processor_ms = 1e3 * quantileOf(results.processor_seconds, 0.5);
    section.trend(
        what.name + ": a keyframe takes at most 100 ms", quantileOf(results.seconds, 0.5) <= 0.1,
        formatNumber(1e3 * quantileOf(results.seconds, 0.5), 1) + " ms, median, real time; " +
            formatNumber(processor_ms, 1) + " ms of the processor",
        processor_ms <= 100 ? "Real time includes waiting for other processes."
                            : "Even the processor takes longer.");
  }
}
}  // namespace

void studyRefinement(const StudyRun& run, StudySection& section) {
  const std::vector<RefinementCase> cases = casesOf(run);
  RefinementStudyResults all;
  for (const RefinementCase& what : cases) all.emplace_back(what, RefinementResults{});
  mapAll(run, all);
  introduce(all, section);
  section.heading("Noise");
  section.text(
      "Noise of 1 cm and 0.5° on each axis, random for each window and constant within it.");
  seedTable(all, &RefinementResults::noise, section);
  section.heading("Drift");
  section.text("The position drifts by 1 % of the path length, and the heading by 0.5° per metre.");
  seedTable(all, &RefinementResults::drift, section);
  sayLoops(all, section);
  for (const auto& [what, results] : all) {
    if (what.is_loop) drawRefinement(what, results.drawing, section);
  }
  section.heading("Exact poses, a good tracker, and wrong options");
  section.text(
      "With noise: means of seeds 1 and 2. *Said to be*: the noise that `[refinement]` expects of "
      "a tracker with 1 cm and 0.5°.");
  otherTable(all, section);
  section.heading("False loops");
  section.text(
      "The same noise, and a false loop candidate after 30 % of the keyframes. The two kinds "
      "alternate: two different places claimed to be one place, or one place with a relative pose "
      "that is wrong by 0.3 to 1 m, by 15 to 45°, or by both. True loops are searched, too. "
      "*Accepted*: the registration confirms the candidate, and it becomes a factor of the graph; "
      "*moved*: the max distance between the final poses with and without false loops.");
  loopTable(all, section);
  section.heading("Time");
  section.text(
      "Time of a keyframe of 346x260 with a full window (K = 10) and noise: choice of points, "
      "registration, solution of the window, search for loops and their closing; one thread. Other "
      "processes use the machine, so the table has real time and processor time.");
  timeTable(all, section);
  judgeNoise(all, section);
  judgeDrift(all, section);
  judgeRest(all, section);
}
}  // namespace efm::studies
