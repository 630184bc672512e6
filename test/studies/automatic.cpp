// SPDX-License-Identifier: BSD-3-Clause
// Options chosen from the data, against options set by hand.
#include <algorithm>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "mapping/geometry/timestamp.h"
#include "mapping/survey/option_choice.h"
#include "plugin/options/option_keys.h"
#include "test/studies/frames/slider_keyframe.h"
#include "test/studies/frames/slider_truth.h"
#include "test/studies/methods/depth_curve.h"
#include "test/studies/methods/method_comparison.h"
#include "test/studies/recordings/real_rigs.h"
#include "test/studies/studies.h"
#include "tracking_stub/presets/presets.h"

namespace efm::studies {
namespace {

/// What is compared: the options of a map that depend on the recording.
struct Choice {
  DepthPlanesOptions planes;
  double window_s = 0;
};

struct Case {
  std::string name;
  Choice by_hand;
  std::vector<int> cameras = {0, 1};
};

/// The result of a case: with the options set by hand, and with those of the choice.
struct Comparison {
  std::string name;
  Choice by_hand;
  Choice chosen;
  DepthCurve hand_curve;
  DepthCurve chosen_curve;
  double hand_points = 0;    // with the default threshold
  double chosen_points = 0;  // the same

  /// The smaller number of points, which both have.
  double points() const { return std::min(hand_points, chosen_points); }
};

constexpr double kShippedProbability = 0.9;

Choice chosenFrom(const Rig& rig, const std::vector<WindowSample>& samples, double duration_s,
                  const std::vector<int>& cameras) {
  FusionMapperOptions options;
  options.cameras = cameras;
  chooseOptions({true, true, true, true, true}, rig, samples, duration_s, options);
  return {options.keyframe.planes, options.policy.window_s};
}

/// The windows of a first pass over a recording, as `event-fusion map` makes it.
std::vector<WindowSample> samplesOf(const Recording& recording) {
  constexpr double kWindowS = 2;
  FusionMapper survey(surveyOptions({}, kWindowS));
  for (const RigCamera& camera : recording.simulation.rig.cameras) survey.addCamera(camera);
  for (const StampedPose& pose : recording.trajectory.poses()) survey.addPose(pose);
  for (std::size_t c = 0; c < recording.events.size(); ++c) {
    survey.addEvents(static_cast<int>(c), recording.events[c]);
  }
  survey.finish();
  SpreadSamples samples;
  while (const auto data = survey.window()) {
    samples.add(*data);
    survey.skipWindow(data->window);
  }
  return samples.samples();
}

Comparison compareOn(const Recording& recording, const Case& what, int windows) {
  Comparison result{what.name, what.by_hand, {}, {}, {}, 0, 0};
  const Simulation& simulation = recording.simulation;
  result.chosen = chosenFrom(simulation.rig, samplesOf(recording),
                             1e-9 * static_cast<double>(simulation.duration_ns), what.cameras);
  const auto measure = [&](const Choice& choice, DepthCurve& curve, double& points) {
    Method method{what.name, {}, what.cameras};
    method.options.planes = choice.planes;
    const std::vector<Window> at = recording.windows(choice.window_s, windows);
    DepthJudge judge(recording, choice.planes);
    curve = depthCurve(recording, at, method, judge);
    points = qualityOf(recording, at, method, judge).points;
  };
  measure(result.by_hand, result.hand_curve, result.hand_points);
  measure(result.chosen, result.chosen_curve, result.chosen_points);
  return result;
}

Comparison compareOnPreset(const StudyRun& run, const Case& what) {
  SimulationOptions options;
  options.preset = what.name;
  if (run.quick) options.duration_s = 0.3;
  return compareOn(run.recordings->make("automatic_" + what.name, makeSimulation(options)), what,
                   run.pick(4, 1));
}

/// The real slider: its truth is from its frames.
Comparison compareOnSlider(const StudyRun& run, const Case& what) {
  const std::filesystem::path folder = run.data / "slider_depth";
  if (!exists(folder)) throw MissingData("no such folder: " + folder.string());
  const SliderRecording recording = readSlider(folder);
  Comparison result{what.name, what.by_hand, {}, {}, {}, 0, 0};
  const WindowSample sample =
      sampleOf({recording.window, {recording.events}, &recording.trajectory});
  const double duration_s = secondsBetween(recording.window.t0_ns, recording.window.t1_ns);
  result.chosen = chosenFrom(recording.rig, {sample}, duration_s, what.cameras);

  FrameDepthOptions frames;
  if (run.quick) {
    frames.planes.num_planes = 24;
    frames.max_frames = 4;
  }
  KeyframeMapperOptions options;
  const KeyframeDepthMap any = sliderKeyframe(recording, options);
  const SliderTruth truth =
      sliderTruth(folder, any.view, any.T_world_ref, any.window.t_ref_ns, frames);
  const auto measure = [&](const Choice& choice, DepthCurve& curve, double& points) {
    options.planes = choice.planes;
    for (const double probability : {0.995, 0.98, 0.95, kShippedProbability, 0.7, 0.4}) {
      options.extraction = withThreshold(options.extraction, probability);
      const SliderScore score = scoreOnSlider(sliderKeyframe(recording, options).map.depth, truth);
      PointQuality& step = curve.steps.emplace_back();
      step.points = static_cast<double>(score.with_truth);
      step.beyond_10 = score.beyond_10;
      step.median = score.median_error;
      if (probability == kShippedProbability) points = step.points;
    }
  };
  measure(result.by_hand, result.hand_curve, result.hand_points);
  measure(result.chosen, result.chosen_curve, result.chosen_points);
  return result;
}

std::string percent(double fraction, int decimals) {
  return formatNumber(100 * fraction, decimals);
}

std::string textOf(const Choice& choice) {
  return formatNumber(choice.planes.min_depth_m, 2) + " to " +
         formatNumber(choice.planes.max_depth_m, 1) + " m, " +
         std::to_string(choice.planes.num_planes) + ", " + formatNumber(choice.window_s, 2) + " s";
}

double ratioAt(const Comparison& result, double PointQuality::*figure) {
  const double by_hand = result.hand_curve.at(result.points()).*figure;
  return by_hand > 0 ? result.chosen_curve.at(result.points()).*figure / by_hand : 1;
}

TextTable tableOf(const std::vector<Comparison>& results) {
  TextTable table;
  table.head = {"recording",       "options: limits, planes, window",
                "points",          "equal points",
                "beyond 10 % [%]", "of by hand",
                "median [%]",      "of by hand"};
  for (const Comparison& result : results) {
    const PointQuality hand = result.hand_curve.at(result.points());
    const PointQuality chosen = result.chosen_curve.at(result.points());
    table.rows.push_back({result.name, "by hand: " + textOf(result.by_hand),
                          formatNumber(result.hand_points, 0), formatNumber(result.points(), 0),
                          percent(hand.beyond_10, 2), "", percent(hand.median, 3), ""});
    table.rows.push_back(
        {"", "auto: " + textOf(result.chosen), formatNumber(result.chosen_points, 0), "",
         percent(chosen.beyond_10, 2), formatNumber(ratioAt(result, &PointQuality::beyond_10), 2),
         percent(chosen.median, 3), formatNumber(ratioAt(result, &PointQuality::median), 2)});
  }
  return table;
}

double worst(const std::vector<Comparison>& results, double PointQuality::*figure) {
  double most = 0;
  for (const Comparison& result : results) most = std::max(most, ratioAt(result, figure));
  return most;
}

}  // namespace

void studyAutomatic(const StudyRun& run, StudySection& section) {
  std::vector<Comparison> results;
  results.push_back(compareOnSlider(run, {"slider_depth (real)", {{0.47, 2.4, 100}, 0.15}, {0}}));
  std::vector<Case> presets = {{"desk_stereo", {{0.5, 5, 100}, 0.5}},
                               {"room_stereo", {{0.9, 7, 100}, 0.5}},
                               {"drive_stereo", {{4, 50, 100}, 0.5}},
                               {"hd_stereo", {{0.5, 5, 250}, 0.5}},
                               {"trinocular", {{0.5, 5, 100}, 0.5}, {0, 1, 2}}};
  if (run.quick) presets.resize(1);
  for (const Case& preset : presets) results.push_back(compareOnPreset(run, preset));
  if (!run.quick) {
    results.push_back(compareOn(run.recordings->make("automatic_mvsec", mvsecInRoom(run, 5)),
                                {"MVSEC's rig on flying1", {{1, 6.5, 100}, 1}}, 4));
  }
  section.text(
      "Without an option file, `event-fusion map` chooses depth limits, number of planes and "
      "window "
      "from a first look at the recording. Here they are compared with those that we set by hand "
      "for these recordings: the limits of section 12, windows of half a second, 250 planes for "
      "1280 pixels; the .ini files of the slider and of MVSEC. Four windows each. *points*: with "
      "the default thresholds. *equal points*: the smaller of both numbers, each on its own curve "
      "over the thresholds. A point is wrong if its depth error is over 10 %, with the best truth "
      "within a pixel; the slider's truth is from its frames (section 11).");
  section.table(tableOf(results));
  constexpr double kMaxRatio = 1.15;
  const double wrong = worst(results, &PointQuality::beyond_10);
  const double median = worst(results, &PointQuality::median);
  section.trend("Wrong points are at most 1.15 times those by hand", wrong <= kMaxRatio,
                "worst case " + formatNumber(wrong, 2), "see the table");
  section.trend("and so is the median error", median <= kMaxRatio,
                "worst case " + formatNumber(median, 2), "see the table");
}

}  // namespace efm::studies
