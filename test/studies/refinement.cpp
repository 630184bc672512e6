// SPDX-License-Identifier: BSD-3-Clause
// A tracker that drifts and errs, and what refining its keyframes' poses gives back.
#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "maps/sample_statistics.h"
#include "plugin/curve_plot.h"
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
  RefinementCounts drift_counts;  ///< Of the first seed.
  Drawing drawing;                ///< Of the first seed's drift, where it is the loop.
};

/// Everything that is done with one recording.
class CaseRun {
 public:
  CaseRun(const StudyRun& run, const Case& what)
      : case_(what),
        seeds_(run.pick<std::uint64_t>(5, 1)),
        recording_(run.recordings->make(what.file, what.simulation())),
        options_(optionsOf(what)),
        truth_(recording_.simulation) {}

  CaseResults results() {
    CaseResults results;
    results.exact = {outcomeOf(mapped({}))};
    for (std::uint64_t seed = 1; seed <= seeds_; ++seed) {
      noise(seed, results);
      drift(seed, results);
      results.small_noise.push_back(outcomeOf(mapped(noiseOf(0.002, 0.1, seed))));
    }
    return results;
  }

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

  void noise(std::uint64_t seed, CaseResults& results) {
    const PoseRefinementRun run = mapped(noiseOf(0.01, 0.5, seed));
    const Outcome outcome = outcomeOf(run);
    results.noise.push_back(outcome);
    results.keyframes = run.keyframes.size();
    time(run, results);
    const auto expecting = [&](double times) {
      RefinementOptions wrong = options_.refinement.refiner;
      wrong.tracker.noise_m *= times;
      wrong.tracker.noise_rad *= times;
      return Outcome{outcome.without,
                     errorsAt(run, refineKeyframes(run.keyframes, wrong).T_world_ref)};
    };
    results.noise_feared.push_back(expecting(10));
    results.noise_denied.push_back(expecting(0.1));
    std::vector<Rigid3> T_world_ref;
    for (const auto& keyframe : run.keyframes) T_world_ref.push_back(truth_.T_world_ref(keyframe));
    results.false_loops.push_back(
        proposeFalseLoops(run.keyframes, T_world_ref, options_.refinement.refiner, seed));
  }

  /// Of keyframes that have a full window before them.
  void time(const PoseRefinementRun& run, CaseResults& results) const {
    const RefinementOptions& options = options_.refinement.refiner;
    const RefinerRun again = refineKeyframes(run.keyframes, options);
    for (std::size_t i = 0; i < run.keyframes.size(); ++i) {
      if (!isSame(again.T_world_ref[i], run.T_world_ref[i])) {
        throw std::logic_error(case_.name + ", keyframe " + std::to_string(i) +
                               ": the session refined it to another pose");
      }
    }
    const auto window = std::min<std::ptrdiff_t>(
        options.window, static_cast<std::ptrdiff_t>(again.seconds.size()) - 1);
    const auto append = [&](const std::vector<double>& from, std::vector<double>& to) {
      to.insert(to.end(), from.begin() + window, from.end());
    };
    append(again.seconds, results.seconds);
    append(again.processor_seconds, results.processor_seconds);
  }

  void drift(std::uint64_t seed, CaseResults& results) {
    PoseRefinementRun run = mapped(driftOf(0.01, 0.5, seed));
    results.drift.push_back(outcomeOf(run));
    if (seed > 1) return;
    results.drift_counts = refineKeyframes(run.keyframes, options_.refinement.refiner).counts;
    if (!case_.is_loop) return;
    Drawing& drawing = results.drawing;
    drawing.tracker_map = mapAt(run.keyframes, run.T_tracker_ref, options_.cloud);
    drawing.refined_map = std::move(run.refined_map);
    for (const auto& keyframe : run.keyframes) {
      drawing.T_world_true.push_back(truth_.T_world_ref(keyframe));
    }
    drawing.T_tracker_ref = run.T_tracker_ref;
    drawing.T_world_ref = run.T_world_ref;
  }

  const Case& case_;
  std::uint64_t seeds_;
  Recording recording_;
  EventFusionOptions options_;
  MapTruth truth_;
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

Curve wayOf(const std::string& label, const std::vector<Rigid3>& T_world_ref) {
  Curve curve{label, {}, CurveStyle::kMarkedLine, {}};
  for (const Rigid3& pose : T_world_ref) {
    curve.points.emplace_back(pose.translation.x(), pose.translation.y());
  }
  return curve;
}

void draw(const Case& what, const Drawing& drawing, StudySection& section) {
  const std::vector<Wall> walls = wallsOf(what.simulation().scene);
  PictureGrid grid;
  grid.columns = {"the tracker's poses", "refined"};
  grid.pictures = {
      {drawTopView(drawing.tracker_map, walls), drawTopView(drawing.refined_map, walls)}};
  grid.width_px = grid.pictures.front().front().cols;
  section.picture(
      "refinement_map.png", drawGrid(grid),
      "The loop's map from above, with drift of 1 % and 0.5 degrees per metre (seed 1); "
      "blue low, red high, grey lines: the true walls");
  CurvePlot plot;
  plot.title = "keyframes of the loop from above, 1 % and 0.5 degrees per metre";
  plot.size = {760, 520};
  plot.equal_units = true;
  plot.x = {"x [m]", AxisScale::kLinear, {}, {}};
  plot.y = {"y [m]", AxisScale::kLinear, {}, {}};
  plot.curves = {wayOf("true", drawing.T_world_true), wayOf("tracker", drawing.T_tracker_ref),
                 wayOf("refined", drawing.T_world_ref)};
  section.picture("refinement_trajectory.png", drawCurves(plot),
                  "The same keyframes' positions: first poses coincide");
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
  for (const auto& [what, results] : all) {
    if (!what.is_loop) continue;
    for (const auto& [name, figure, most] :
         {std::tuple{"end-to-end error", kEnd, 0.3}, std::tuple{"end-to-end turn", kEndTurn, 0.3},
          std::tuple{"walls' thickness", kWalls, 0.5}}) {
      section.trend(what.name + ": with drift the " + name + " is at most " +
                        formatNumber(most, 1) + " times as large",
                    ratioOf(results.drift, figure) <= most, ratiosOf(results.drift, figure));
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
    section.trend(what.name + ": a keyframe takes at most 100 ms",
                  quantileOf(results.seconds, 0.5) <= 0.1,
                  formatNumber(1e3 * quantileOf(results.seconds, 0.5), 1) + " ms, median");
  }
}

}  // namespace

void studyRefinement(const StudyRun& run, StudySection& section) {
  AllResults all;
  for (const Case& what : casesOf(run)) {
    CaseRun case_run(run, what);
    all.emplace_back(what, case_run.results());
  }
  section.heading("Noise");
  seedTable(all, &CaseResults::noise, section);
  section.heading("Drift");
  seedTable(all, &CaseResults::drift, section);
  for (const auto& [what, results] : all) {
    if (what.is_loop) draw(what, results.drawing, section);
  }
  section.heading("Exact poses, a good tracker, and options that are wrong");
  otherTable(all, section);
  section.heading("False loops");
  loopTable(all, section);
  section.heading("Time");
  timeTable(all, section);
  judgeNoise(all, section);
  judgeDrift(all, section);
  judgeRest(all, section);
}

}  // namespace efm::studies
