// SPDX-License-Identifier: BSD-3-Clause
// Ghosh and Gallego 2022, Sec. 4.8: three cameras against two and one.
#include <algorithm>
#include <string>
#include <vector>

#include "plugin/results/pictures/depth_picture.h"
#include "test/studies/figures/picture_grid.h"
#include "test/studies/methods/error_figures.h"
#include "test/studies/methods/error_table.h"
#include "test/studies/methods/method_comparison.h"
#include "test/studies/methods/precision_curves.h"
#include "test/studies/recordings/real_rigs.h"
#include "test/studies/studies.h"
#include "tracking_stub/presets/presets.h"

namespace efm::studies {
namespace {

Method fused(const char* name, const std::vector<int>& cameras) {
  return {name, paperOptions(0.8, 4.5), cameras};
}

/// Errors at the pixels that all cameras see.
std::vector<MethodResult> whereAllSee(const Recording& recording,
                                      std::vector<MethodResult> results) {
  for (std::size_t w = 0; w < results.front().keyframes.size(); ++w) {
    cv::Mat1b seen(results.front().keyframes[w].map.depth.size(), 255);
    for (const MethodResult& alone : results) seen &= alone.keyframes[w].map.confidence > 0;
    for (MethodResult& result : results) result.keyframes[w].map.depth.setTo(0, ~seen);
  }
  scoreMethods(recording, results);
  return results;
}

double votesOf(const MethodResult& result) {
  double votes = 0;
  for (const KeyframeDepthMap& keyframe : result.keyframes) {
    votes += static_cast<double>(keyframe.votes.total());
  }
  return votes / static_cast<double>(result.keyframes.size());
}

/// Fraction of the view with confidence.
double sharedView(const MethodResult& result) {
  double pixels = 0;
  double all = 0;
  for (const KeyframeDepthMap& keyframe : result.keyframes) {
    pixels += cv::countNonZero(keyframe.map.confidence > 0);
    all += static_cast<double>(keyframe.map.confidence.total());
  }
  return pixels / all;
}

void judge(const std::vector<MethodResult>& results, const std::vector<MethodResult>& within,
           StudySection& section) {
  const MethodResult& three = resultOf(results, "three");
  const auto beyond = [](const DepthErrors& errors) { return 100 * errors.beyond_tenth; };
  std::vector<double> one_beyond;
  for (const char* name : {"camera 0", "camera 1", "camera 2"}) {
    one_beyond.push_back(beyond(resultOf(results, name).own));
  }
  const std::vector<double> two_beyond = {beyond(resultOf(results, "0 and 1").own),
                                          beyond(resultOf(results, "0 and 2").own),
                                          beyond(resultOf(results, "1 and 2").own)};
  section.trend("the fused map suppresses the outliers of the single cameras' maps",
                beyond(three.own) < 0.5 * minOf(one_beyond),
                "beyond 10 %: " + formatNumber(beyond(three.own), 2) + " % against " +
                    listed(one_beyond, 2) + " %");
  section.trend("three cameras have fewer than any two", beyond(three.own) < minOf(two_beyond),
                formatNumber(beyond(three.own), 2) + " % against " + listed(two_beyond, 2) + " %");
  std::vector<double> medians;
  for (const char* name : {"0 and 1", "0 and 2", "1 and 2", "three"}) {
    medians.push_back(medianCm(resultOf(within, name).common));
  }
  section.trend(
      "where all cameras see, on common pixels, they are more accurate than any two",
      medians.back() < *std::min_element(medians.begin(), medians.end() - 1),
      "median error of 0 and 1, 0 and 2, 1 and 2, all three: " + listed(medians, 2) + " cm");
  section.trend("the fused map inherits the narrow overlap of the fields of view",
                sharedView(three) < sharedView(resultOf(results, "camera 0")),
                "confidence in " + formatNumber(100 * sharedView(three), 1) + " % of the view, " +
                    formatNumber(100 * sharedView(resultOf(results, "camera 0")), 1) +
                    " % with the reference camera alone");
  const double sum = votesOf(resultOf(results, "camera 0")) +
                     votesOf(resultOf(results, "camera 1")) +
                     votesOf(resultOf(results, "camera 2"));
  section.trend("cameras are not processed in pairs: the votes are the sum of the cameras' votes",
                votesOf(three) == sum,
                formatNumber(1e-6 * votesOf(three), 1) + " million a window, " +
                    formatNumber(1e-6 * sum, 1) + " million");
}

}  // namespace

void studyThreeCameras(const StudyRun& run, StudySection& section) {
  SimulationOptions preset;
  preset.preset = "trinocular";
  preset.duration_s = run.pick(1.0, 0.02);
  const Recording recording = run.recordings->make("trinocular", makeSimulation(preset));
  const auto windows = recording.windows(run.pick(0.2, 0.02), run.pick(4, 1));
  const std::vector<Method> methods = {fused("camera 0", {0}),   fused("camera 1", {1}),
                                       fused("camera 2", {2}),   fused("0 and 1", {0, 1}),
                                       fused("0 and 2", {0, 2}), fused("1 and 2", {1, 2}),
                                       fused("three", {0, 1, 2})};
  const auto results = compareMethods(recording, windows, methods);
  section.text(
      "The paper (Sec. 4.8) fuses the three cameras of EVIMO2's rig and shows the maps. Here, with "
      "exact truth: the preset `trinocular` with three fisheyes of 640x480 in a furnished room. "
      "One is upright, and their directions differ by up to 6°; " +
      std::to_string(windows.size()) +
      " windows of 0.2 s, planes from 0.8 to 4.5 m, the harmonic mean of all cameras, the view of "
      "camera 0. Bad-pix uses the baseline of cameras 0 and 1.");
  section.table(errorTable(results, {true, false}));
  const auto within = whereAllSee(recording, results);
  section.text(
      "The same at the pixels where every combination of cameras has confidence. Outside of these "
      "the three cameras together have none.");
  section.table(errorTable(within, {true, false}));

  std::vector<NamedPrecision> precision;
  for (const MethodResult& result : results) {
    precision.push_back({result.name, precisionOf(recording, result.keyframes, studyPairing())});
  }
  section.picture("three_cameras_precision.png", drawPrecision(precision),
                  "Precision, recall and F1 over the allowed error, by the cameras fused");
  PictureGrid grid = depthAndConfidenceGrid(320);
  for (const char* name : {"camera 0", "camera 1", "camera 2", "0 and 1", "three"}) {
    addColumn(name, resultOf(results, name).keyframes.front().map, methods.front().options.planes,
              grid);
  }
  section.picture("three_cameras.png", drawGrid(grid),
                  "Depth (red 0.8 m to blue 4.5 m) and confidence in the view of camera 0");
  judge(results, within, section);
}

}  // namespace efm::studies
