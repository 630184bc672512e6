// SPDX-License-Identifier: BSD-3-Clause
// The real slider (Mueggler et al., IJRR 2017): depth from its events compared with depth from its
// frames.
#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "plugin/results/pictures/depth_picture.h"
#include "test/studies/figures/picture_grid.h"
#include "test/studies/frames/rendered_frames.h"
#include "test/studies/frames/slider_keyframe.h"
#include "test/studies/frames/slider_truth.h"
#include "test/studies/methods/depth_curve.h"
#include "test/studies/methods/method_comparison.h"
#include "test/studies/methods/outstanding_points.h"
#include "test/studies/recordings/real_rigs.h"
#include "test/studies/studies.h"
#include "tracking_stub/presets/presets.h"
#include "tracking_stub/rendering/frame_renderer.h"

namespace efm::studies {
namespace {

constexpr int kPoints = 2500;
std::string percent(double share) { return formatNumber(100 * share, 1); }

KeyframeMapperOptions options() {
  KeyframeMapperOptions paper = paperOptions(0.47, 2.4);
  paper.extraction.max_confidence.level = WhiteLevel::kKeyframe;
  return paper;
}

/// One camera.
std::vector<Method> methods() {
  std::vector<Method> methods = betterDepthMethods({"EMVS (the paper)", options(), {0}});
  Method slices = methods[1];
  slices.name = "H_t of 4 slices, between planes";
  slices.options.subintervals = {4, SubintervalSplit::kCount, SubintervalShuffle::kNone, 1};
  slices.options.sweep.fusion.across_time = FusionRule::kHarmonic;
  methods.insert(methods.begin() + 2, slices);
  return methods;
}

/// A method's map with its own threshold, and with the same number of points for all methods.
struct SliderResult {
  std::string name;
  DepthMap own;
  cv::Mat1f equal_m;
};

/// From strict to loose.
std::vector<double> thresholdsOf(ExtractionMethod method) {
  std::vector<double> thresholds;
  if (method == ExtractionMethod::kPaper) {
    for (int c = 20; c >= 0; --c) thresholds.push_back(c);
  } else {
    for (double wrong = 0.001; wrong < 0.99; wrong *= 1.06) thresholds.push_back(1 - wrong);
  }
  return thresholds;
}

/// The map for `points` uses the strictest threshold with enough points, and of these the points
/// with the highest local contrast.
SliderResult mapSlider(const SliderRecording& recording, Method method, int points) {
  SliderResult result;
  result.name = method.name;
  result.own = sliderKeyframe(recording, method.options).map;
  DepthMap enough;
  const DepthExtractionOptions own = method.options.extraction;
  for (const double threshold : thresholdsOf(own.extraction)) {
    method.options.extraction = withThreshold(own, threshold);
    enough = sliderKeyframe(recording, method.options).map;
    if (cv::countNonZero(enough.depth > 0) >= points) break;
  }
  result.equal_m = only(enough.depth, mostOutstanding(enough, enough.depth > 0, points));
  return result;
}

std::vector<std::string> scoreRow(const std::string& name, const char* pixels,
                                  const cv::Mat1f& depth_m, const SliderTruth& truth) {
  const SliderScore score = scoreOnSlider(depth_m, truth);
  return {name,
          pixels,
          std::to_string(score.points),
          std::to_string(score.with_truth),
          formatNumber(100 * score.median_error, 2),
          percent(score.beyond_10),
          percent(score.vertical_beyond_10),
          percent(score.horizontal_beyond_10),
          percent(score.on_horizontal),
          percent(score.vertical_covered)};
}

void scoreTable(const std::vector<SliderResult>& results, const SliderTruth& truth,
                StudySection& section) {
  cv::Mat1b common(truth.frames.depth.size(), 255);
  for (const SliderResult& result : results) common &= result.equal_m > 0;
  TextTable table;
  table.head = {"method",
                "pixels",
                "points",
                "with truth",
                "median [%]",
                "beyond 10 % [%]",
                "vertical [%]",
                "horizontal [%]",
                "on horizontal edges [%]",
                "vertical edges covered [%]"};
  for (const SliderResult& result : results) {
    table.rows.push_back(scoreRow(result.name, "own", result.own.depth, truth));
    table.rows.push_back(scoreRow("", "equal", result.equal_m, truth));
    table.rows.push_back(scoreRow("", "common", only(result.equal_m, common), truth));
  }
  section.table(table);
}

/// The plane sweep over frames of the simulated slider, whose depth is known.
void frameTruthOnItsOwn(const FrameDepthOptions& options, StudySection& section) {
  const Simulation simulation = makeSimulation({"slider", {}, 3});
  const CameraModel& camera = simulation.rig.cameras[0].model;
  constexpr std::int64_t kPeriodNs = 38'765'000;
  std::vector<StampedPose> poses;
  for (std::int64_t t = simulation.start_ns; t <= simulation.endNs(); t += kPeriodNs) {
    poses.push_back({t, simulation.motion->poseAt(t)});
  }
  const PosedFrames frames = renderedFrames(simulation.scene, camera, poses, {45, 1.2, 7});
  const std::int64_t t_ref_ns = simulation.start_ns + 97'000'000;
  const Rigid3 T_world_ref = simulation.motion->poseAt(t_ref_ns);
  const FrameDepth depth =
      frameDepth(frames, frames.nearestTo(t_ref_ns), frames.view, T_world_ref, options);
  SliderTruth exact;
  exact.frames = depth;
  exact.frames.depth = renderDepth(simulation.scene, T_world_ref, frames.view);
  exact.edges = edgeKinds(depth.grey);
  const SliderScore all = scoreOnSlider(depth.depth, exact);
  const SliderScore lines = scoreOnSlider(only(depth.depth, exact.edges.vertical_lines), exact);
  section.text(
      "Accuracy of the depth from frames: the same sweep over frames of the simulated slider (as "
      "many per metre, noise of 1.2 grey values), compared with its exact depth within a pixel. " +
      std::to_string(all.points) + " pixels have a depth: median error " +
      formatNumber(100 * all.median_error, 2) + " %, " + percent(all.beyond_10) +
      " % of them beyond 10 % (the outlines of objects in front, which are up to two pixels too "
      "wide); on the lines of vertical edges " +
      formatNumber(100 * lines.median_error, 2) + " % and " + percent(lines.beyond_10) + " %.");
}

cv::Mat3b edgePicture(const SliderTruth& truth) {
  cv::Mat3b picture;
  cv::cvtColor(cv::Mat1b(2 * truth.frames.grey), picture, cv::COLOR_GRAY2BGR);
  picture.setTo(cv::Scalar(0, 0, 255), truth.edges.vertical_lines);
  picture.setTo(cv::Scalar(0, 255, 0), truth.edges.horizontal_lines);
  return picture;
}

/// Green: within 3 %; red: beyond 10 %, yellow between; grey: no truth.
cv::Mat3b errorPicture(const cv::Mat1f& depth_m, const cv::Mat1f& truth_m) {
  cv::Mat3b picture(depth_m.size(), cv::Vec3b(255, 255, 255));
  const DepthPairingOptions pairing = studyPairing();
  const ComparedDepths depths{depth_m, truth_m, {}};
  for (int y = 0; y < depth_m.rows; ++y) {
    for (int x = 0; x < depth_m.cols; ++x) {
      if (!(depth_m(y, x) > 0)) continue;
      const double true_m = bestTruth(depths, {x, y}, pairing);
      if (true_m <= 0) {
        picture(y, x) = {205, 205, 205};
        continue;
      }
      const double error = std::abs(depth_m(y, x) / true_m - 1);
      picture(y, x) = error <= 0.03  ? cv::Vec3b(60, 160, 0)
                      : error <= 0.1 ? cv::Vec3b(0, 190, 230)
                                     : cv::Vec3b(0, 0, 220);
    }
  }
  return picture;
}

void judgeSlider(const std::vector<SliderResult>& results, const SliderTruth& truth,
                 StudySection& section) {
  const SliderScore paper = scoreOnSlider(results.front().equal_m, truth);
  const SliderScore ours = scoreOnSlider(results.back().equal_m, truth);
  const auto ratio = [](double value, double to) { return to > 0 ? value / to : 0; };
  const double beyond = ratio(ours.beyond_10, paper.beyond_10);
  const double median = ratio(ours.median_error, paper.median_error);
  const double horizontal = ratio(ours.on_horizontal, paper.on_horizontal);
  section.trend(
      "At the same number of points the default leaves at most 0.2 of the paper's points "
      "beyond 10 %",
      beyond <= 0.2, formatNumber(beyond, 2));
  section.trend("and at most 0.4 of its median error", median <= 0.4, formatNumber(median, 2));
  section.trend("The fraction of points on horizontal edges is at most 0.45 of the paper's",
                horizontal <= 0.45, formatNumber(horizontal, 2));
  section.trend("The fraction of covered vertical edges does not fall",
                ours.vertical_covered >= paper.vertical_covered,
                percent(paper.vertical_covered) + " to " + percent(ours.vertical_covered) + " %",
                "Probable depths have many neighbours that agree: short and faint edges have few.");
}

double shareWithTruth(const cv::Mat1b& lines, const cv::Mat1f& truth_m) {
  return static_cast<double>(cv::countNonZero(lines & (truth_m > 0))) /
         std::max(1, cv::countNonZero(lines));
}

}  // namespace

void studySlider(const StudyRun& run, StudySection& section) {
  const std::filesystem::path folder = run.data / "slider_depth";
  if (!exists(folder)) throw MissingData("no such folder: " + folder.string());
  FrameDepthOptions frame_options;
  if (run.quick) {
    frame_options.planes.num_planes = 24;
    frame_options.max_frames = 4;
  }
  const SliderRecording recording = readSlider(folder);
  std::vector<SliderResult> results;
  for (const Method& method : methods()) {
    results.push_back(mapSlider(recording, method, kPoints));
  }
  const KeyframeDepthMap keyframe = sliderKeyframe(recording, methods().front().options);
  const SliderTruth truth = sliderTruth(folder, keyframe.view, keyframe.T_world_ref,
                                        keyframe.window.t_ref_ns, frame_options);

  section.text(
      "`slider_depth` of the Event Camera Dataset (Mueggler et al., IJRR 2017), a real recording: "
      "a DAVIS240C on a linear slider; a window of 0.15 s from the first pose, " +
      std::to_string(recording.events.size()) +
      " events, 4.7 cm of travel; planes from 0.47 to 2.4 m, confidence normalised by the map's "
      "max. The recording has no true depth. So the truth is computed from its frames, with "
      "baselines of up to 0.3 m: a plane sweep with the true poses (" +
      std::to_string(frame_options.planes.num_planes) + " planes, " +
      std::to_string(frame_options.max_frames) +
      " frames; correlation in Gaussian windows of 1.5, then 3.5 pixels; the better half of the "
      "frames; a peak of at least " +
      formatNumber(frame_options.min_score, 2) + " that is higher by " +
      formatNumber(frame_options.min_margin, 2) +
      " than at every depth more than 5 % away, and the same from a second view). The truth has "
      "pixels on edges, and pixels between two points of one depth that are at most " +
      std::to_string(frame_options.max_gap_px) + " pixels apart.");
  section.text(
      "An edge is horizontal if the gradient of the grey values is within 15° of vertical. It is "
      "vertical if the gradient is within 30° of horizontal. A point belongs to the strongest edge "
      "within a pixel. " +
      percent(shareWithTruth(truth.edges.vertical_lines, truth.frames.depth)) + " % of the " +
      std::to_string(cv::countNonZero(truth.edges.vertical_lines)) +
      " pixels on the lines of vertical edges have a depth, and " +
      percent(shareWithTruth(truth.edges.horizontal_lines, truth.frames.depth)) + " % of the " +
      std::to_string(cv::countNonZero(truth.edges.horizontal_lines)) +
      " on those of horizontal edges: the slider moves along these, and only the texture next to "
      "them has a depth.");
  frameTruthOnItsOwn(frame_options, section);
  section.text(
      "Errors are relative to the depth, with the best truth within a pixel. Points without a "
      "truth are excluded. *equal*: " +
      std::to_string(kPoints) +
      " points with the highest local contrast, from the strictest threshold with enough points. "
      "*common*: the pixels of these that all methods have.");
  scoreTable(results, truth, section);
  judgeSlider(results, truth, section);

  const DepthPlanesOptions limits = options().planes;
  PictureGrid above;
  above.width_px = 480;
  above.columns = {"frame and edges", "depth of the frames"};
  above.rows = {"frames"};
  above.pictures = {{edgePicture(truth), depthPicture(truth.frames.depth, limits)}};
  PictureGrid below;
  below.width_px = 480;
  below.columns = {"map", "its errors"};
  below.rows = {"the paper", "default"};
  for (const SliderResult* result : {&results.front(), &results.back()}) {
    below.pictures.push_back(
        {depthPicture(result->equal_m, limits), errorPicture(result->equal_m, truth.frames.depth)});
  }
  cv::Mat3b picture;
  cv::vconcat(drawGrid(above), drawGrid(below), picture);
  section.picture("slider.png", picture,
                  "The frame with vertical (red) and horizontal (green) edges; depth from the "
                  "frames, red 0.47 m to blue 2.4 m; 2,500 points of the paper's extraction and of "
                  "the default; their errors: green within 3 %, yellow within 10 %, red beyond, "
                  "grey without truth");
}

}  // namespace efm::studies
