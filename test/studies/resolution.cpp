// SPDX-License-Identifier: BSD-3-Clause
// Ghosh and Gallego 2022, Sec. 4.7: the same scene with sensors of different resolutions.
#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "plugin/results/pictures/curve_plot.h"
#include "plugin/results/pictures/depth_picture.h"
#include "test/studies/figures/picture_grid.h"
#include "test/studies/frames/edge_kinds.h"
#include "test/studies/frames/rendered_frames.h"
#include "test/studies/methods/error_figures.h"
#include "test/studies/methods/error_table.h"
#include "test/studies/methods/method_comparison.h"
#include "test/studies/methods/outstanding_points.h"
#include "test/studies/methods/precision_curves.h"
#include "test/studies/recordings/flying_room.h"
#include "test/studies/recordings/real_rigs.h"
#include "test/studies/studies.h"
#include "tracking_stub/rendering/frame_renderer.h"

namespace efm::studies {
namespace {

/// One resolution.
struct Sensor {
  std::string name;
  Recording recording;
  std::vector<Window> windows;
};

/// One method at all resolutions.
struct ByResolution {
  std::string method;
  std::vector<MethodResult> results;
};

ByResolution mapAll(const std::vector<Sensor>& sensors, const Method& method) {
  ByResolution all{method.name, {}};
  std::vector<const Recording*> recordings;
  for (const Sensor& sensor : sensors) {
    all.results.push_back(mapMethod(sensor.recording, sensor.windows, method, sensor.name));
    recordings.push_back(&sensor.recording);
  }
  scoreMethods(recordings, all.results);
  return all;
}

/// The kind of edge at each pixel of a keyframe.
cv::Mat1b edgeKindsSeen(const Recording& recording, const KeyframeDepthMap& keyframe) {
  const Simulation& simulation = recording.simulation;
  const StampedPose pose{0, simulation.motion->poseAt(keyframe.window.t_ref_ns)};
  const PosedFrames frame =
      renderedFrames(simulation.scene, simulation.rig.cameras[0].model, {pose}, {60, 0, 1});
  const EdgeKinds edges = edgeKinds(frame.frames[0].image);
  cv::Mat1b kinds(keyframe.map.depth.size());
  for (int y = 0; y < kinds.rows; ++y) {
    for (int x = 0; x < kinds.cols; ++x) kinds(y, x) = static_cast<uchar>(edges.kindNear(x, y));
  }
  return kinds;
}

/// Pixels whose points the second camera sees, within a pixel, at the reference time.
cv::Mat1b seenBySecond(const Recording& recording, const KeyframeDepthMap& keyframe) {
  const Simulation& simulation = recording.simulation;
  const RigCamera& second = simulation.rig.cameras.at(1);
  const ReferenceView view = ReferenceView::of(second.model);
  const Rigid3 T_world_rig = simulation.motion->poseAt(keyframe.window.t_ref_ns);
  const cv::Mat1f there = renderDepth(simulation.scene, T_world_rig * second.T_rig_cam, view);
  const cv::Mat1f here = truthOf(recording, keyframe);
  const Rigid3 T_second_ref = second.T_rig_cam.inverse() * simulation.rig.cameras[0].T_rig_cam;
  cv::Mat1b seen(here.size(), 0);
  for (int y = 0; y < here.rows; ++y) {
    for (int x = 0; x < here.cols; ++x) {
      // An edge is on the front surface.
      double depth_m = here(y, x);
      for (const int neighbour : {std::max(0, x - 1), std::min(here.cols - 1, x + 1)}) {
        depth_m = std::min(depth_m, static_cast<double>(here(y, neighbour)));
      }
      const Eigen::Vector3d p_second = T_second_ref * keyframe.view.pointAt(x, y, depth_m);
      const Eigen::Vector2d pixel = view.project(p_second);
      const int column = static_cast<int>(std::lround(pixel.x()));
      const int row = static_cast<int>(std::lround(pixel.y()));
      for (int neighbour = column - 1; neighbour <= column + 1; ++neighbour) {
        if (neighbour < 0 || neighbour >= there.cols || row < 0 || row >= there.rows) continue;
        const double ratio = static_cast<double>(there(row, neighbour)) / p_second.z();
        if (std::abs(ratio - 1) < 0.02) seen(y, x) = 255;
      }
    }
  }
  return seen;
}

std::vector<std::string> comparedRow(const std::string& name, const DepthErrors& one,
                                     const DepthErrors& two) {
  return {name,
          formatNumber(thousandPoints(one), 1),
          formatNumber(meanCm(one), 2),
          formatNumber(100 * one.beyond_tenth, 2),
          formatNumber(meanCm(two), 2),
          formatNumber(100 * two.beyond_tenth, 2),
          formatNumber(meanCm(two) / meanCm(one), 2),
          formatNumber(medianCm(two) / medianCm(one), 2)};
}

/// One camera and two on common pixels, by kind of edge.
void byEdges(const Sensor& sensor, StudySection& section) {
  const Recording& recording = sensor.recording;
  const auto one = mapWindows(recording, sensor.windows, flyingRoomMono());
  const auto two = mapWindows(recording, sensor.windows, flyingRoomStereo());
  TextTable table;
  table.head = {"points on",      "thousand",
                "one: mean [cm]", "one: beyond 10 % [%]",
                "two: mean [cm]", "two: beyond 10 % [%]",
                "mean, times",    "median, times"};
  const auto row = [&](const std::string& name, const auto& chosenIn) {
    std::vector<DepthPair> pairs_one;
    std::vector<DepthPair> pairs_two;
    for (std::size_t w = 0; w < one.size(); ++w) {
      const cv::Mat1b chosen = (one[w].map.depth > 0) & (two[w].map.depth > 0) & chosenIn(one[w]);
      const cv::Mat1f truth = truthOf(recording, one[w]);
      appendPairs(only(one[w].map.depth, chosen), truth, pairs_one);
      appendPairs(only(two[w].map.depth, chosen), truth, pairs_two);
    }
    table.rows.push_back(comparedRow(name, depthErrors(pairs_one), depthErrors(pairs_two)));
  };
  const std::vector<std::pair<EdgeKind, std::string>> kinds = {
      {EdgeKind::kVertical, "vertical edges"},
      {EdgeKind::kOblique, "oblique edges"},
      {EdgeKind::kHorizontal, "horizontal edges"}};
  for (const auto& [kind, name] : kinds) {
    for (const bool both : {true, false}) {
      row(name + (both ? ", seen by both" : ", hidden from the second"),
          [&, kind = kind](const KeyframeDepthMap& keyframe) -> cv::Mat1b {
            const cv::Mat1b seen = seenBySecond(recording, keyframe);
            return (edgeKindsSeen(recording, keyframe) == static_cast<int>(kind)) &
                   (both ? seen : cv::Mat1b(~seen));
          });
    }
  }
  section.table(table);
}

/// One camera and two on common pixels, by amount of data.
void byWindow(const StudyRun& run, const Sensor& sensor, StudySection& section) {
  TextTable table;
  table.head = {"window",         "points [thousand]",    "one: mean [cm]", "one: beyond 10 % [%]",
                "two: mean [cm]", "two: beyond 10 % [%]", "mean, times",    "median, times"};
  for (const double window_s : run.pick(std::vector{0.05, 0.1, 0.2, 0.4}, std::vector{0.05})) {
    const auto windows = sensor.recording.windows(window_s, window_s < 0.4 ? 2 : 1);
    const auto results =
        compareMethods(sensor.recording, windows, {flyingRoomMono(), flyingRoomStereo()});
    table.rows.push_back(
        comparedRow(formatNumber(window_s, 2) + " s", results[0].common, results[1].common));
  }
  section.table(table);
}

void judge(const ByResolution& mono, const ByResolution& stereo,
           const std::vector<NamedPrecision>& precision, StudySection& section) {
  const auto own = &MethodResult::own;
  const auto common = &MethodResult::common;
  for (const ByResolution* one : {&mono, &stereo}) {
    const auto means = eachOf(one->results, own, meanCm);
    const auto medians = eachOf(one->results, own, medianCm);
    section.trend("the mean error falls with resolution, " + one->method, falls(means),
                  listed(means) + " cm; in common cells " +
                      listed(eachOf(one->results, common, meanCm)) + " cm");
    section.trend("so does the median error, " + one->method, falls(medians),
                  listed(medians, 2) + " cm; in common cells " +
                      listed(eachOf(one->results, common, medianCm), 2) + " cm");
  }
  std::vector<double> ratios;
  std::vector<double> median_ratios;
  for (std::size_t r = 0; r < stereo.results.size(); ++r) {
    median_ratios.push_back(medianCm(stereo.results[r].own) / medianCm(mono.results[r].own));
    ratios.push_back(meanCm(stereo.results[r].own) / meanCm(mono.results[r].own));
  }
  section.trend("a second camera almost halves the mean error (at most 0.65 of it)",
                maxOf(ratios) <= 0.65, listed(ratios, 2) + " times",
                "The median error does: " + listed(median_ratios, 2) +
                    " times. Few points with large errors dominate the mean; see the tables below. "
                    "The second camera does not help for edges along its baseline. Points that are "
                    "hidden from it have wrong crossings of rays only: they are few, and their "
                    "error is several times that of one camera.");
  const std::vector<double> precise = precisionAt(precision, 0.04);
  const std::vector<double> found = recallAt(precision, 1);
  section.trend("precision grows with resolution (paper: up to 97 % within 4 cm)", grows(precise),
                listed(precise) + " % within 4 cm");
  section.trend(
      "recall falls: a coarse sensor finds a larger fraction of the scene (paper: 6 % against 2 %)",
      falls(found), listed(found) + " % within 1 m");
}

}  // namespace

void studyResolution(const StudyRun& run, StudySection& section) {
  const Simulation room = flyingRoom(run.pick(0.4, 0.05));
  std::vector<Sensor> sensors;
  std::vector<double> widths_px;
  for (const int width_px : run.pick(std::vector{320, 640, 1280}, std::vector{80, 160})) {
    const std::string name = std::to_string(width_px) + "x" + std::to_string(width_px * 3 / 4);
    widths_px.push_back(width_px);
    Sensor sensor{name, run.recordings->make("room_" + name, withWidth(room, width_px)), {}};
    sensor.windows = sensor.recording.windows(run.pick(0.2, 0.05), run.pick(2, 1));
    sensors.push_back(std::move(sensor));
  }
  const ByResolution mono = mapAll(sensors, flyingRoomMono());
  const ByResolution stereo = mapAll(sensors, flyingRoomStereo());

  std::string events;
  for (const Sensor& sensor : sensors) {
    events += (events.empty() ? "" : ", ") +
              formatNumber(1e-6 * sensor.recording.meanEventsIn(sensor.windows), 2);
  }
  section.text(
      "The paper (Sec. 4.7) simulates its scene flying_room with ESIM at three "
      "resolutions with the same field of view, 0.25, 2.25 and 14.3 million events. Here: a "
      "furnished room, two cameras 0.20 m apart, 77° wide, contrast threshold 0.2; " +
      std::to_string(sensors.front().windows.size()) + " windows of 0.2 s with " + events +
      " million events each; planes from 1 to 4 m. Different resolutions have no common pixels. "
      "Here *common* are the points in cells with a point at every resolution; a cell is a pixel "
      "of the coarsest sensor. *equal*: as many points as the coarsest sensor has.");
  for (const ByResolution* one : {&mono, &stereo}) {
    section.text(one->method + ":");
    section.table(errorTable(one->results, {true, false}));
  }
  section.picture(
      "resolution_errors.png",
      errorCurves("Depth error by resolution", {"width [px]", AxisScale::kLinear, 0, {}}, widths_px,
                  mono.results, stereo.results),
      "Mean and median error by resolution");

  std::vector<NamedPrecision> precision;
  for (std::size_t r = 0; r < sensors.size(); ++r) {
    precision.push_back(
        {sensors[r].name,
         precisionOf(sensors[r].recording, stereo.results[r].keyframes, studyPairing())});
  }
  section.text("Precision, recall and F1 of two cameras, compared with every pixel of the truth:");
  section.table(precisionTable(precision, {0.02, 0.04, 0.12}));
  section.picture("resolution_precision.png", drawPrecision(precision),
                  "Precision, recall and F1 over the allowed error, by resolution");

  PictureGrid grid = depthAndConfidenceGrid(400);
  const DepthPlanesOptions limits = flyingRoomStereo().options.planes;
  for (const MethodResult& result : stereo.results) {
    addColumn(result.name, result.keyframes.front().map, limits, grid);
  }
  grid.columns.emplace_back("truth");
  grid.pictures[0].push_back(
      depthPicture(truthOf(sensors[0].recording, stereo.results[0].keyframes[0]), limits));
  grid.pictures[1].emplace_back();
  section.picture("resolution.png", drawGrid(grid),
                  "Two cameras: depth (red 1 m to blue 4 m) and confidence at each resolution");
  judge(mono, stereo, precision, section);
  section.heading("Why a second camera does not halve the mean");
  section.text("One camera and two at " + sensors[1].name +
               ", on common pixels, by direction of the edge and by visibility for the second "
               "camera at the reference time (*times*: two over one):");
  byEdges(sensors[1], section);
  section.text("And by the length of the window:");
  byWindow(run, sensors[1], section);
}

}  // namespace efm::studies
