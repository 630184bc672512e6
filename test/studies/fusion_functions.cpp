// SPDX-License-Identifier: BSD-3-Clause
// Ghosh and Gallego 2022, Sec. 4.2: the functions that fuse the DSIs of two cameras.
#include <string>
#include <vector>

#include "mapping/geometry/timestamp.h"
#include "plugin/results/pictures/curve_plot.h"
#include "plugin/results/pictures/depth_picture.h"
#include "test/studies/figures/picture_grid.h"
#include "test/studies/methods/error_figures.h"
#include "test/studies/methods/error_table.h"
#include "test/studies/methods/method_comparison.h"
#include "test/studies/recordings/real_rigs.h"
#include "test/studies/studies.h"

namespace efm::studies {
namespace {

std::vector<Method> oneOfEachRule() {
  std::vector<Method> methods;
  for (const FusionRule rule : allFusionRules()) {
    Method method{std::string(nameOf(rule)), paperOptions(1, 6.5)};
    method.options.sweep.fusion.across_cameras = rule;
    methods.push_back(method);
  }
  return methods;
}

/// Table 2 of the paper, its column flying1.
TextTable published() {
  return {{"function", "mean [cm]", "median [cm]", "bad-pix [%]", "points [million]"},
          {{"min", "58.13", "24.07", "17.40", "6.13"},
           {"harmonic", "60.16", "25.45", "18.58", "6.61"},
           {"geometric", "63.57", "28.17", "20.30", "6.90"},
           {"arithmetic", "78.78", "38.15", "27.20", "5.97"},
           {"rms", "99.15", "61.73", "36.84", "7.65"},
           {"max", "109.30", "75.44", "41.31", "9.25"}}};
}

/// The fraction of pixels with a confidence of at least a tenth of the map's max.
double spreadOf(const DepthMap& map) {
  double largest = 0;
  cv::minMaxLoc(map.confidence, nullptr, &largest);
  return cv::countNonZero(map.confidence > 0.1 * largest) /
         static_cast<double>(map.confidence.total());
}

void judge(const std::vector<MethodResult>& results, StudySection& section) {
  const auto check = [&](const std::string& claim, const std::vector<double>& values,
                         const std::string& unit, const std::string& departure = "") {
    section.trend(claim, grows(values), listed(values) + unit, departure);
  };
  const auto own = &MethodResult::own;
  check("the mean error grows from min to max, in the order of the means",
        eachOf(results, own, meanCm), " cm");
  check("so does the median error", eachOf(results, own, medianCm), " cm");
  check("so does bad-pix", eachOf(results, own, badPercent), " %");
  check("bad-pix grows on common pixels, too: other pixels are not the only reason",
        eachOf(results, &MethodResult::common, badPercent), " %");
  check("and at equal numbers", eachOf(results, &MethodResult::equal, badPercent), " %");

  const DepthErrors& min = resultOf(results, "min").own;
  const DepthErrors& harmonic = resultOf(results, "harmonic").own;
  const DepthErrors& geometric = resultOf(results, "geometric").own;
  const DepthErrors& arithmetic = resultOf(results, "arithmetic").own;
  const DepthErrors& max = resultOf(results, "max").own;
  const auto points = [](const DepthErrors& errors) {
    return formatNumber(thousandPoints(errors), 1) + " thousand";
  };
  section.trend(
      "the functions above the arithmetic mean keep more points, but their number does "
      "not grow evenly: the arithmetic mean keeps fewer than the geometric",
      max.points > min.points && arithmetic.points < geometric.points,
      "min " + points(min) + ", geometric " + points(geometric) + ", arithmetic " +
          points(arithmetic) + ", max " + points(max));
  section.trend("the harmonic mean keeps more points than min (paper: +7.9 % on flying1)",
                harmonic.points > min.points,
                percentMore(thousandPoints(harmonic), thousandPoints(min)));
  section.trend(
      "for little accuracy: its mean error is at most 10 % larger (paper: +3.5 % on flying1)",
      harmonic.mean_abs_m <= 1.1 * min.mean_abs_m, percentMore(meanCm(harmonic), meanCm(min)));
  section.trend(
      "medians are far below means: there are outliers",
      min.median_abs_m < 0.5 * min.mean_abs_m && harmonic.median_abs_m < 0.5 * harmonic.mean_abs_m,
      "min " + formatNumber(100 * min.median_abs_m, 1) + " of " +
          formatNumber(100 * min.mean_abs_m, 1) + " cm, harmonic " +
          formatNumber(100 * harmonic.median_abs_m, 1) + " of " +
          formatNumber(100 * harmonic.mean_abs_m, 1) + " cm");
  std::vector<double> spreads;
  for (const MethodResult& result : results) {
    double sum = 0;
    for (const KeyframeDepthMap& keyframe : result.keyframes) sum += spreadOf(keyframe.map);
    spreads.push_back(100 * sum / static_cast<double>(result.keyframes.size()));
  }
  check(
      "confidence maps are sharper for functions closer to min: fewer pixels have a tenth of the "
      "map's max",
      spreads, " % of the pixels");
}

/// The differences between the functions by the amount of data.
void byWindow(const StudyRun& run, const Recording& recording, StudySection& section) {
  std::vector<double> durations_s = {0.05, 0.1, 0.2, 0.5, 1};
  if (run.quick) durations_s = {0.05, 0.1};
  const std::vector<Method> methods = oneOfEachRule();
  CurvePlot plot;
  plot.title = "Fusion functions by window";
  plot.x = {"window [s]", AxisScale::kLogarithmic, {}, {}};
  plot.y = {"bad-pix [%], own pixels", AxisScale::kLinear, 0, {}};
  for (const Method& method : methods) {
    plot.curves.push_back({method.name, {}, CurveStyle::kMarkedLine, {}});
  }
  std::vector<double> ratios;
  for (const double duration_s : durations_s) {
    const auto results =
        compareMethods(recording, recording.windows(duration_s, run.pick(10, 2)), methods);
    for (std::size_t m = 0; m < results.size(); ++m) {
      plot.curves[m].points.emplace_back(duration_s, badPercent(results[m].own));
    }
    ratios.push_back(badPercent(resultOf(results, "arithmetic").own) -
                     badPercent(resultOf(results, "harmonic").own));
  }
  section.trend("the less data, the more the functions differ", ratios.front() > ratios.back(),
                "bad-pix of the arithmetic mean minus that of the harmonic mean: " +
                    listed(ratios) + " % for windows of " + listed(durations_s, 2) + " s");
  section.picture("fusion_functions_windows.png", drawCurves(plot),
                  "Fraction of bad pixels of each fusion function by the length of the window");
}

}  // namespace

void studyFusionFunctions(const StudyRun& run, StudySection& section) {
  const Recording recording = roomRecording(run);
  const auto windows = recording.windows(0.1, run.pick(40, 2));
  const std::vector<Method> methods = oneOfEachRule();
  const auto results = compareMethods(recording, windows, methods);

  section.text(
      "The paper (Sec. 4.2, Table 2, Fig. 7) fuses the two cameras' DSIs with six functions on "
      "MVSEC's indoor flights, in windows of 0.1 s: there the differences are largest. The table "
      "cites its figures for flying1, on real events:");
  section.table(published());
  section.text("Here: MVSEC's real calibration on the smoothed trajectory of flying1 (" +
               formatNumber(secondsBetween(0, recording.simulation.duration_ns), 0) +
               " s from the start of motion) through a simulated room; " +
               std::to_string(windows.size()) +
               " windows of 0.1 s, evenly spread; planes from 1 to 6.5 m.");
  section.table(errorTable(results, {true, false}));

  PictureGrid grid = depthAndConfidenceGrid(300);
  for (const MethodResult& result : results) {
    addColumn(result.name, result.keyframes[windows.size() / 2].map, methods.front().options.planes,
              grid);
  }
  section.picture("fusion_functions.png", drawGrid(grid),
                  "One window: depth (red near, blue far) and confidence (dark high) of each "
                  "fusion function");
  judge(results, section);
  byWindow(run, recording, section);
}

}  // namespace efm::studies
