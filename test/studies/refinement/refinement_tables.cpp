// SPDX-License-Identifier: BSD-3-Clause
#include "test/studies/refinement/refinement_tables.h"

#include "maps/metrics/sample_statistics.h"
#include "test/studies/methods/error_figures.h"

namespace efm::studies {
namespace {

const std::vector<Figure> kFigures = {kTrajectory, kRotation,    kMap,  kRays,
                                      kEnd,        kEndRotation, kWalls};
std::vector<std::string> tableHead(const std::string& second) {
  std::vector<std::string> head = {"recording", second};
  for (const Figure& figure : kFigures) head.push_back(figure.head);
  return head;
}

std::vector<std::string> tableRow(const std::string& first, const std::string& second,
                                  const std::vector<RefinementOutcome>& outcomes) {
  std::vector<std::string> row = {first, second};
  for (const Figure& figure : kFigures) {
    const double without = meanOf(outcomes, &RefinementOutcome::without, figure) / figure.unit;
    const double with = meanOf(outcomes, &RefinementOutcome::with, figure) / figure.unit;
    const std::string ratio = without > 0.005 ? " (" + formatNumber(with / without, 2) + ")" : "";
    row.push_back(formatNumber(without, 2) + " → " + formatNumber(with, 2) + ratio);
  }
  return row;
}
}  // namespace

double meanOf(const std::vector<RefinementOutcome>& outcomes, MapErrors RefinementOutcome::*side,
              const Figure& figure) {
  double sum = 0;
  for (const RefinementOutcome& outcome : outcomes) sum += outcome.*side.*figure.value;
  return sum / static_cast<double>(outcomes.size());
}

double ratioOf(const std::vector<RefinementOutcome>& outcomes, const Figure& figure) {
  return meanOf(outcomes, &RefinementOutcome::with, figure) /
         meanOf(outcomes, &RefinementOutcome::without, figure);
}

std::string ratiosOf(const std::vector<RefinementOutcome>& outcomes, const Figure& figure) {
  std::vector<double> each;
  for (const RefinementOutcome& outcome : outcomes) each.push_back(ratioOf({outcome}, figure));
  const std::string all = formatNumber(ratioOf(outcomes, figure), 2) + " times";
  return outcomes.size() > 1 ? all + "; by seed " + listed(each, 2) : all;
}
void seedTable(const RefinementStudyResults& all,
               std::vector<RefinementOutcome> RefinementResults::*which, StudySection& section) {
  TextTable table{tableHead("seed"), {}};
  for (const auto& [what, results] : all) {
    const std::vector<RefinementOutcome>& outcomes = results.*which;
    for (std::size_t i = 0; i < outcomes.size(); ++i) {
      table.rows.push_back(tableRow(i == 0 ? what.name : "", std::to_string(i + 1), {outcomes[i]}));
    }
    if (outcomes.size() > 1) table.rows.push_back(tableRow("", "mean", outcomes));
  }
  section.table(table);
}

void otherTable(const RefinementStudyResults& all, StudySection& section) {
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

void loopTable(const RefinementStudyResults& all, StudySection& section) {
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

void sayLoops(const RefinementStudyResults& all, StudySection& section) {
  for (const auto& [what, results] : all) {
    std::string counts;
    for (const RefinementCounts& seed : results.loops) {
      counts += (counts.empty() ? "" : ", ") + std::to_string(seed.loops) + " of " +
                std::to_string(seed.loop_checks) + " (" + std::to_string(seed.loops_dropped) + ")";
    }
    section.item(
        what.name +
        ": accepted candidates of loops (and of these, removed again), by seed: " + counts + ".");
  }
}

void timeTable(const RefinementStudyResults& all, StudySection& section) {
  TextTable table{{"recording", "keyframes", "median [ms]", "90 % [ms]", "largest [ms]",
                   "processor: median [ms]", "90 % [ms]", "largest [ms]"},
                  {}};
  for (const auto& [what, results] : all) {
    std::vector<std::string> row = {what.name, std::to_string(results.seconds.size())};
    for (const auto* seconds : {&results.seconds, &results.processor_seconds}) {
      for (const double quantile : {0.5, 0.9, 1.0}) {
        row.push_back(formatNumber(1e3 * quantileOf(*seconds, quantile), 1));
      }
    }
    table.rows.push_back(row);
  }
  section.table(table);
}
}  // namespace efm::studies
