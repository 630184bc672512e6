// SPDX-License-Identifier: BSD-3-Clause
// Ghosh and Gallego 2022, Sec. 4.9: events of more and less sensitive sensors.
#include <algorithm>
#include <string>
#include <vector>

#include "plugin/curve_plot.h"
#include "plugin/depth_picture.h"
#include "test/studies/error_figures.h"
#include "test/studies/error_table.h"
#include "test/studies/flying_room.h"
#include "test/studies/method_comparison.h"
#include "test/studies/picture_grid.h"
#include "test/studies/precision_curves.h"
#include "test/studies/studies.h"

namespace efm::studies {
namespace {

/// What one contrast threshold gives.
struct Sensitivity {
  double threshold = 0;
  double million_events = 0;  ///< In a window.
};

std::string named(double threshold) { return "θ = " + formatNumber(threshold, 2); }

cv::Mat3b errorCurves(const std::vector<Sensitivity>& levels, const std::vector<MethodResult>& mono,
                      const std::vector<MethodResult>& stereo) {
  CurvePlot plot;
  plot.title = "Depth error by contrast threshold";
  plot.x = {"contrast threshold", AxisScale::kLogarithmic, {}, {}};
  plot.y = {"error [cm], own pixels", AxisScale::kLinear, 0, {}};
  const auto add = [&](const std::string& name, const std::vector<MethodResult>& of,
                       ErrorFigure figure) {
    Curve curve{name, {}, CurveStyle::kMarkedLine, {}};
    for (std::size_t i = 0; i < levels.size(); ++i) {
      curve.points.emplace_back(levels[i].threshold, figure(of[i].own));
    }
    plot.curves.push_back(curve);
  };
  add("one camera, mean", mono, meanCm);
  add("one camera, median", mono, medianCm);
  add("two cameras, mean", stereo, meanCm);
  add("two cameras, median", stereo, medianCm);
  return drawCurves(plot);
}

void judge(const std::vector<MethodResult>& stereo, const std::vector<NamedPrecision>& precision,
           StudySection& section) {
  const auto own = &MethodResult::own;
  const std::vector<double> means = eachOf(stereo, own, meanCm);
  const std::vector<double> medians = eachOf(stereo, own, medianCm);
  const std::vector<double> points = eachOf(stereo, own, thousandPoints);
  section.trend("fewer points are recovered as the threshold grows",
                std::is_sorted(points.rbegin(), points.rend()), listed(points) + " thousand");
  section.trend(
      "the mean error is larger at high thresholds: that at the highest exceeds that at "
      "the lowest",
      means.back() > means.front(), listed(means) + " cm");
  const auto [least, most] = std::minmax_element(medians.begin(), medians.end());
  section.trend(
      "the median error stays fairly constant: the largest is at most 1.5 times the "
      "smallest",
      *most <= 1.5 * *least, listed(medians, 2) + " cm");
  section.trend("the mean varies more than the median: it is outliers that come",
                *std::max_element(means.begin(), means.end()) /
                        *std::min_element(means.begin(), means.end()) >
                    *most / *least,
                "largest over smallest: " +
                    formatNumber(*std::max_element(means.begin(), means.end()) /
                                     *std::min_element(means.begin(), means.end()),
                                 2) +
                    " against " + formatNumber(*most / *least, 2));
  std::vector<double> precise;
  std::vector<double> found;
  for (const NamedPrecision& one : precision) {
    precise.push_back(100 * one.counts.precision(stepOf(one.counts, 0.12)));
    found.push_back(100 * one.counts.recall(stepOf(one.counts, 0.12)));
  }
  section.trend("low thresholds give better precision: it falls as they grow",
                std::is_sorted(precise.rbegin(), precise.rend()),
                listed(precise) + " % within 12 cm");
  section.trend("and better recall", std::is_sorted(found.rbegin(), found.rend()),
                listed(found) + " % within 12 cm");
}

}  // namespace

void studyContrastThreshold(const StudyRun& run, StudySection& section) {
  Simulation room = flyingRoom(run.pick(0.4, 0.05));
  if (run.quick) room = withWidth(room, 80);
  std::vector<double> thresholds = {0.05, 0.1, 0.2, 0.4, 0.8};
  if (run.quick) thresholds = {0.2, 0.4};
  std::vector<Sensitivity> levels;
  std::vector<MethodResult> mono;
  std::vector<MethodResult> stereo;
  Recording recording;  // the last one: the truth is the same in all
  std::vector<Window> windows;
  for (const double threshold : thresholds) {
    recording = run.recordings->make("room_theta" + formatNumber(threshold, 2),
                                     withThreshold(room, threshold));
    windows = recording.windows(run.pick(0.2, 0.05), run.pick(2, 1));
    double events = 0;
    for (const Window& window : windows) events += static_cast<double>(recording.eventsIn(window));
    levels.push_back({threshold, 1e-6 * events / static_cast<double>(windows.size())});
    mono.push_back(
        {named(threshold), mapWindows(recording, windows, flyingRoomMono()), {}, {}, {}});
    stereo.push_back(
        {named(threshold), mapWindows(recording, windows, flyingRoomStereo()), {}, {}, {}});
  }
  scoreMethods(recording, {}, mono);
  scoreMethods(recording, {}, stereo);

  std::vector<double> events;
  for (const Sensitivity& level : levels) events.push_back(level.million_events);
  section.text(
      "The paper (Sec. 4.9, Figs. 15 and 16) simulates flying_room with ESIM at five contrast "
      "thresholds. Here: the room, the rig and the windows of study 5 at 640x480, contrast "
      "thresholds of " +
      listed(thresholds, 2) + ", which make " + listed(events, 2) +
      " million events in a window of 0.2 s.");
  section.text(flyingRoomMono().name + ":");
  section.table(errorTable(mono, {true, false}));
  section.text(flyingRoomStereo().name + ":");
  section.table(errorTable(stereo, {true, false}));
  section.picture("contrast_threshold_errors.png", errorCurves(levels, mono, stereo),
                  "Mean and median error by contrast threshold");

  std::vector<NamedPrecision> precision;
  for (std::size_t i = 0; i < stereo.size(); ++i) {
    precision.push_back({"theta " + formatNumber(levels[i].threshold, 2),
                         precisionOf(recording, stereo[i].keyframes, studyPairing())});
  }
  section.text("Precision, recall and F1 of two cameras, against every pixel of the truth:");
  section.table(precisionTable(precision, {0.04, 0.12}));
  section.picture("contrast_threshold_precision.png", drawPrecision(precision),
                  "Precision, recall and F1 over the allowed error, by contrast threshold");

  PictureGrid grid;
  grid.rows = {"depth", "confidence"};
  grid.pictures.resize(2);
  grid.width_px = 320;
  for (std::size_t i = 0; i < stereo.size(); ++i) {
    grid.columns.push_back(precision[i].name);
    const DepthMap& map = stereo[i].keyframes.front().map;
    grid.pictures[0].push_back(boldDepthPicture(map.depth, flyingRoomStereo().options.planes));
    grid.pictures[1].push_back(confidencePicture(map.confidence));
  }
  section.picture("contrast_threshold.png", drawGrid(grid),
                  "Two cameras: depth (red 1 m to blue 4 m) and confidence at each threshold");
  judge(stereo, precision, section);
}

}  // namespace efm::studies
