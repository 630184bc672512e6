// SPDX-License-Identifier: BSD-3-Clause
// A tracker that drifts and errs, and what refining its keyframes' poses gives back.
#include <algorithm>
#include <cmath>
#include <functional>
#include <future>
#include <memory>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "maps/sample_statistics.h"
#include "plugin/curve_plot.h"
#include "plugin/picture_grid.h"
#include "test/studies/error_figures.h"
#include "test/studies/false_loops.h"
#include "test/studies/map_truth.h"
#include "test/studies/picture_grid.h"
#include "test/studies/pose_refinement_run.h"
#include "test/studies/real_rigs.h"
#include "test/studies/room_loop.h"
#include "test/studies/studies.h"
#include "test/studies/top_view.h"
#include "tracking_stub/simulation_preset.h"

namespace efm::studies {
namespace {

/// A recording and how it is mapped.
struct Case {
  std::string name;
  std::string file;  ///< In the cache.
  std::function<Simulation()> simulation;
  double min_depth_m;
  double max_depth_m;
  double window_s;
  bool is_loop = false;  ///< Comes back to its first places after long.
};

std::vector<Case> casesOf(const StudyRun& run) {
  if (run.quick) {
    return {{"MVSEC", "mvsec_room", [&run] { return mvsecInRoom(run, 0.2); }, 1, 6.5, 0.05}};
  }
  const auto room = [] {
    SimulationOptions options;
    options.preset = "room_stereo";
    return makeSimulation(options);
  };
  return {{"room_stereo", "room_stereo", room, 0.9, 7, 0.3},
          {"loop", "room_loop", [] { return roundTheRoom(24); }, 0.9, 7, 0.6, true},
          {"MVSEC", "mvsec_room_20s", [&run] { return mvsecInRoom(run, 20); }, 1, 6.5, 1}};
}

EventFusionOptions optionsOf(const Case& what) {
  EventFusionOptions options;
  options.mapper.keyframe.planes.min_depth_m = what.min_depth_m;
  options.mapper.keyframe.planes.max_depth_m = what.max_depth_m;
  options.mapper.keyframes.window_s = options.mapper.keyframes.stride_s = what.window_s;
  options.refinement.enabled = true;
  return options;
}

TrackerFaults noiseOf(double noise_m, double noise_deg, std::uint64_t seed) {
  TrackerFaults faults;
  faults.perturbation.keyframe.noise_m = noise_m;
  faults.perturbation.keyframe.noise_rad = noise_deg * kRadiansPerDegree;
  faults.perturbation.seed = seed;
  return faults;
}

TrackerFaults driftOf(double share, double deg_per_m, std::uint64_t seed) {
  TrackerFaults faults;
  faults.perturbation.drift = {share, deg_per_m * kRadiansPerDegree};
  faults.perturbation.seed = seed;
  return faults;
}

/// The same keyframes at the tracker's poses and at refined ones.
struct Outcome {
  MapErrors without;
  MapErrors with;
};

/// A map and its trajectory, to be drawn.
struct Drawing {
  std::vector<CloudPoint> tracker_map, refined_map;
  std::vector<Rigid3> T_world_true, T_tracker_ref, T_world_ref;
};

/// Of one recording, by seed.
struct CaseResults {
  std::vector<Outcome> noise, drift, exact, small_noise, noise_feared, noise_denied;
  std::vector<FalseLoops> false_loops;
  std::vector<double> seconds, processor_seconds;  ///< Of keyframes with a full window.
  std::size_t keyframes = 0;
  std::vector<RefinementCounts> loops;  ///< With drift.
  Drawing drawing;                      ///< Of the first seed's drift, where it is the loop.
};

/// Of what is not asked of five.
constexpr std::uint64_t kFewSeeds = 2;

/// Everything that is done with one recording. Several of them may be mapped at the same time.
class CaseRun {
 public:
  CaseRun(const StudyRun& run, const Case& what)
      : case_(what),
        seeds_(run.pick<std::uint64_t>(5, 1)),
        recording_(run.recordings->make(what.file, what.simulation())),
        options_(optionsOf(what)),
        truth_(recording_.simulation) {}

  void map() {
    results_.exact = {outcomeOf(mapped({}))};
    for (std::uint64_t seed = 1; seed <= seeds_; ++seed) {
      noise(seed);
      drift(seed);
    }
    for (std::uint64_t seed = 1; seed <= std::min(kFewSeeds, seeds_); ++seed) {
      results_.small_noise.push_back(outcomeOf(mapped(noiseOf(0.002, 0.1, seed))));
    }
  }

  /// How long refining the noisy keyframes takes, one after the other; of those that have a full
  /// window before them.
  void time() {
    const RefinementOptions& options = options_.refinement.refiner;
    for (const PoseRefinementRun& run : noisy_) {
      const RefinerRun again = refineKeyframes(run.keyframes, options);
      for (std::size_t i = 0; i < run.keyframes.size(); ++i) {
        if (!isSame(again.T_world_ref[i], run.T_world_ref[i])) {
          throw std::logic_error(case_.name + ", keyframe " + std::to_string(i) +
                                 ": the session refined it to another pose");
        }
      }
      const auto first = std::min<std::ptrdiff_t>(
          options.window, static_cast<std::ptrdiff_t>(again.seconds.size()) - 1);
      const auto append = [&](const std::vector<double>& from, std::vector<double>& to) {
        to.insert(to.end(), from.begin() + first, from.end());
      };
      append(again.seconds, results_.seconds);
      append(again.processor_seconds, results_.processor_seconds);
    }
  }

  const CaseResults& results() const { return results_; }

 private:
  PoseRefinementRun mapped(const TrackerFaults& faults) const {
    return mapRefined(recording_, options_, faults);
  }

  MapErrors errorsAt(const PoseRefinementRun& run, const std::vector<Rigid3>& T_map_ref) {
    return truth_.errorsOf(run.keyframes, T_map_ref,
                           mapAt(run.keyframes, T_map_ref, options_.cloud));
  }

  Outcome outcomeOf(const PoseRefinementRun& run) {
    return {errorsAt(run, run.T_tracker_ref),
            truth_.errorsOf(run.keyframes, run.T_world_ref, run.refined_map)};
  }

  void noise(std::uint64_t seed) {
    PoseRefinementRun run = mapped(noiseOf(0.01, 0.5, seed));
    const Outcome outcome = outcomeOf(run);
    results_.noise.push_back(outcome);
    results_.keyframes = run.keyframes.size();
    if (seed <= kFewSeeds) {
      results_.noise_feared.push_back({outcome.without, errorsExpecting(10, run)});
      results_.noise_denied.push_back({outcome.without, errorsExpecting(0.1, run)});
    }
    results_.false_loops.push_back(proposeFalseLoops(run.keyframes, truePoses(run), run.T_world_ref,
                                                     options_.refinement.refiner, seed));
    run.refined_map = {};
    noisy_.push_back(std::move(run));
  }

  /// Refined by somebody who takes the tracker's noise for so many times what it is.
  MapErrors errorsExpecting(double times, const PoseRefinementRun& run) {
    RefinementOptions wrong = options_.refinement.refiner;
    wrong.tracker.noise_m *= times;
    wrong.tracker.noise_rad *= times;
    return errorsAt(run, refineKeyframes(run.keyframes, wrong).T_world_ref);
  }

  void drift(std::uint64_t seed) {
    PoseRefinementRun run = mapped(driftOf(0.01, 0.5, seed));
    results_.drift.push_back(outcomeOf(run));
    results_.loops.push_back(run.counts);
    if (seed > 1 || !case_.is_loop) return;
    Drawing& drawing = results_.drawing;
    drawing.tracker_map = mapAt(run.keyframes, run.T_tracker_ref, options_.cloud);
    drawing.refined_map = std::move(run.refined_map);
    drawing.T_world_true = truePoses(run);
    drawing.T_tracker_ref = run.T_tracker_ref;
    drawing.T_world_ref = run.T_world_ref;
  }

  std::vector<Rigid3> truePoses(const PoseRefinementRun& run) const {
    std::vector<Rigid3> T_world_ref;
    for (const auto& keyframe : run.keyframes) T_world_ref.push_back(truth_.T_world_ref(keyframe));
    return T_world_ref;
  }

  const Case& case_;
  std::uint64_t seeds_;
  Recording recording_;
  EventFusionOptions options_;
  MapTruth truth_;
  CaseResults results_;
  std::vector<PoseRefinementRun> noisy_;
};

/// One number of the errors, and how it is written.
struct Figure {
  std::string head;
  double MapErrors::*value;
  double unit;
};

const Figure kTrajectory{"trajectory [cm]", &MapErrors::trajectory_m, 0.01};
const Figure kTurns{"trajectory [°]", &MapErrors::trajectory_rad, kRadiansPerDegree};
const Figure kMap{"map [cm]", &MapErrors::map_m, 0.01};
const Figure kRays{"rays [cm]", &MapErrors::rays_m, 0.01};
const Figure kEnd{"end to end [cm]", &MapErrors::end_to_end_m, 0.01};
const Figure kEndTurn{"end to end [°]", &MapErrors::end_to_end_rad, kRadiansPerDegree};
const Figure kWalls{"walls [cm]", &MapErrors::thickness_m, 0.01};
const std::vector<Figure> kFigures = {kTrajectory, kTurns, kMap, kRays, kEnd, kEndTurn, kWalls};

double meanOf(const std::vector<Outcome>& outcomes, MapErrors Outcome::*side,
              const Figure& figure) {
  double sum = 0;
  for (const Outcome& outcome : outcomes) sum += outcome.*side.*figure.value;
  return sum / static_cast<double>(outcomes.size());
}

/// Of the means.
double ratioOf(const std::vector<Outcome>& outcomes, const Figure& figure) {
  return meanOf(outcomes, &Outcome::with, figure) / meanOf(outcomes, &Outcome::without, figure);
}

/// "0.38; 0.31, 0.40, ... by seed"
std::string ratiosOf(const std::vector<Outcome>& outcomes, const Figure& figure) {
  std::vector<double> each;
  for (const Outcome& outcome : outcomes) each.push_back(ratioOf({outcome}, figure));
  const std::string all = formatNumber(ratioOf(outcomes, figure), 2) + " times";
  return outcomes.size() > 1 ? all + "; by seed " + listed(each, 2) : all;
}

std::vector<std::string> tableHead(const std::string& second) {
  std::vector<std::string> head = {"recording", second};
  for (const Figure& figure : kFigures) head.push_back(figure.head);
  return head;
}

std::vector<std::string> tableRow(const std::string& first, const std::string& second,
                                  const std::vector<Outcome>& outcomes) {
  std::vector<std::string> row = {first, second};
  for (const Figure& figure : kFigures) {
    const double without = meanOf(outcomes, &Outcome::without, figure) / figure.unit;
    const double with = meanOf(outcomes, &Outcome::with, figure) / figure.unit;
    const std::string ratio = without > 0.005 ? " (" + formatNumber(with / without, 2) + ")" : "";
    row.push_back(formatNumber(without, 2) + " → " + formatNumber(with, 2) + ratio);
  }
  return row;
}

using AllResults = std::vector<std::pair<Case, CaseResults>>;

void seedTable(const AllResults& all, std::vector<Outcome> CaseResults::*which,
               StudySection& section) {
  TextTable table{tableHead("seed"), {}};
  for (const auto& [what, results] : all) {
    const std::vector<Outcome>& outcomes = results.*which;
    for (std::size_t i = 0; i < outcomes.size(); ++i) {
      table.rows.push_back(tableRow(i == 0 ? what.name : "", std::to_string(i + 1), {outcomes[i]}));
    }
    if (outcomes.size() > 1) table.rows.push_back(tableRow("", "mean", outcomes));
  }
  section.table(table);
}

void otherTable(const AllResults& all, StudySection& section) {
  TextTable table{tableHead("tracker"), {}};
  for (const auto& [what, results] : all) {
    table.rows.push_back(tableRow(what.name, "exact", results.exact));
    table.rows.push_back(tableRow("", "2 mm, 0.1°", results.small_noise));
    table.rows.push_back(
        tableRow("", "1 cm, 0.5°, said to be 10 times that", results.noise_feared));
    table.rows.push_back(tableRow("", "1 cm, 0.5°, said to be a tenth", results.noise_denied));
  }
  section.table(table);
}

void loopTable(const AllResults& all, StudySection& section) {
  TextTable table{{"recording", "seed", "proposed", "accepted", "moved [cm]", "turned [°]"}, {}};
  for (const auto& [what, results] : all) {
    for (std::size_t i = 0; i < results.false_loops.size(); ++i) {
      const FalseLoops& loops = results.false_loops[i];
      table.rows.push_back({i == 0 ? what.name : "", std::to_string(i + 1),
                            std::to_string(loops.proposed), std::to_string(loops.accepted),
                            formatNumber(100 * loops.moved_m, 2),
                            formatNumber(loops.moved_rad / kRadiansPerDegree, 3)});
    }
  }
  section.table(table);
}

void sayLoops(const AllResults& all, StudySection& section) {
  for (const auto& [what, results] : all) {
    std::string counts;
    for (const RefinementCounts& seed : results.loops) {
      counts += (counts.empty() ? "" : ", ") + std::to_string(seed.loops) + " of " +
                std::to_string(seed.loop_checks) + " (" + std::to_string(seed.loops_dropped) + ")";
    }
    section.item(what.name +
                 ": candidates of loops that held (and of these, were taken out again), "
                 "by seed: " +
                 counts + ".");
  }
}

void timeTable(const AllResults& all, StudySection& section) {
  TextTable table{{"recording", "keyframes", "median [ms]", "90 % [ms]", "largest [ms]",
                   "processor: median [ms]", "90 % [ms]", "largest [ms]"},
                  {}};
  for (const auto& [what, results] : all) {
    std::vector<std::string> row = {what.name, std::to_string(results.seconds.size())};
    for (const auto* seconds : {&results.seconds, &results.processor_seconds}) {
      for (const double share : {0.5, 0.9, 1.0}) {
        row.push_back(formatNumber(1e3 * quantileOf(*seconds, share), 1));
      }
    }
    table.rows.push_back(row);
  }
  section.table(table);
}

/// All recordings side by side; then each is timed, with nothing beside it.
void mapAll(const StudyRun& run, AllResults& all) {
  std::vector<std::unique_ptr<CaseRun>> case_runs;
  std::vector<std::future<void>> mapped;
  for (const auto& [what, results] : all) {
    case_runs.push_back(std::make_unique<CaseRun>(run, what));
    mapped.push_back(
        std::async(std::launch::async, [one = case_runs.back().get()] { one->map(); }));
  }
  for (std::future<void>& one : mapped) one.get();
  for (std::size_t i = 0; i < all.size(); ++i) {
    case_runs[i]->time();
    all[i].second = case_runs[i]->results();
  }
}

Curve wayOf(const std::string& label, const std::vector<Rigid3>& T_world_ref) {
  Curve curve{label, {}, CurveStyle::kMarkedLine, {}};
  for (const Rigid3& pose : T_world_ref) {
    curve.points.emplace_back(pose.translation.x(), pose.translation.y());
  }
  return curve;
}

/// The maps at the tracker's poses and at refined ones: whole, and the corner that is seen at the
/// beginning and at the end.
cv::Mat3b drawMaps(const Drawing& drawing, const std::vector<Wall>& walls) {
  constexpr int kWidthPx = 620;
  TopView all = viewOfAll(walls, 0.01);
  all.pixel_m = (all.high_m.x() - all.low_m.x()) / kWidthPx;
  TopView corner = all;
  corner.low_m = {1.9, 0.9};
  corner.pixel_m = (corner.high_m.x() - corner.low_m.x()) / kWidthPx;
  PictureGrid grid;
  grid.columns = {"at the tracker's poses", "at refined poses"};
  grid.rows = {"all", "the corner that is seen twice"};
  for (const TopView& view : {all, corner}) {
    grid.pictures.push_back({drawTopView(drawing.tracker_map, walls, view),
                             drawTopView(drawing.refined_map, walls, view)});
  }
  grid.width_px = kWidthPx;
  return drawGrid(grid);
}

cv::Mat3b drawWays(const Drawing& drawing) {
  CurvePlot plot;
  plot.title = "keyframes from above";
  plot.size = {700, 480};
  plot.equal_units = true;
  plot.x.label = "x [m]";
  plot.y.label = "y [m]";
  plot.curves = {wayOf("true", drawing.T_world_true), wayOf("tracker", drawing.T_tracker_ref),
                 wayOf("refined", drawing.T_world_ref)};
  return drawCurves(plot);
}

/// How far from the truth each keyframe stands.
cv::Mat3b drawDrift(const Drawing& drawing) {
  CurvePlot plot;
  plot.title = "distance from the truth";
  plot.size = {560, 480};
  plot.x = {"keyframe", AxisScale::kLinear, 0, {}};
  plot.y = {"[cm]", AxisScale::kLinear, 0, {}};
  const auto add = [&](const std::string& label, const std::vector<Rigid3>& T_world_ref,
                       std::size_t colour) {
    Curve curve{label, {}, CurveStyle::kMarkedLine, curveColour(colour)};
    for (std::size_t i = 0; i < T_world_ref.size(); ++i) {
      const double distance_m =
          (T_world_ref[i].translation - drawing.T_world_true[i].translation).norm();
      curve.points.emplace_back(static_cast<double>(i), 100 * distance_m);
    }
    plot.curves.push_back(curve);
  };
  add("tracker", drawing.T_tracker_ref, 1);
  add("refined", drawing.T_world_ref, 2);
  return drawCurves(plot);
}

void draw(const Case& what, const Drawing& drawing, StudySection& section) {
  section.picture("refinement_map.png", drawMaps(drawing, wallsOf(what.simulation().scene)),
                  "The loop's map from above, with drift (seed 1), where the first poses coincide; "
                  "blue low, red high; grey lines: the true walls");
  section.picture("refinement_trajectory.png", sideBySide({drawWays(drawing), drawDrift(drawing)}),
                  "The same keyframes: where they stand, and how far from where they should");
}

void introduce(const AllResults& all, StudySection& section) {
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

void judgeNoise(const AllResults& all, StudySection& section) {
  for (const auto& [what, results] : all) {
    for (const auto& [name, figure] :
         {std::pair{"trajectory error", kTrajectory}, std::pair{"median map error", kMap}}) {
      section.trend(what.name + ": with noise the " + name + " is at most 0.75 times as large",
                    ratioOf(results.noise, figure) <= 0.75, ratiosOf(results.noise, figure));
    }
  }
}

void judgeDrift(const AllResults& all, StudySection& section) {
  const std::string loops_lost =
      "Loops that are found are right to about a centimetre, but against the drift they are off by "
      "tens of the standard deviations that they state: the robust loss lets them count for "
      "little, "
      "and they are taken out as contradicted.";
  for (const auto& [what, results] : all) {
    if (!what.is_loop) continue;
    const double exact_m = meanOf(results.exact, &Outcome::without, kWalls);
    const std::string walls_too =
        " With exact poses the walls are " + formatNumber(100 * exact_m, 2) + " cm thick.";
    for (const auto& [name, figure, most, departure] :
         {std::tuple{"end-to-end error", kEnd, 0.3, loops_lost},
          std::tuple{"end-to-end turn", kEndTurn, 0.3, loops_lost},
          std::tuple{"walls' thickness", kWalls, 0.5, loops_lost + walls_too}}) {
      section.trend(what.name + ": with drift the " + name + " is at most " +
                        formatNumber(most, 1) + " times as large",
                    ratioOf(results.drift, figure) <= most, ratiosOf(results.drift, figure),
                    departure);
    }
  }
}

void judgeRest(const AllResults& all, StudySection& section) {
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
        "By the clock it waits for others that use the processors.");
  }
}

}  // namespace

void studyRefinement(const StudyRun& run, StudySection& section) {
  const std::vector<Case> cases = casesOf(run);
  AllResults all;
  for (const Case& what : cases) all.emplace_back(what, CaseResults{});
  mapAll(run, all);
  introduce(all, section);
  section.heading("Noise");
  section.text(
      "Noise of 1 cm and 0.5° on each axis, drawn for each window and constant within it.");
  seedTable(all, &CaseResults::noise, section);
  section.heading("Drift");
  section.text(
      "A position that runs away by 1 % of the way and a heading that turns by 0.5° per metre of "
      "it.");
  seedTable(all, &CaseResults::drift, section);
  sayLoops(all, section);
  for (const auto& [what, results] : all) {
    if (what.is_loop) draw(what, results.drawing, section);
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
