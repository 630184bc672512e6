// SPDX-License-Identifier: BSD-3-Clause
// Ghosh and Gallego 2022, Secs. 3.7 and 4.9: the time of a keyframe by step, and the formulas of
// its complexity.
#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "mapping/dsi/dsi_grid.h"
#include "mapping/keyframes/keyframe_mapper.h"
#include "plugin/results/pictures/curve_plot.h"
#include "test/bench/stage_clock.h"
#include "test/bench/synthetic_window.h"
#include "test/studies/methods/error_figures.h"
#include "test/studies/methods/method_comparison.h"
#include "test/studies/studies.h"

namespace efm::studies {
namespace {

/// The sizes in the paper's formulas.
struct Sizes {
  double events = 235'000;  ///< N_e, of each camera.
  int cameras = 2;          ///< N_c.
  int subintervals = 1;     ///< N_s.
  int planes = 100;         ///< N_Z.
  int width = 346;
  int height = 260;
  int kernel = 5;  ///< Side of the threshold's window: N_k is its square.

  double pixels() const { return static_cast<double>(width) * height; }
};

/// Milliseconds of one thread: the fastest of several runs.
struct Times {
  double warp_ms = std::numeric_limits<double>::infinity();   ///< Packets and back-projection.
  double sweep_ms = std::numeric_limits<double>::infinity();  ///< Votes, fusion and peaks.
  double depth_ms = std::numeric_limits<double>::infinity();  ///< Threshold and median.

  double sweepMs() const { return warp_ms + sweep_ms; }
};

Times measure(const StudyRun& run, const Sizes& sizes,
              FusionRule across_cameras = FusionRule::kHarmonic) {
  bench::SyntheticWindowOptions window;
  window.width = sizes.width;
  window.height = sizes.height;
  window.events_per_camera = static_cast<std::size_t>(sizes.events);
  window.cameras = sizes.cameras;
  const bench::SyntheticWindow made = bench::makeSyntheticWindow(window);
  KeyframeMapperOptions options = paperOptions(0.8, 8);
  options.planes.num_planes = sizes.planes;
  options.subintervals.count = sizes.subintervals;
  options.sweep.fusion.across_cameras = across_cameras;
  options.sweep.threads = 1;
  options.extraction.threshold_kernel = sizes.kernel;
  std::vector<int> cameras;
  for (int camera = 0; camera < sizes.cameras; ++camera) cameras.push_back(camera);
  KeyframeMapper mapper(made.rig, cameras, options);
  const std::vector<EventSpan> events(made.events.begin(), made.events.end());
  Times best;
  for (int i = 0; i < run.pick(7, 1); ++i) {
    bench::StageClock clock;
    mapper.map(made.window, events, made.trajectory, nullptr, &clock);
    best.warp_ms = std::min(best.warp_ms, clock.warp_ms);
    best.sweep_ms = std::min(best.sweep_ms, clock.sweep_ms);
    best.depth_ms = std::min(best.depth_ms, clock.depth_ms);
  }
  return best;
}

/// The terms of the paper's Eq. 19: DSI creation, DSI fusion, arg max.
constexpr int kTerms = 3;

std::array<double, kTerms> termsOf(const Sizes& sizes) {
  const double voxels = sizes.planes * sizes.pixels();
  return {sizes.cameras * sizes.events * sizes.planes, sizes.subintervals * sizes.cameras * voxels,
          voxels};
}

struct Sample {
  std::string varied;  ///< The changed size; empty for the paper's sizes.
  Sizes sizes;
  Times times;
};

/// Nanoseconds per unit of each term, and the max relative error of the formula.
struct Fit {
  std::array<double, kTerms> ns{};
  double worst = 0;

  double ms(const Sizes& sizes, int term) const {
    return 1e-6 * ns[static_cast<std::size_t>(term)] *
           termsOf(sizes)[static_cast<std::size_t>(term)];
  }
  double ms(const Sizes& sizes) const { return ms(sizes, 0) + ms(sizes, 1) + ms(sizes, 2); }
};

/// Least squares of relative errors. Terms with negative costs are removed.
Fit fit(const std::vector<Sample>& samples) {
  std::vector<int> used = {0, 1, 2};
  Fit best;
  while (true) {
    Eigen::MatrixXd a(samples.size(), used.size());
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const auto terms = termsOf(samples[i].sizes);
      for (std::size_t k = 0; k < used.size(); ++k) {
        a(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k)) =
            1e-6 * terms[static_cast<std::size_t>(used[k])] / samples[i].times.sweepMs();
      }
    }
    const Eigen::VectorXd ones = Eigen::VectorXd::Ones(a.rows());
    const Eigen::VectorXd ns = a.colPivHouseholderQr().solve(ones);
    Eigen::Index least = 0;
    if (ns.minCoeff(&least) < 0) {
      used.erase(used.begin() + least);
      continue;
    }
    for (std::size_t k = 0; k < used.size(); ++k) {
      best.ns[static_cast<std::size_t>(used[k])] = ns(static_cast<Eigen::Index>(k));
    }
    break;
  }
  for (const Sample& sample : samples) {
    const double off = std::abs(best.ms(sample.sizes) / sample.times.sweepMs() - 1);
    best.worst = std::max(best.worst, off);
  }
  return best;
}

/// Measures the paper's sizes, and each size changed alone.
std::vector<Sample> measureAll(const StudyRun& run) {
  std::vector<Sample> samples;
  const auto add = [&](const char* varied, auto change) {
    Sizes sizes;
    if (run.quick) sizes.events = 20'000;
    change(sizes);
    samples.push_back({varied, sizes, measure(run, sizes)});
  };
  add("", [](Sizes&) {});
  for (const double times : {0.25, 0.5, 2.0, 4.0}) {
    if (run.quick && times > 1) continue;
    add("N_e", [&](Sizes& sizes) { sizes.events *= times; });
  }
  for (const int planes : {50, 200}) add("N_Z", [&](Sizes& sizes) { sizes.planes = planes; });
  for (const int cameras : {1, 3, 4}) {
    add("N_c", [&](Sizes& sizes) { sizes.cameras = cameras; });
  }
  for (const int parts : {2, 4, 8}) {
    add("N_s", [&](Sizes& sizes) { sizes.subintervals = parts; });
  }
  for (const double scale : {0.5, 2.0}) {
    add("N_p", [&](Sizes& sizes) {
      sizes.width = static_cast<int>(std::lround(sizes.width * scale));
      sizes.height = static_cast<int>(std::lround(sizes.height * scale));
    });
  }
  return samples;
}

const Sample& sampleOf(const std::vector<Sample>& samples, int cameras, int subintervals) {
  return *std::find_if(samples.begin(), samples.end(), [&](const Sample& sample) {
    return sample.sizes.cameras == cameras && sample.sizes.subintervals == subintervals;
  });
}

double sizeOf(const Sizes& sizes, const std::string& varied) {
  if (varied == "N_e") return sizes.events;
  if (varied == "N_Z") return sizes.planes;
  if (varied == "N_c") return sizes.cameras;
  if (varied == "N_s") return sizes.subintervals;
  return sizes.pixels();
}

/// The exponent k of time = a * size^k: the slope of the least-squares line through the logarithms.
double fittedExponent(const std::vector<double>& sizes, const std::vector<double>& times) {
  const auto centred_logs = [](const std::vector<double>& values) -> Eigen::ArrayXd {
    const Eigen::ArrayXd logs =
        Eigen::Map<const Eigen::ArrayXd>(values.data(), static_cast<Eigen::Index>(values.size()))
            .log();
    return logs - logs.mean();
  };
  const Eigen::ArrayXd x = centred_logs(sizes);
  return (x * centred_logs(times)).sum() / x.square().sum();
}

struct Exponents {
  double measured = 0;
  double of_formula = 0;
};

/// The exponent of the time over one size; the other sizes are the paper's.
Exponents exponentsOver(const std::vector<Sample>& samples, const Fit& formula,
                        const std::string& varied) {
  std::vector<double> sizes;
  std::vector<double> measured;
  std::vector<double> of_formula;
  for (const Sample& sample : samples) {
    if (!sample.varied.empty() && sample.varied != varied) continue;
    sizes.push_back(sizeOf(sample.sizes, varied));
    measured.push_back(sample.times.sweepMs());
    of_formula.push_back(formula.ms(sample.sizes));
  }
  return {fittedExponent(sizes, measured), fittedExponent(sizes, of_formula)};
}

TextTable tableOf(const std::vector<Sample>& samples, const Fit& formula) {
  TextTable table{{"varied", "N_e [thousand]", "N_c", "N_s", "N_Z", "N_p [thousand]",
                   "measured [ms]", "formula [ms]", "threshold and median [ms]"},
                  {}};
  for (const Sample& sample : samples) {
    const Sizes& s = sample.sizes;
    table.rows.push_back({sample.varied, formatNumber(1e-3 * s.events, 0),
                          std::to_string(s.cameras), std::to_string(s.subintervals),
                          std::to_string(s.planes), formatNumber(1e-3 * s.pixels(), 0),
                          formatNumber(sample.times.sweepMs(), 1), formatNumber(formula.ms(s), 1),
                          formatNumber(sample.times.depth_ms, 2)});
  }
  return table;
}

/// Table 6 of the paper.
TextTable published() {
  return {{"step", "EMVS [ms]", "Alg. 1 [ms]", "Alg. 2 [ms]"},
          {{"DSI creation", "233.96", "520.01", "520.01"},
           {"DSI fusion", "-", "51.09", "98.01"},
           {"arg max", "36.34", "35.62", "35.62"},
           {"AGT", "0.28", "0.28", "0.28"}}};
}

TextTable stepsOf(const std::vector<Sample>& samples, const Fit& formula) {
  const Sample* const algorithms[] = {&sampleOf(samples, 1, 1), &sampleOf(samples, 2, 1),
                                      &sampleOf(samples, 2, 2)};
  const char* const steps[] = {"DSI creation", "densities and DSI fusion", "arg max"};
  TextTable table{{"step", "EMVS [ms]", "Alg. 1 [ms]", "Alg. 2 [ms]"}, {}};
  const auto add = [&](const char* step, auto ms) {
    std::vector<std::string> row = {step};
    for (const Sample* sample : algorithms) row.push_back(formatNumber(ms(*sample), 2));
    table.rows.push_back(row);
  };
  for (int term = 0; term < kTerms; ++term) {
    add(steps[term], [&](const Sample& sample) { return formula.ms(sample.sizes, term); });
  }
  add("all three, measured", [](const Sample& sample) { return sample.times.sweepMs(); });
  add("AGT and median, measured", [](const Sample& sample) { return sample.times.depth_ms; });
  return table;
}

/// Mean number of running or waiting processes over the last minute.
double loadAverage() {
  double load = 0;
  return getloadavg(&load, 1) == 1 ? load : 0;
}

void judge(const std::vector<Sample>& samples, const Fit& formula, StudySection& section) {
  section.trend("the formula fits all sizes: its max error is a quarter", formula.worst <= 0.25,
                formatNumber(100 * formula.worst, 0) + " % at worst",
                "The formula does not include the sorting of events into tiles, caches that fit a "
                "small keyframe only, and shared passes.");
  const double one = sampleOf(samples, 1, 1).times.sweepMs();
  const double two = sampleOf(samples, 2, 1).times.sweepMs();
  section.trend("two cameras take twice the time of one (1.8 to 2.3; paper: 2.2 for the creation)",
                two / one >= 1.8 && two / one <= 2.3, formatNumber(two / one, 2) + " times");
  for (const char* varied : {"N_e", "N_Z", "N_c", "N_s", "N_p"}) {
    const Exponents exponents = exponentsOver(samples, formula, varied);
    section.trend(std::string("the time grows with ") + varied +
                      " as the formula does (exponents within 0.15)",
                  std::abs(exponents.measured - exponents.of_formula) <= 0.15,
                  formatNumber(exponents.measured, 2) + ", the formula's " +
                      formatNumber(exponents.of_formula, 2),
                  "The formula does not include caches and the work per keyframe.");
  }
  const auto more = [&](int parts) { return sampleOf(samples, 2, parts).times.sweepMs() - two; };
  section.trend(
      "each further sub-interval costs the same (from 4 to 8 as from 1 to 4, within a "
      "third)",
      std::abs(more(8) / more(4) / (7.0 / 3) - 1) < 1.0 / 3,
      "2, 4, 8 sub-intervals cost " + listed({more(2), more(4), more(8)}, 1) + " ms more than one");
  const double creation = formula.ms(samples.front().sizes, 0);
  section.trend("DSI creation takes longest",
                creation > formula.ms(samples.front().sizes, 1) &&
                    creation > formula.ms(samples.front().sizes, 2),
                formatNumber(100 * creation / formula.ms(samples.front().sizes), 0) +
                    " % of Alg. 1 by the formula");
  const std::vector<double> depth = {sampleOf(samples, 1, 1).times.depth_ms,
                                     sampleOf(samples, 2, 1).times.depth_ms,
                                     sampleOf(samples, 2, 2).times.depth_ms};
  const double least = *std::min_element(depth.begin(), depth.end());
  const double most = *std::max_element(depth.begin(), depth.end());
  section.trend(
      "the threshold takes equally long for all algorithms (at most 1.5 times the fastest)",
      most <= 1.5 * least, listed(depth, 2) + " ms",
      "The time of the median grows with the number of points.");
}

void byRule(const StudyRun& run, StudySection& section) {
  TextTable table{{"function", "votes, fusion and arg max [ms]"}, {}};
  std::vector<double> times;
  for (const FusionRule rule : allFusionRules()) {
    Sizes sizes;
    if (run.quick) sizes.events = 20'000;
    times.push_back(measure(run, sizes, rule).sweepMs());
    table.rows.push_back({std::string(nameOf(rule)), formatNumber(times.back(), 1)});
  }
  section.table(table);
  const double least = *std::min_element(times.begin(), times.end());
  const double most = *std::max_element(times.begin(), times.end());
  section.trend(
      "the fusion functions take about the same (the slowest at most 1.25 times the "
      "fastest)",
      most <= 1.25 * least, formatNumber(most / least, 2) + " times",
      "Votes are cheap here: a root per voxel is not negligible.");
}

void byKernel(const StudyRun& run, StudySection& section) {
  std::vector<double> areas;
  std::vector<double> times;
  for (const int side : {5, 9, 15, 25}) {
    Sizes sizes;
    if (run.quick) sizes.events = 20'000;
    sizes.kernel = side;
    areas.push_back(side * side);
    times.push_back(measure(run, sizes).depth_ms);
  }
  const double exponent = fittedExponent(areas, times);
  section.trend("the threshold takes N_p N_k (exponent over N_k 0.85 to 1.15)",
                exponent >= 0.85 && exponent <= 1.15,
                formatNumber(exponent, 2) + "; " + listed(times, 2) +
                    " ms for windows of 5, 9, 15 "
                    "and 25 pixels' side",
                "A Gaussian window has two passes over its side, not one over its area, and the "
                "median does not depend on it. The formula is an upper bound.");
}

}  // namespace

void studyRuntime(const StudyRun& run, StudySection& section) {
  section.text(
      "The paper gives the complexity of its algorithms (Eqs. 17 to 19) as "
      "O(N_c N_e N_Z + N_s N_c N_Z N_p + N_Z N_p + N_p N_k): DSI creation, DSI fusion, "
      "arg max and AGT; and the time of each step (Table 6: N_e = 235 thousand, N_c = 2, "
      "N_p = 90 thousand, N_Z = 100, N_k = 25, N_s = 2; an Intel i7-10510U). Cited:");
  section.table(published());
  const std::vector<Sample> samples = measureAll(run);
  const Fit formula = fit(samples);
  section.text(
      "Here there is no volume: votes, fusion and the search for the max of a tile on a plane are "
      "one step (docs/performance.md). So the formula separates the steps. Its first three terms "
      "are fitted to the times of keyframes of many sizes; one size is changed at a time. The "
      "synthetic window of the benchmarks, process CPU time of one thread, the fastest of several "
      "runs, kernel " +
      std::string(nameOf(fastestKernel())) + "; load average of the machine " +
      formatNumber(loadAverage(), 1) + ".");
  section.table(tableOf(samples, formula));
  section.text("The fit: " + formatNumber(formula.ns[0], 3) + " ns a vote (N_c N_e N_Z), " +
               formatNumber(formula.ns[1], 3) + " ns a voxel of each input (N_s N_c N_Z N_p), " +
               formatNumber(formula.ns[2], 3) +
               " ns a voxel (N_Z N_p). By step, at the paper's "
               "sizes:");
  section.table(stepsOf(samples, formula));
  CurvePlot plot;
  plot.title = "Formula and measurement";
  plot.x = {"measured [ms]", AxisScale::kLogarithmic, {}, {}};
  plot.y = {"formula [ms]", AxisScale::kLogarithmic, {}, {}};
  plot.curves = {{"keyframes", {}, CurveStyle::kDots, {}}, {"equal", {}, CurveStyle::kLine, {}}};
  double least = std::numeric_limits<double>::infinity();
  double most = 0;
  for (const Sample& sample : samples) {
    plot.curves[0].points.emplace_back(sample.times.sweepMs(), formula.ms(sample.sizes));
    least = std::min(least, sample.times.sweepMs());
    most = std::max(most, sample.times.sweepMs());
  }
  plot.curves[1].points = {{least, least}, {most, most}};
  section.picture("runtime.png", drawCurves(plot),
                  "Time of votes, fusion and arg max: fitted formula over measurement");
  judge(samples, formula, section);
  byKernel(run, section);
  section.text("By fusion function, at the paper's sizes:");
  byRule(run, section);
}

}  // namespace efm::studies
