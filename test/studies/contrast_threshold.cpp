// SPDX-License-Identifier: BSD-3-Clause
// Ghosh and Gallego 2022, Sec. 4.10: sensors with different contrast thresholds.
#include <algorithm>
#include <string>
#include <vector>

#include "plugin/results/pictures/curve_plot.h"
#include "plugin/results/pictures/depth_picture.h"
#include "test/studies/figures/picture_grid.h"
#include "test/studies/methods/error_figures.h"
#include "test/studies/methods/error_table.h"
#include "test/studies/methods/method_comparison.h"
#include "test/studies/methods/outstanding_points.h"
#include "test/studies/methods/precision_curves.h"
#include "test/studies/recordings/flying_room.h"
#include "test/studies/recordings/real_rigs.h"
#include "test/studies/studies.h"

namespace efm::studies {
namespace {

std::string named(double threshold) { return "θ = " + formatNumber(threshold, 2); }

constexpr int kStrongest = 2500;  // points in a window

DepthErrors strongestErrors(const Recording& recording, const MethodResult& result) {
  std::vector<DepthPair> pairs;
  for (const KeyframeDepthMap& keyframe : result.keyframes) {
    const DepthMap& map = keyframe.map;
    const cv::Mat1f strongest = only(map.depth, mostOutstanding(map, map.depth > 0, kStrongest));
    appendPairs(strongest, truthOf(recording, keyframe), pairs);
  }
  return depthErrors(pairs);
}

/// Results that explain departures.
struct Explanation {
  /// With the white level of the lowest threshold for all.
  std::vector<MethodResult> one_white;
  std::vector<NamedPrecision> one_white_precision;
  std::vector<double> strongest_median_cm;  ///< Of the `kStrongest` most outstanding points.
};

void judge(const std::vector<MethodResult>& stereo, const std::vector<NamedPrecision>& precision,
           const Explanation& why, StudySection& section) {
  const auto own = &MethodResult::own;
  const std::vector<double> means = eachOf(stereo, own, meanCm);
  const std::vector<double> medians = eachOf(stereo, own, medianCm);
  const std::vector<double> points = eachOf(stereo, own, thousandPoints);
  section.trend(
      "fewer points are recovered as the threshold grows", falls(points),
      listed(points) + " thousand",
      "The threshold of the extraction is relative to the max confidence. All confidences fall "
      "with the number of events: as many pixels pass the threshold, with fewer votes.");
  const std::vector<double> absolute = eachOf(why.one_white, own, thousandPoints);
  section.trend("with the white level of the lowest threshold for all, they are fewer",
                falls(absolute), listed(absolute) + " thousand");
  section.trend(
      "the mean error is larger at high thresholds: at the highest it is above that at the lowest",
      means.back() > means.front(), listed(means) + " cm");
  section.trend(
      "the median error stays fairly constant: the largest is at most 1.5 times the "
      "smallest",
      maxOf(medians) <= 1.5 * minOf(medians), listed(medians, 2) + " cm",
      "It does on common pixels: " + listed(eachOf(stereo, &MethodResult::common, medianCm), 2) +
          " cm, and for the " + std::to_string(kStrongest) +
          " points of a window with the highest local contrast: " +
          listed(why.strongest_median_cm, 2) +
          " cm. At high thresholds the max confidence is a few votes, and points at a single "
          "crossing of rays pass the relative threshold.");
  section.trend("the mean varies more than the median: there are more outliers",
                maxOf(means) / minOf(means) > maxOf(medians) / minOf(medians),
                "largest over smallest: " +
                    against(maxOf(means) / minOf(means), maxOf(medians) / minOf(medians), 2),
                "The many points at single crossings change the median, too; see above.");
  const std::vector<double> precise = precisionAt(precision, 0.12);
  section.trend(
      "low thresholds give better precision: it falls as they grow, or rises by half a "
      "percent at most",
      falls(precise, 0.5), listed(precise) + " % within 12 cm");
  const std::vector<double> found = recallAt(precision, 0.12);
  section.trend("and better recall", falls(found), listed(found) + " % within 12 cm",
                "The reason is the number of points: it does not fall.");
  const std::vector<double> absolute_found = recallAt(why.one_white_precision, 0.12);
  section.trend("with one white level for all, recall falls", falls(absolute_found),
                listed(absolute_found) + " % within 12 cm");
}

}  // namespace

void studyContrastThreshold(const StudyRun& run, StudySection& section) {
  Simulation room = flyingRoom(run.pick(0.4, 0.05));
  if (run.quick) room = withWidth(room, 80);
  std::vector<double> thresholds = {0.05, 0.1, 0.2, 0.4, 0.8};
  if (run.quick) thresholds = {0.2, 0.4};
  std::vector<double> events;  // millions in a window
  std::vector<MethodResult> mono;
  std::vector<MethodResult> stereo;
  Explanation why;
  Recording recording;  // the last recording: the truth is the same in all
  std::vector<Window> windows;
  for (const double threshold : thresholds) {
    recording = run.recordings->make("room_theta" + formatNumber(threshold, 2),
                                     withThreshold(room, threshold));
    windows = recording.windows(run.pick(0.2, 0.05), run.pick(2, 1));
    events.push_back(1e-6 * recording.meanEventsIn(windows));
    const std::string name = named(threshold);
    mono.push_back(mapMethod(recording, windows, flyingRoomMono(), name));
    stereo.push_back(mapMethod(recording, windows, flyingRoomStereo(), name));
    Method one_white = flyingRoomStereo();
    one_white.options.extraction.max_confidence =
        MaxConfidence::of(stereo.front().keyframes.front().max_confidence);
    why.one_white.push_back(mapMethod(recording, windows, one_white, name));
  }
  for (std::vector<MethodResult>* results : {&mono, &stereo, &why.one_white}) {
    scoreMethods(recording, *results);
  }
  for (const MethodResult& result : stereo) {
    why.strongest_median_cm.push_back(medianCm(strongestErrors(recording, result)));
  }

  section.text(
      "The paper (Sec. 4.10) simulates flying_room with ESIM at five contrast "
      "thresholds. Here: the room, the rig and the windows of study 5 at 640x480, contrast "
      "thresholds of " +
      listed(thresholds, 2) + ", which make " + listed(events, 2) +
      " million events in a window of 0.2 s.");
  section.text(flyingRoomMono().name + ":");
  section.table(errorTable(mono, {true, false}));
  section.text(flyingRoomStereo().name + ":");
  section.table(errorTable(stereo, {true, false}));
  section.picture("contrast_threshold_errors.png",
                  errorCurves("Depth error by contrast threshold",
                              {"contrast threshold", AxisScale::kLogarithmic, {}, {}}, thresholds,
                              mono, stereo),
                  "Mean and median error by contrast threshold");

  std::vector<NamedPrecision> precision;
  for (std::size_t i = 0; i < stereo.size(); ++i) {
    precision.push_back({"theta " + formatNumber(thresholds[i], 2),
                         precisionOf(recording, stereo[i].keyframes, studyPairing())});
  }
  for (const MethodResult& result : why.one_white) {
    why.one_white_precision.push_back(
        {result.name, precisionOf(recording, result.keyframes, studyPairing())});
  }
  section.text("Precision, recall and F1 of two cameras, compared with every pixel of the truth:");
  section.table(precisionTable(precision, {0.04, 0.12}));
  section.picture("contrast_threshold_precision.png", drawPrecision(precision),
                  "Precision, recall and F1 over the allowed error, by contrast threshold");

  PictureGrid grid = depthAndConfidenceGrid(320);
  for (std::size_t i = 0; i < stereo.size(); ++i) {
    addColumn(precision[i].name, stereo[i].keyframes.front().map, flyingRoomStereo().options.planes,
              grid);
  }
  section.picture("contrast_threshold.png", drawGrid(grid),
                  "Two cameras: depth (red 1 m to blue 4 m) and confidence at each threshold");
  judge(stereo, precision, why, section);
}

}  // namespace efm::studies
