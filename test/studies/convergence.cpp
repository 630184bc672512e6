// SPDX-License-Identifier: BSD-3-Clause
// Ghosh and Gallego 2022, Sec. 3.3.2 (Fig. 4) and 4.4.2 (Fig. 9): the DSI becomes clear with more
// events.
#include <Eigen/Geometry>
#include <string>
#include <utility>
#include <vector>

#include "plugin/results/pictures/curve_plot.h"
#include "test/studies/figures/dsi_projections.h"
#include "test/studies/figures/picture_grid.h"
#include "test/studies/methods/error_figures.h"
#include "test/studies/methods/error_table.h"
#include "test/studies/methods/method_comparison.h"
#include "test/studies/recordings/real_rigs.h"
#include "test/studies/studies.h"
#include "tracking_stub/presets/presets.h"

namespace efm::studies {
namespace {

constexpr const char* kOneAcross = "one camera, H_t";
constexpr const char* kStereo = "two cameras, H_c∘A_t (Alg. 1)";
constexpr const char* kStereoHalves = "two cameras, A_t∘H_c, N_s = 2";
constexpr const char* kStereoAcross = "two cameras, A_t∘H_c, N_s = 4";

std::vector<Method> methodsOver(double min_depth_m, double max_depth_m) {
  const KeyframeMapperOptions plain = paperOptions(min_depth_m, max_depth_m);
  KeyframeMapperOptions split = plain;
  split.subintervals.count = 4;
  KeyframeMapperOptions halves = plain;
  halves.subintervals.count = 2;
  KeyframeMapperOptions harmonic = split;
  harmonic.sweep.fusion.across_time = FusionRule::kHarmonic;
  return {{kOneCamera, plain, {0}},
          {kOneAcross, harmonic, {0}},
          {kStereo, plain},
          {kStereoAcross, split},
          {kStereoHalves, halves}};
}

/// The preset slider with a second camera: the paper's rig on a linear slider.
Simulation stereoSlider(const StudyRun& run) {
  constexpr double kBaselineM = 0.1;
  SimulationOptions options;
  options.preset = "slider";
  if (run.quick) options.duration_s = 0.2;
  Simulation simulation = makeSimulation(options);
  RigCamera right = simulation.rig.cameras.front();
  right.T_rig_cam.translation = Eigen::Vector3d(kBaselineM, 0, 0);
  simulation.rig.cameras.push_back(right);
  return simulation;
}

/// A window around the middle of the recording.
Window around(const Recording& recording, double duration_s) {
  const Simulation& simulation = recording.simulation;
  const Window middle = recording.windows(duration_s, 3)[1];
  return {middle.t0_ns, middle.t1_ns, simulation.start_ns + simulation.duration_ns / 2};
}

cv::Mat3b projectionsOf(const Recording& recording, const Window& window, const Method& method) {
  KeyframeMapper mapper(recording.simulation.rig, method.cameras, method.options);
  DsiProjections projections(mapper.planes(), mapper.view());
  mapper.map(window, recording.eventsOf(window), recording.trajectory, &projections);
  return projections.picture();
}

void showProjections(const StudyRun& run, const Recording& recording, StudySection& section) {
  std::vector<double> durations_s = {0.05, 0.2, 1};
  if (run.quick) durations_s = {0.05, 0.1};
  PictureGrid grid;
  grid.width_px = 343;
  for (const double duration_s : durations_s) {
    grid.columns.push_back(formatNumber(duration_s, 2) + " s");
  }
  grid.rows = {"one camera", "one camera, Ht", "Hc o At (Alg. 1)", "At o Hc, Ns = 4"};
  std::vector<Method> methods = methodsOver(0.47, 2.4);
  methods.resize(grid.rows.size());
  for (const Method& method : methods) {
    grid.pictures.emplace_back();
    for (const double duration_s : durations_s) {
      grid.pictures.back().push_back(
          projectionsOf(recording, around(recording, duration_s), method));
    }
  }
  section.picture("convergence_dsi.png", drawGrid(grid),
                  "The max values of the DSI along its axes, from the front, from above (near "
                  "below) and from the side (near left), by the length of the window");
}

/// Errors by the length of the window.
std::vector<std::vector<MethodResult>> errorsOver(const Recording& recording,
                                                  const std::vector<double>& durations_s,
                                                  const std::vector<Method>& methods, int windows) {
  std::vector<std::vector<MethodResult>> results;
  for (const double duration_s : durations_s) {
    results.push_back(compareMethods(recording, recording.windows(duration_s, windows), methods));
  }
  return results;
}

cv::Mat3b curvesOf(const std::string& title, const std::vector<double>& durations_s,
                   const std::vector<std::vector<MethodResult>>& results) {
  const char* const labels[] = {"one camera", "one camera, Ht", "Hc o At (Alg. 1)",
                                "At o Hc, Ns = 4", "At o Hc, Ns = 2"};
  CurvePlot plot;
  plot.title = title;
  plot.x = {"window [s]", AxisScale::kLogarithmic, {}, {}};
  plot.y = {"mean error [cm], own pixels", AxisScale::kLogarithmic, {}, {}};
  for (std::size_t m = 0; m < results.front().size(); ++m) {
    std::vector<double> means;
    for (const auto& of_duration : results) means.push_back(meanCm(of_duration[m].own));
    plot.curves.push_back(markedCurve(labels[m], durations_s, means));
  }
  return drawCurves(plot);
}

void addTable(const std::vector<double>& durations_s,
              const std::vector<std::vector<MethodResult>>& results, StudySection& section) {
  TextTable table;
  table.head = {"method", "pixels"};
  for (const double duration_s : durations_s) {
    table.head.push_back(formatNumber(duration_s, 2) + " s");
  }
  for (std::size_t m = 0; m < results.front().size(); ++m) {
    for (const auto& [pixels, errors] :
         {std::pair{"own", &MethodResult::own}, {"common", &MethodResult::common}}) {
      const bool own = errors == &MethodResult::own;
      std::vector<std::string> row = {own ? results[0][m].name : "", pixels};
      for (const auto& of_duration : results) {
        const DepthErrors& e = of_duration[m].*errors;
        row.push_back(formatNumber(meanCm(e), 1) + " / " + formatNumber(medianCm(e), 1) + " / " +
                      formatNumber(badPercent(e), 1));
      }
      table.rows.push_back(row);
    }
  }
  section.table(table);
}

void judge(const std::string& where, const std::vector<double>& durations_s,
           const std::vector<std::vector<MethodResult>>& results, StudySection& section) {
  constexpr double kLittleS = 0.2;
  const auto series = [&](const char* method, DepthErrors MethodResult::*pixels) {
    std::vector<double> values;
    for (std::size_t d = 0; d < durations_s.size(); ++d) {
      if (durations_s[d] > kLittleS) continue;
      values.push_back(meanCm(resultOf(results[d], method).*pixels));
    }
    return values;
  };
  std::vector<double> little_s;
  for (const double duration_s : durations_s) {
    if (duration_s <= kLittleS) little_s.push_back(duration_s);
  }
  const auto check = [&](const std::string& claim, const char* better, const char* worse,
                         DepthErrors MethodResult::*pixels, const std::string& departure = "") {
    const std::vector<double> a = series(better, pixels);
    const std::vector<double> b = series(worse, pixels);
    bool holds = true;
    for (std::size_t i = 0; i < a.size(); ++i) holds = holds && a[i] < b[i];
    section.trend(where + ": " + claim, holds,
                  listed(a) + " against " + listed(b) + " cm at " + listed(little_s, 2) + " s",
                  departure);
  };
  check("two cameras converge faster than one: up to 0.2 s they have the smaller mean error",
        kStereo, kOneCamera, &MethodResult::own);
  check("on common pixels, too", kStereo, kOneCamera, &MethodResult::common);
  check("fusion across time makes one camera converge faster", kOneAcross, kOneCamera,
        &MethodResult::own,
        "It keeps other points. On common pixels it has " +
            listed(series(kOneAcross, &MethodResult::common)) + " against " +
            listed(series(kOneCamera, &MethodResult::common)) + " cm, at equal numbers " +
            listed(series(kOneAcross, &MethodResult::equal)) + " against " +
            listed(series(kOneCamera, &MethodResult::equal)) + ".");
  check("fusion across time makes two cameras converge faster, N_s = 4", kStereoAcross, kStereo,
        &MethodResult::own,
        "In the shortest window a sub-interval of 12.5 ms has too few events. Two sub-intervals "
        "are better.");
  check("and N_s = 2", kStereoHalves, kStereo, &MethodResult::own);
  check("a second camera does more than fusion across time, on common pixels", kStereo, kOneAcross,
        &MethodResult::common);
}

}  // namespace

void studyConvergence(const StudyRun& run, StudySection& section) {
  section.text(
      "The paper (Sec. 3.3.2, Fig. 4; Sec. 4.4.2, Fig. 9) shows projections of the DSI of a plane "
      "with rocks, seen from a linear slider, for growing windows. With two cameras the structure "
      "is visible earlier than with one. With fusion across time it is visible earlier, too.");
  section.text(
      "Here: the preset `slider` (240x180, 0.32 m/s sideways, boards and boxes at 0.5 to 2.4 m) "
      "with a second camera 0.10 m to the right of the first; planes from 0.47 to 2.4 m; windows "
      "around the same view. Each picture has its own scale of colours.");
  const Recording slider = run.recordings->make("stereo_slider", stereoSlider(run));
  showProjections(run, slider, section);

  std::vector<double> durations_s = {0.05, 0.1, 0.2, 0.5, 1};
  if (run.quick) durations_s = {0.03, 0.05, 0.1};
  section.text(
      "Mean error [cm] / median error [cm] / bad-pix [%] by the length of the window, on the "
      "slider:");
  const auto on_slider = errorsOver(slider, durations_s, methodsOver(0.47, 2.4), run.pick(8, 1));
  addTable(durations_s, on_slider, section);
  section.text("And in MVSEC's room (study 1):");
  const auto in_room =
      errorsOver(roomRecording(run), durations_s, methodsOver(1, 6.5), run.pick(10, 1));
  addTable(durations_s, in_room, section);
  cv::Mat3b both;
  cv::hconcat(curvesOf("Slider", durations_s, on_slider), curvesOf("Room", durations_s, in_room),
              both);
  section.picture("convergence.png", both, "Mean error by the length of the window");
  judge("slider", durations_s, on_slider, section);
  judge("room", durations_s, in_room, section);
}

}  // namespace efm::studies
