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
      "The paper leaves poses as they are. With `[refinement] enabled = true` keyframes are "
      "registered with each other and their poses solved together, and the map follows. Three "
      "recordings: the preset `room_stereo`; a *loop* around the same room that comes back to "
      "its first place after 20 s of 24; MVSEC's rig on its real trajectory, smoothed, for 20 s in "
      "a simulated room (" +
      recordings +
      "). Events and poses at 200 Hz go through the pipeline with its default options but the "
      "depth range and the windows.");
  section.text(
      "Each cell: the error of the same keyframes at the tracker's poses → at the refined ones "
      "(the ratio). *Trajectory*: root mean square of the keyframes' errors; *map*: median "
      "distance of the exported points to the nearest surface; *rays*: median distance of "
      "keyframes' points to where their own rays truly end; *walls*: half of what lies between the "
      "16th and the 84th percentile of the distances from a wall, the floor or the ceiling, of "
      "points nearest to it, up to 0.3 m before or behind and as far inside its borders; mean of "
      "all, weighted by points. All these after the trajectory is laid over the true one by a "
      "rigid motion, and the map with it. *End to end*: the motion from the first keyframe to the "
      "last against the true one. Means are of the errors, and their ratio.");
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
      "Within its windows drift bends the depth maps themselves, which no pose of a keyframe "
      "mends, "
      "and registrations then show half of it.";
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
        formatNumber(1e3 * quantileOf(results.seconds, 0.5), 1) + " ms, median, by the clock; " +
            formatNumber(processor_ms, 1) + " ms of the processor",
        processor_ms <= 100 ? "By the clock it waits for others that use the processors."
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
      "Noise of 1 cm and 0.5° on each axis, drawn for each window and constant within it.");
  seedTable(all, &RefinementResults::noise, section);
  section.heading("Drift");
  section.text(
      "A position that runs away by 1 % of the way and a heading that turns by 0.5° per metre of "
      "it.");
  seedTable(all, &RefinementResults::drift, section);
  sayLoops(all, section);
  for (const auto& [what, results] : all) {
    if (what.is_loop) drawRefinement(what, results.drawing, section);
  }
  section.heading("Exact poses, a good tracker, and options that are wrong");
  section.text(
      "Where there is noise: means of seeds 1 and 2. *Said to be*: `[refinement]` expects that "
      "much "
      "noise of a tracker with 1 cm and 0.5°.");
  otherTable(all, section);
  section.heading("False loops");
  section.text(
      "The noise of above, and after 30 % of the keyframes one candidate that is false: by turns "
      "another place said to be the same one, or the same place with a relative pose that is wrong "
      "by 0.3 to 1 m, 15 to 45°, or both. True loops are looked for as ever. *Accepted*: by the "
      "registration that verifies it, from which on it is a factor of the graph; *moved*: the "
      "farthest that any pose ends from where it ends without them.");
  loopTable(all, section);
  section.heading("Time");
  section.text(
      "Of a keyframe of 346x260 with a full window (K = 10) and noise: its points chosen, "
      "registered, the window solved, loops looked for and closed; one thread. The machine is "
      "shared with others: what the processor took for it is given beside the clock's time.");
  timeTable(all, section);
  judgeNoise(all, section);
  judgeDrift(all, section);
  judgeRest(all, section);
}
}  // namespace efm::studies
