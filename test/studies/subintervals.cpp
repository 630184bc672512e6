// SPDX-License-Identifier: BSD-3-Clause
// Ghosh and Gallego 2022, Sec. 4.4: fusion across time, with two cameras and with one.
#include <algorithm>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "mapping/depth/peak_fit.h"
#include "test/studies/figures/picture_grid.h"
#include "test/studies/methods/error_figures.h"
#include "test/studies/methods/error_table.h"
#include "test/studies/methods/method_comparison.h"
#include "test/studies/recordings/real_rigs.h"
#include "test/studies/recordings/recording_errors.h"
#include "test/studies/studies.h"

namespace efm::studies {
namespace {

constexpr int kParts = 4;

/// A_t∘H_c.
Method stereo(int subintervals) {
  Method method{"N_s = " + std::to_string(subintervals), paperOptions(1, 6.5)};
  method.options.subintervals.count = subintervals;
  return method;
}

Method mono(int subintervals) {
  Method method = oneCamera(1, 6.5, subintervals == 1 ? "without fusion (EMVS)" : "H_t");
  method.options.subintervals.count = subintervals;
  method.options.sweep.fusion.across_time = FusionRule::kHarmonic;
  return method;
}

/// Part `i` of each window, in the reference view of the whole window.
std::vector<Window> partsOf(const std::vector<Window>& windows, int i) {
  std::vector<Window> parts;
  for (const Window& window : windows) {
    const std::int64_t length_ns = window.t1_ns - window.t0_ns;
    parts.push_back({window.t0_ns + length_ns * i / kParts,
                     window.t0_ns + length_ns * (i + 1) / kParts, window.t_ref_ns});
  }
  return parts;
}

/// Table 4 of the paper.
TextTable published() {
  return {
      {"N_s", "mean [cm]", "median [cm]", "bad-pix [%]", "SILog", "AErrR [%]", "log RMSE",
       "δ<1.25 [%]", "δ<1.25² [%]", "δ<1.25³ [%]", "points [million]"},
      {{"2", "20.92", "9.76", "1.66", "1.86", "8.05", "13.81", "94.39", "97.80", "99.14", "1.14"},
       {"4", "20.49", "9.58", "1.63", "1.94", "7.88", "13.65", "94.64", "97.82", "99.15", "1.19"},
       {"8", "19.80", "9.27", "1.56", "1.84", "7.63", "13.31", "94.99", "97.90", "99.19", "1.20"}}};
}

/// The median error of a method's points with the best planes. Errors are then uniform within half
/// a step to both sides.
double medianQuarterStepCm(const Recording& recording, const MethodResult& result) {
  const double step = DepthPlanes(paperOptions(1, 6.5).planes).inverseDepthStep();
  std::vector<double> quarters;
  for (const KeyframeDepthMap& keyframe : result.keyframes) {
    for (const DepthPair& pair :
         pairDepths({keyframe.map.depth, truthOf(recording, keyframe)}, studyPairing())) {
      quarters.push_back(100 * 0.25 * step * pair.truth_m * pair.truth_m);
    }
  }
  if (quarters.empty()) return 0;
  return upperMedian(quarters);
}

/// @param departure the reason of a departure, printed once.
void judgeNumbers(const std::vector<MethodResult>& results, std::string departure,
                  StudySection& section) {
  const auto judged = [&](const std::string& claim, bool agrees, const std::string& figures) {
    section.trend(claim, agrees, figures, departure);
    if (!agrees && !departure.empty()) departure = "For the same reason.";
  };
  const auto eachOfThem = [&](DepthErrors MethodResult::*pixels, ErrorFigure figure) {
    std::vector<double> values;
    for (const char* name : {"N_s = 2", "N_s = 4", "N_s = 8"}) {
      values.push_back(figure(resultOf(results, name).*pixels));
    }
    return values;
  };
  const auto falls = [&](const std::string& claim, ErrorFigure figure, const std::string& unit) {
    const std::vector<double> values = eachOfThem(&MethodResult::own, figure);
    judged(claim, values[0] > values[1] && values[1] > values[2],
           listed(values, 2) + unit + "; on common pixels " +
               listed(eachOfThem(&MethodResult::common, figure), 2));
  };
  falls("the mean error falls with N_s from 2 to 8", meanCm, " cm");
  falls("so does the median error", medianCm, " cm");
  falls("so does bad-pix", badPercent, " %");
  const std::vector<double> points = eachOfThem(&MethodResult::own, thousandPoints);
  judged("the number of points rises", grows(points), listed(points, 2) + " thousand");
  const DepthErrors& two = resultOf(results, "N_s = 2").own;
  const double by_camera = 1 - two.median_abs_m / results[0].own.median_abs_m;
  const double by_time = 1 - resultOf(results, "N_s = 8").own.median_abs_m / two.median_abs_m;
  section.trend(
      "a second camera gains more than sub-intervals do (paper: the median error falls by "
      "32 % and by 5 %)",
      by_camera > by_time,
      formatNumber(100 * by_camera, 1) + " % from one camera to N_s = 2, " +
          formatNumber(100 * by_time, 1) + " % from there to N_s = 8");
}

void numberOfSubintervals(const StudyRun& run, const Recording& recording, StudySection& section) {
  section.heading("Number of sub-intervals");
  section.text(
      "The paper's Table 4: A_t∘H_c, windows of 1 s, MVSEC's three indoor flights. Cited:");
  section.table(published());
  section.text(
      "Here: the recording of study 1, the windows of study 2. N_s = 1 is Alg. 1. Windows "
      "of 1 s:");
  const std::vector<Method> methods = {oneCamera(1, 6.5), stereo(1), stereo(2), stereo(4),
                                       stereo(8)};
  const auto seconds = recording.windows(run.pick(1.0, 0.1), run.pick(10, 1));
  const auto in_a_second = compareMethods(recording, seconds, methods);
  section.table(errorTable(in_a_second));
  const double floor_cm = medianQuarterStepCm(recording, resultOf(in_a_second, "N_s = 2"));
  judgeNumbers(
      in_a_second,
      "With exact poses there is little to gain: the median error would be " +
          formatNumber(floor_cm, 2) +
          " cm if each point had the best plane. With swaying poses, below, there is more to gain.",
      section);

  section.text(
      "The same with swaying poses: on each axis a sine of 1 cm and 0.1 degrees at about 1 Hz "
      "around the true poses:");
  const auto swayed = compareMethods(withPoseSway(recording, kTrackerSway), seconds, methods);
  section.table(errorTable(swayed));
  judgeNumbers(swayed, "", section);

  section.text("Windows of 0.2 s, exact poses:");
  const auto shorter = recording.windows(run.pick(0.2, 0.05), run.pick(25, 1));
  const auto in_less = compareMethods(recording, shorter, methods);
  section.table(errorTable(in_less));
  judgeNumbers(
      in_less,
      "Eight sub-intervals are too many for such windows: each holds " +
          formatNumber(1e-3 * recording.meanEventsIn(shorter) / 8, 1) +
          " thousand events of both cameras. Where a camera has no event in a sub-interval, the "
          "harmonic mean is zero. (The paper's sub-intervals have about 70 thousand events.)",
      section);
}

/// Maps of the parts of each window and of the whole window.
std::vector<MethodResult> partsAndWhole(const Recording& recording,
                                        const std::vector<Window>& windows, const Method& of_part,
                                        const Method& whole) {
  std::vector<MethodResult> results;
  for (int i = 0; i < kParts; ++i) {
    results.push_back(mapMethod(recording, partsOf(windows, i), of_part,
                                "sub-interval " + std::to_string(i + 1)));
  }
  results.push_back(mapMethod(recording, windows, whole, "fused"));
  return results;
}

void singleSubintervals(const StudyRun& run, const Recording& recording, StudySection& section) {
  section.heading("Single sub-intervals and all of them fused");
  section.text(
      "The paper's Fig. 10: the depth maps of four sub-intervals of a window are noisy; the fused "
      "map is clean. Here: windows of 0.4 s with four sub-intervals. All maps have the reference "
      "view of the window. Above: one camera (fused: H_t); below: two cameras (fused: A_t∘H_c).");
  const auto windows = recording.windows(run.pick(0.4, 0.1), run.pick(12, 1));
  const Method stereo_part = stereo(1);
  auto one = partsAndWhole(recording, windows, mono(1), mono(kParts));
  auto both = partsAndWhole(recording, windows, stereo_part, stereo(kParts));
  PictureGrid grid;
  grid.rows = {"one camera", "two cameras"};
  grid.width_px = 300;
  for (auto* results : {&one, &both}) {
    scoreMethods(recording, *results);
    grid.pictures.emplace_back();
    grid.columns.clear();
    const std::size_t shown = richestWindow(both.back());
    for (const MethodResult& result : *results) {
      grid.columns.push_back(result.name);
      grid.pictures.back().push_back(
          boldDepthPicture(result.keyframes[shown].map.depth, stereo_part.options.planes));
    }
  }
  section.picture("subintervals.png", drawGrid(grid),
                  "Depth maps of four sub-intervals of a window of 0.4 s, and of the window fused");
  section.text("One camera:");
  section.table(errorTable(one));
  section.text("Two cameras:");
  section.table(errorTable(both));
  for (const auto& [name, results] : {std::pair{"one camera", &one}, {"two cameras", &both}}) {
    std::vector<double> bad;
    for (int i = 0; i < kParts; ++i) {
      bad.push_back(badPercent((*results)[static_cast<std::size_t>(i)].own));
    }
    const double fused = badPercent(results->back().own);
    section.trend(std::string("the fused map is cleaner than that of any sub-interval, ") + name,
                  fused < minOf(bad),
                  "bad-pix " + formatNumber(fused, 2) + " against " + listed(bad, 2) + " %");
  }
  section.trend("the fused map of two cameras has fewer outliers than that of one",
                badPercent(both.back().own) < badPercent(one.back().own),
                "bad-pix " + formatNumber(badPercent(both.back().own), 2) + " against " +
                    formatNumber(badPercent(one.back().own), 2) + " %");
}

void oneCameraAcrossTime(const StudyRun& run, const Recording& recording, StudySection& section) {
  section.heading("One camera fused across time");
  section.text(
      "The paper (Sec. 4.4.2, Fig. 9) fuses four sub-intervals of one camera by the harmonic mean: "
      "a light improvement, mainly with little data. DSI projections are in study 9.");
  std::vector<double> durations_s = {0.1, 0.2, 1};
  if (run.quick) durations_s = {0.1};
  for (const double duration_s : durations_s) {
    const auto results = compareMethods(
        recording, recording.windows(duration_s, run.pick(duration_s < 1 ? 25 : 10, 1)),
        {mono(1), mono(kParts)});
    section.text("Windows of " + formatNumber(duration_s, 1) + " s:");
    section.table(errorTable(results, {true, false}));
    const DepthErrors& without = results[0].own;
    const DepthErrors& with = results[1].own;
    section.trend("fusion across time improves the map of one camera in windows of " +
                      formatNumber(duration_s, 1) + " s",
                  with.mean_abs_m < without.mean_abs_m,
                  "mean error " + formatNumber(meanCm(with), 1) + " against " +
                      formatNumber(meanCm(without), 1) + " cm, bad-pix " +
                      formatNumber(badPercent(with), 1) + " against " +
                      formatNumber(badPercent(without), 1) + " %",
                  "It keeps more points. At equal numbers its mean error is " +
                      formatNumber(meanCm(results[1].equal), 1) + " against " +
                      formatNumber(meanCm(results[0].equal), 1) + " cm.");
  }
}

}  // namespace

void studySubintervals(const StudyRun& run, StudySection& section) {
  const Recording recording = roomRecording(run);
  numberOfSubintervals(run, recording, section);
  singleSubintervals(run, recording, section);
  oneCameraAcrossTime(run, recording, section);
}

}  // namespace efm::studies
