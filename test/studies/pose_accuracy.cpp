// SPDX-License-Identifier: BSD-3-Clause
// Depth with wrong poses and clocks (such poses are in TUM-VIE: Ghosh and Gallego 2022, Sec. 4.6).
#include <algorithm>
#include <functional>
#include <string>
#include <vector>

#include "mapping/geometry/rigid3.h"
#include "mapping/geometry/timestamp.h"
#include "maps/metrics/depth_metrics.h"
#include "plugin/results/pictures/curve_plot.h"
#include "test/studies/methods/error_figures.h"
#include "test/studies/methods/error_table.h"
#include "test/studies/methods/method_comparison.h"
#include "test/studies/recordings/real_rigs.h"
#include "test/studies/recordings/recording_errors.h"
#include "test/studies/studies.h"
#include "tracking_stub/rendering/frame_renderer.h"

namespace efm::studies {
namespace {

/// A kind of error and its levels.
struct ErrorKind {
  std::string title;
  std::string unit;            ///< Of the levels.
  std::vector<double> levels;  ///< The first is 0.
  std::function<std::string(double)> say;
  std::function<Recording(const Recording&, double)> make;
  bool of_second_camera = false;  ///< One camera alone is not affected.
};

ErrorKind poseKind(const std::string& title, const std::string& unit,
                   const std::vector<double>& levels, const std::function<std::string(double)>& say,
                   const std::function<void(PoseErrors&, double)>& set) {
  return {title, unit, levels, say, [set](const Recording& recording, double level) {
            PoseErrors errors;
            set(errors, level);
            return withPoseErrors(recording, errors);
          }};
}

std::vector<ErrorKind> errorKinds() {
  const auto say_noise = [](double mm) {
    return formatNumber(mm, 0) + " mm, " + formatNumber(0.05 * mm, 2) + "°";
  };
  const auto set_noise = [](PoseErrors& errors, double mm) {
    errors.noise_m = 1e-3 * mm;
    errors.noise_rad = 0.05 * mm * kRadiansPerDegree;
  };
  const auto say_drift = [](double mm) {
    return formatNumber(mm, 0) + " mm/s, " + formatNumber(0.02 * mm, 2) + "°/s";
  };
  const auto set_drift = [](PoseErrors& errors, double mm) {
    errors.drift_m_s = 1e-3 * mm;
    errors.drift_rad_s = 0.02 * mm * kRadiansPerDegree;
  };
  const auto say_late = [](double ms) { return formatNumber(ms, 0) + " ms"; };
  const auto nanoseconds = [](double ms) { return static_cast<std::int64_t>(ms * 1e6); };
  const auto set_late = [nanoseconds](PoseErrors& errors, double ms) {
    errors.late_ns = nanoseconds(ms);
  };
  const auto make_late = [nanoseconds](const Recording& recording, double ms) {
    return withLateCamera(recording, 1, nanoseconds(ms));
  };
  return {poseKind("Noise of every pose", "mm", {0, 1, 2, 5, 10, 20}, say_noise, set_noise),
          poseKind("Drift", "mm/s", {0, 1, 2, 5, 10, 20, 50}, say_drift, set_drift),
          poseKind("Poses late", "ms", {0, 1, 2, 5, 10, 20}, say_late, set_late),
          {"Second camera late", "ms", {0, 1, 2, 5, 10, 20}, say_late, make_late, true}};
}

/// One kind of error at all its levels.
struct ErrorResults {
  std::vector<MethodResult> mono;
  std::vector<MethodResult> stereo;
  /// Of the stereo maps at their own poses: an error of the reference pose alone does not count.
  std::vector<DepthErrors> in_world;
};

/// Mean speed of the rig, m/s.
double meanSpeed(const Recording& recording) {
  double path_length_m = 0;
  const std::vector<StampedPose>& poses = recording.trajectory.poses();
  for (std::size_t i = 1; i < poses.size(); ++i) {
    path_length_m +=
        (poses[i].T_world_rig.translation - poses[i - 1].T_world_rig.translation).norm();
  }
  return path_length_m / secondsBetween(poses.front().t_ns, poses.back().t_ns);
}

Method twoCameras() { return {"two cameras (Alg. 1)", paperOptions(1, 6.5)}; }

DepthErrors errorsInWorld(const Recording& recording,
                          const std::vector<KeyframeDepthMap>& keyframes) {
  std::vector<DepthPair> pairs;
  for (const KeyframeDepthMap& keyframe : keyframes) {
    const cv::Mat1f truth =
        renderDepth(recording.simulation.scene, keyframe.T_world_ref, keyframe.view);
    appendPairs(keyframe.map.depth, truth, pairs);
  }
  return depthErrors(pairs);
}

ErrorResults mapWith(const ErrorKind& kind, const Recording& recording,
                     const std::vector<Window>& windows) {
  ErrorResults results;
  for (const double level : kind.levels) {
    const Recording wrong = level > 0 ? kind.make(recording, level) : recording;
    const std::string name = level > 0 ? kind.say(level) : "exact";
    results.mono.push_back(mapMethod(wrong, windows, oneCamera(1, 6.5), name));
    results.stereo.push_back(mapMethod(wrong, windows, twoCameras(), name));
    results.in_world.push_back(errorsInWorld(recording, results.stereo.back().keyframes));
  }
  scoreMethods(recording, results.mono);
  scoreMethods(recording, results.stereo);
  return results;
}

cv::Mat3b drawGrowth(const ErrorKind& kind, const ErrorResults& results) {
  CurvePlot plot;
  plot.title = kind.title;
  plot.size = {560, 420};
  plot.x = {kind.unit, AxisScale::kLinear, 0, {}};
  plot.y = {"median error [cm]", AxisScale::kLinear, 0, {}};
  const auto add = [&](const char* name, const std::vector<double>& medians) {
    plot.curves.push_back(markedCurve(name, kind.levels, medians));
  };
  add("one camera", eachOf(results.mono, &MethodResult::own, medianCm));
  add("one camera, common", eachOf(results.mono, &MethodResult::common, medianCm));
  add("two cameras", eachOf(results.stereo, &MethodResult::own, medianCm));
  add("two cameras, common", eachOf(results.stereo, &MethodResult::common, medianCm));
  std::vector<double> in_world;
  for (const DepthErrors& errors : results.in_world) in_world.push_back(medianCm(errors));
  add("two cameras, in the world", in_world);
  return drawCurves(plot);
}

void tables(const ErrorKind& kind, const ErrorResults& results, StudySection& section) {
  section.text(twoCameras().name + ":");
  section.table(errorTable(results.stereo));
  if (kind.of_second_camera) return;
  section.text(std::string(kOneCamera) + ":");
  section.table(errorTable(results.mono));
}

/// The median error relative to exact poses, by level.
std::vector<double> timesExact(const std::vector<MethodResult>& results,
                               DepthErrors MethodResult::*pixels) {
  std::vector<double> times = eachOf(results, pixels, medianCm);
  const double exact = times.front();
  for (double& value : times) value /= exact;
  return times;
}

void judge(const std::vector<ErrorKind>& kinds, const std::vector<ErrorResults>& all,
           StudySection& section) {
  const auto own = &MethodResult::own;
  for (std::size_t k = 0; k < kinds.size(); ++k) {
    std::string times = listed(timesExact(all[k].stereo, own), 2) +
                        " times that of exact poses with two cameras (on common pixels " +
                        listed(timesExact(all[k].stereo, &MethodResult::common), 2) + ")";
    if (!kinds[k].of_second_camera) {
      times += ", " + listed(timesExact(all[k].mono, own), 2) + " times with one";
    }
    section.item(kinds[k].title + ": median error " + times + ", at " + listed(kinds[k].levels, 0) +
                 " " + kinds[k].unit + ".");
  }
  const std::vector<double> drift = timesExact(all[1].stereo, own);
  const std::size_t small = std::min<std::size_t>(2, drift.size() - 1);
  section.trend("good odometry is as good as exact poses in windows of 0.5 s: with " +
                    kinds[1].say(kinds[1].levels[small]) +
                    " the median error is at most 1.1 times as large",
                drift[small] <= 1.1, formatNumber(drift[small], 2) + " times");
  const std::vector<double> late = timesExact(all[2].stereo, own);
  const std::vector<double> apart = timesExact(all[3].stereo, own);
  section.trend("a delay between cameras does more harm than delayed poses",
                apart.back() > late.back(),
                against(apart.back(), late.back(), 2) + " times the median error at " +
                    formatNumber(kinds[3].levels.back(), 0) + " ms");
}

}  // namespace

void studyPoseAccuracy(const StudyRun& run, StudySection& section) {
  const Recording recording = roomRecording(run);
  const auto windows = recording.windows(run.pick(0.5, 0.1), run.pick(8, 1));
  std::vector<ErrorKind> kinds = errorKinds();
  if (run.quick) {
    for (ErrorKind& kind : kinds) kind.levels.resize(2);
  }
  section.text(
      "The paper has no such experiment. It finds (Sec. 4.6, TUM-VIE) that visual-inertial "
      "odometry is as good as motion capture for intervals of 0.5 s, and that the method needs "
      "accurate poses (its limitations). Here: the recording of study 1, " +
      std::to_string(windows.size()) +
      " windows of 0.5 s, planes from 1 to 6.5 m. The poses at 100 Hz have independent normal "
      "noise on each axis; or drift, with a heading that rotates about each axis and a position "
      "that moves along each axis (the drone flies at " +
      formatNumber(meanSpeed(recording), 2) +
      " m/s); or delayed stamps. Or poses are exact and the stamps of the second camera are "
      "delayed. Errors are relative to the truth at the true reference pose; *in the world*: to "
      "the truth at the wrong reference pose, as in a map of the world.");
  std::vector<ErrorResults> all;
  std::vector<cv::Mat> plots;
  for (const ErrorKind& kind : kinds) {
    all.push_back(mapWith(kind, recording, windows));
    section.heading(kind.title);
    tables(kind, all.back(), section);
    plots.push_back(drawGrowth(kind, all.back()));
  }
  section.heading("Growth");
  cv::Mat upper;
  cv::Mat lower;
  cv::Mat picture;
  cv::hconcat(plots[0], plots[1], upper);
  cv::hconcat(plots[2], plots[3], lower);
  cv::vconcat(upper, lower, picture);
  section.picture("pose_accuracy.png", picture, "Median error over each kind of error");
  judge(kinds, all, section);
}

}  // namespace efm::studies
