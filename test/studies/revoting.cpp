// SPDX-License-Identifier: BSD-3-Clause
// Re-voting: each event's one vote shared along its ray by what the first pass fused.
#include <string>
#include <vector>

#include "test/studies/depth_curve.h"
#include "test/studies/method_comparison.h"
#include "test/studies/studies.h"
#include "tracking_stub/simulation_preset.h"

namespace efm::studies {
namespace {

/// The default, and the same with a second pass.
std::vector<Method> methods(double min_depth_m, double max_depth_m) {
  KeyframeMapperOptions options = paperOptions(min_depth_m, max_depth_m);
  options.extraction.max_confidence.level = WhiteLevel::kKeyframe;
  const Method paper{"(a) the paper", options};
  Method shipped{"default", options};
  shipped.options.split = SplitFusionOptions();
  shipped.options.extraction = DepthExtractionOptions();
  Method revoted = shipped;
  revoted.name = "default and re-voting";
  revoted.options.revoting.revote = true;
  return {paper, shipped, revoted};
}

}  // namespace

void studyRevoting(const StudyRun& run, StudySection& section) {
  struct Case {
    const char* preset;
    double min_depth_m;
    double max_depth_m;
  };
  section.text(
      "An event saw one point, so it should vote once: a second pass shares each event's one vote "
      "along its ray in proportion to the square of what the first pass fused there, and fuses "
      "again (`[fusion] revote`). One window of 0.2 s, seed 7, at the number of points that the "
      "paper's extraction keeps (C = 5).");
  TextTable table;
  table.head = {"case", "points", "method", "beyond 10 % [%]", "median [%]", "recall [%]"};
  std::vector<Case> cases = {{"desk_stereo", 0.5, 5}};
  if (!run.quick) cases.push_back({"poles_stereo", 1, 8});
  for (const Case& what : cases) {
    SimulationOptions simulation;
    simulation.preset = what.preset;
    simulation.seed = 7;
    simulation.duration_s = 0.75;
    const Recording recording =
        run.recordings->make("better_" + std::string(what.preset), makeSimulation(simulation));
    const std::vector<Window> windows = recording.windows(0.2, 1);
    const std::vector<Method> compared = methods(what.min_depth_m, what.max_depth_m);
    DepthJudge judge(recording, compared.front().options.planes);
    const double points = asItIs(recording, windows, compared.front(), judge).points;
    for (const Method& method : compared) {
      const PointQuality quality = depthCurve(recording, windows, method, judge).at(points);
      const bool first = &method == &compared.front();
      table.rows.push_back({first ? what.preset : "", first ? formatNumber(points, 0) : "",
                            method.name, formatNumber(100 * quality.beyond_10, 2),
                            formatNumber(100 * quality.median, 2),
                            formatNumber(100 * quality.recall, 1)});
    }
  }
  section.table(table);
}

}  // namespace efm::studies
