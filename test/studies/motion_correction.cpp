// SPDX-License-Identifier: BSD-3-Clause
// Motion corrected within the window of a keyframe, with errors of the tracker.
#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>
#include <vector>

#include "mapping/geometry/rigid3.h"
#include "mapping/motion/motion_correction.h"
#include "plugin/results/pictures/curve_plot.h"
#include "test/studies/methods/error_figures.h"
#include "test/studies/methods/method_comparison.h"
#include "test/studies/recordings/recording_errors.h"
#include "test/studies/studies.h"
#include "tracking_stub/faults/tracker_process.h"
#include "tracking_stub/presets/presets.h"
#include "tracking_stub/random/random_numbers.h"

namespace efm::studies {
namespace {

struct Case {
  const char* preset;
  double min_depth_m;
  double max_depth_m;
  double window_s;
  double middle_depth_m;
};

/// An error of the tracker.
struct TrackerError {
  std::string name;
  double velocity = 0;  ///< Error of a constant velocity: cm/s and degrees per second.
  TrackerClass tracker = TrackerClass::kNone;
};

std::vector<TrackerError> trackerErrors(bool quick) {
  std::vector<TrackerError> errors = {{"exact"}};
  for (const double velocity : quick ? std::vector<double>{5} : std::vector<double>{1, 2, 5, 10}) {
    const std::string number = formatNumber(velocity, 0);
    errors.push_back({number + " cm/s, " + number + "°/s", velocity});
  }
  for (const TrackerClass tracker :
       {TrackerClass::kGood, TrackerClass::kTypical, TrackerClass::kPoor, TrackerClass::kCar}) {
    errors.push_back({"real, " + std::string(nameOf(tracker)), 0, tracker});
  }
  return errors;
}

Eigen::Vector3d direction(RandomNumbers& random) {
  for (;;) {
    const Eigen::Vector3d inside(random.uniform(-1, 1), random.uniform(-1, 1),
                                 random.uniform(-1, 1));
    if (inside.norm() > 0.1 && inside.norm() <= 1) return inside.normalized();
  }
}

/// The results of keyframes with one kind of poses.
struct Outcome {
  std::vector<double> errors;  ///< |estimate - truth| / truth of all points.
  double seconds = 0;
  int keyframes = 0;
  int corrected = 0;

  double median() const {
    std::vector<double> sorted = errors;
    std::sort(sorted.begin(), sorted.end());
    return sorted.empty() ? NAN : sorted[sorted.size() / 2];
  }
  double beyond10() const {
    const auto beyond =
        std::count_if(errors.begin(), errors.end(), [](double e) { return e > 0.1; });
    return errors.empty() ? NAN : static_cast<double>(beyond) / static_cast<double>(errors.size());
  }
};

/// The results of all seeds of a case with one kind of error.
struct Outcomes {
  Outcome as_is;
  Outcome corrected;
};

/// Maps a window and adds the result to the outcome.
void mapInto(Outcome& outcome, const Recording& recording, const Window& window,
             const KeyframeMapperOptions& options) {
  KeyframeMapper mapper(recording.simulation.rig, {0, 1}, options);
  const auto began = std::chrono::steady_clock::now();
  const KeyframeDepthMap keyframe =
      mapper.map(window, recording.eventsOf(window), recording.trajectory).value();
  outcome.seconds +=
      std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  ++outcome.keyframes;
  outcome.corrected += keyframe.motion_correction ? 1 : 0;
  const auto pairs = pairDepths({keyframe.map.depth, truthOf(recording, keyframe)}, studyPairing());
  for (const DepthPair& pair : pairs) {
    outcome.errors.push_back(std::abs(pair.estimate_m - pair.truth_m) / pair.truth_m);
  }
}

void mapWindows(Outcomes& outcomes, const Recording& recording, const TrackerError& error,
                double middle_depth_m, const std::vector<Window>& windows,
                const KeyframeMapperOptions& options) {
  KeyframeMapperOptions correcting = options;
  correcting.motion.correct_motion = MotionCorrectionUse::kAlways;
  Recording wrong = recording;
  if (error.tracker != TrackerClass::kNone) {
    const TrackerProcessOptions process{error.tracker, middle_depth_m,
                                        recording.simulation.rig.cameras.front().T_rig_cam};
    wrong.trajectory = Trajectory();
    for (const StampedPose& pose :
         withTrackerProcess(recording.trajectory.poses(), process,
                            TrajectoryOptions{}.max_pose_gap_s, 1, recording.simulation.seed)) {
      wrong.trajectory.add(pose);
    }
  }
  RandomNumbers random(recording.simulation.seed);
  for (const Window& window : windows) {
    if (error.velocity > 0) {
      Vector6d per_s;
      per_s << 0.01 * direction(random), kRadiansPerDegree * direction(random);
      MotionCorrection steady = knotsOf(window, 0.01);
      for (std::size_t i = 0; i < steady.knots.size(); ++i) {
        steady.knots[i] = error.velocity * steady.sinceReference(i) * per_s;
      }
      wrong.trajectory = correctedTrajectory(recording.trajectory, window, steady);
    }
    mapInto(outcomes.as_is, wrong, window, options);
    mapInto(outcomes.corrected, wrong, window, correcting);
  }
}

std::vector<Outcomes> outcomesOf(const StudyRun& run, const Case& what,
                                 const std::vector<TrackerError>& errors) {
  std::vector<Outcomes> all(errors.size());
  KeyframeMapperOptions options;
  options.planes = {what.min_depth_m, what.max_depth_m, 100, PlaneSpacing::kInverse};
  for (std::uint64_t seed = 1; seed <= run.pick<std::uint64_t>(3, 1); ++seed) {
    SimulationOptions simulation;
    simulation.preset = what.preset;
    simulation.seed = seed;
    simulation.duration_s = run.pick(3 * what.window_s, 0.1);
    const Recording recording =
        run.recordings->make("motion_" + std::string(what.preset) + "_" + std::to_string(seed),
                             makeSimulation(simulation));
    const auto windows = recording.windows(run.pick(what.window_s, 0.1), run.pick(3, 1));
    for (std::size_t i = 0; i < errors.size(); ++i) {
      mapWindows(all[i], recording, errors[i], what.middle_depth_m, windows, options);
    }
  }
  return all;
}

void addRows(TextTable& table, const Case& what, const std::vector<TrackerError>& errors,
             const std::vector<Outcomes>& all) {
  for (std::size_t i = 0; i < errors.size(); ++i) {
    for (const bool corrected : {false, true}) {
      const Outcome& outcome = corrected ? all[i].corrected : all[i].as_is;
      const double keyframes = outcome.keyframes;
      table.rows.push_back(
          {i == 0 && !corrected ? what.preset : "", corrected ? "" : errors[i].name,
           corrected ? "corrected" : "as they are",
           std::to_string(outcome.corrected) + " of " + std::to_string(outcome.keyframes),
           std::to_string(outcome.errors.size()), formatNumber(100 * outcome.median(), 2),
           formatNumber(100 * outcome.beyond10(), 2),
           formatNumber(outcome.seconds / keyframes, 2)});
    }
  }
}

cv::Mat3b draw(const Case& what, const std::vector<TrackerError>& errors,
               const std::vector<Outcomes>& all) {
  CurvePlot plot;
  plot.title = what.preset;
  plot.size = {560, 420};
  plot.x = {"velocity error [cm/s and degrees/s]", AxisScale::kLinear, 0, {}};
  plot.y = {"median error [%]", AxisScale::kLinear, 0, {}};
  std::vector<double> velocities, as_is, corrected;
  for (std::size_t i = 0; i < errors.size(); ++i) {
    if (errors[i].tracker != TrackerClass::kNone) continue;
    velocities.push_back(errors[i].velocity);
    as_is.push_back(100 * all[i].as_is.median());
    corrected.push_back(100 * all[i].corrected.median());
  }
  plot.curves = {markedCurve("poses as they are", velocities, as_is),
                 markedCurve("corrected", velocities, corrected)};
  return drawCurves(plot);
}

void judge(const Case& what, const std::vector<TrackerError>& errors,
           const std::vector<Outcomes>& all, StudySection& section) {
  const double exact = all.front().as_is.median();
  const std::string where = std::string(what.preset) + ": ";
  section.trend(where + "exact poses do not become worse",
                all.front().corrected.median() <= exact && all.front().corrected.corrected == 0,
                std::to_string(all.front().corrected.corrected) + " of " +
                    std::to_string(all.front().corrected.keyframes) + " keyframes were touched");
  std::vector<double> share;
  std::vector<double> over_exact;
  std::vector<double> harm;  // remaining fraction of the added error
  for (std::size_t i = 1; i < errors.size(); ++i) {
    share.push_back(all[i].corrected.median() / all[i].as_is.median());
    harm.push_back((all[i].corrected.median() - exact) / (all[i].as_is.median() - exact));
    over_exact.push_back(all[i].corrected.median() / exact);
  }
  section.trend(where + "the correction removes at least half of the median error",
                maxOf(share) <= 0.5,
                listed(share, 2) + " times that of the uncorrected poses; " +
                    listed(over_exact, 2) + " times that of exact poses",
                "the smallest pose errors add less than that to the depth error");
  section.trend(
      where + "the correction removes at least half of the median error that wrong poses add",
      maxOf(harm) <= 0.5, listed(harm, 2) + " of it remain");
}

}  // namespace

void studyMotionCorrection(const StudyRun& run, StudySection& section) {
  std::vector<Case> cases = {{"desk_stereo", 0.5, 5, 0.2, 1.5}};
  if (!run.quick) {
    cases.push_back({"room_stereo", 1, 6.5, 0.3, 4});
    cases.push_back({"drive_stereo", 4, 50, 0.2, 10});
  }
  const MotionCorrectionOptions defaults;
  section.text(
      "The paper uses its fused DSI as a measure of refocused events (Sec. 3.4.2) and does not "
      "change poses. Here the motion within a window is corrected: slices of 10 ms of events are "
      "aligned with the points of the depth map (`[refinement] correct_motion`, up to " +
      std::to_string(defaults.motion_rounds) +
      " rounds). The pose at the reference time does not change. The tracker has a velocity error "
      "with a random direction in each window, or the errors of real trackers (`--perturb "
      "tracker=good` and so on, with the seed of the recording). Three windows each (0.2 s of "
      "`desk_stereo` and `drive_stereo`, 0.3 s of `room_stereo`) of seeds 1 to 3, all points "
      "together; two cameras, the default depth, each window corrected. *Time*: seconds per "
      "keyframe, on this machine.");
  const std::vector<TrackerError> errors = trackerErrors(run.quick);
  TextTable table;
  table.head = {"recording", "tracker",    "poses",           "corrected",
                "points",    "median [%]", "beyond 10 % [%]", "time [s]"};
  std::vector<std::vector<Outcomes>> all;
  std::vector<cv::Mat> plots;
  for (const Case& what : cases) {
    all.push_back(outcomesOf(run, what, errors));
    addRows(table, what, errors, all.back());
    plots.push_back(draw(what, errors, all.back()));
  }
  section.table(table);
  cv::Mat picture;
  cv::hconcat(plots, picture);
  section.picture("motion_correction.png", picture, "Median error over the velocity error");
  for (std::size_t i = 0; i < cases.size(); ++i) judge(cases[i], errors, all[i], section);
}

}  // namespace efm::studies
