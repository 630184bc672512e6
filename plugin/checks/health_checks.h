// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fmt/core.h>
#include <Eigen/Core>

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "mapping/base/option.h"
#include "mapping/base/text.h"
#include "mapping/geometry/reference_view.h"
#include "mapping/geometry/rig.h"
#include "mapping/keyframes/fusion_mapper.h"
#include "mapping/keyframes/keyframe_depth_map.h"
#include "mapping/survey/camera_check.h"
#include "mapping/survey/depth_agreement.h"
#include "mapping/survey/option_choice.h"
#include "mapping/survey/pose_check.h"
#include "maps/cloud/map_point.h"
#include "plugin/checks/recording_statistics.h"
#include "plugin/session/event_fusion_options.h"
#include "plugin/session/session_status.h"

namespace efm {

/// Returns the horizontal and vertical field of view, radians. Fisheye lens: the image's angle is
/// proportional to the distance from the centre; other lenses: pinhole. Distortion is left out, so
/// the result is defined for any coefficients.
Eigen::Vector2d fieldOfView(const CameraModel& model);

/// Returns the distance of two cameras on the rig, metres.
double baselineOf(const RigCamera& a, const RigCamera& b);

/// Depths of keyframes, to compare the pixels with the voxels of the map.
struct PixelSizes {
  std::vector<double> at_median_m;  ///< Size of a pixel at the median depth of each keyframe.
  std::uint64_t depths = 0;

  void add(std::vector<float> depths_m, double fx);
  /// Returns `voxel-size` if the voxels do not fit the scene.
  std::optional<Warning> warning(double voxel_m) const;
};

/// Counts the pixels of keyframes by their result, and depths near the limits.
class DepthStatistics {
 public:
  /// @param chosen the options that were automatic: the user did not set these limits.
  explicit DepthStatistics(const DepthPlanesOptions& planes, std::vector<ChosenOption> chosen = {})
      : planes_(planes), chosen_(std::move(chosen)) {}

  void add(const KeyframeDepthMap& keyframe);
  /// @param voxel_size_m of the map: `voxel-size` if it does not fit the scene. Not given: no
  /// check.
  std::vector<Warning> warnings(std::optional<double> voxel_size_m) const;
  const PixelCounts& pixels() const { return pixels_; }

 private:
  DepthPlanesOptions planes_;
  std::vector<ChosenOption> chosen_;
  PixelCounts pixels_;
  PixelSizes sizes_;
  std::uint64_t nearest_ = 0;   // depths near the nearest plane
  std::uint64_t farthest_ = 0;  // depths near the farthest plane
};

/// Findings about a recording and, after the mapping, about its map.
struct Findings {
  const RecordingStatistics& recording;
  RecordingCounts read;
  std::int64_t until_ns = kMaxTimeNs;  ///< Time until which the recording was read.
  double near_depth_m = 0.5;           ///< Nearest depth of the scene, to judge the motion.
  double far_depth_m = 5;
  double max_pose_gap_s = 0.25;  ///< Events in longer gaps between poses are not used.

  // Set after the mapping; null before.
  const SessionStatus* session = nullptr;
  const FusionMapperOptions* options = nullptr;
  const DepthStatistics* depths = nullptr;
  const PixelSizes* pixels = nullptr;  ///< If `depths` are not known.
  double voxel_size_m = 0.01;          ///< Of the map.
  bool checks = true;                  ///< False: only missing and unused data are told.

  /// Takes the depth limits of a map.
  void use(const DepthPlanesOptions& planes, const std::vector<ChosenOption>& chosen);
  /// Returns the times of the first and the last event of all cameras.
  std::optional<TimeSpan> events() const;
};

/// Returns all warnings about a recording and its map. Every program uses this function.
std::vector<Warning> warningsOf(const Findings& findings);

/// Adds a warning with a name and a text in fmt's format.
template <typename... Values>
void addWarning(std::vector<Warning>& warnings, const char* name,
                fmt::format_string<Values...> text, Values&&... values) {
  warnings.push_back({name, fmt::format(text, std::forward<Values>(values)...)});
}

template <typename Value>
void append(std::vector<Value>& all, std::vector<Value> more) {
  std::move(more.begin(), more.end(), std::back_inserter(all));
}

// The parts of `warningsOf`, in files of their own.

/// Returns the warnings about a camera's intrinsics.
std::vector<Warning> calibrationWarnings(int camera, const CameraModel& model);
/// Checks the cameras: their calibration, and their events.
void checkCameras(const Findings& findings, std::vector<Warning>& warnings);
/// Checks the motion of the poses against the events: repeated poses (`poses-frozen`), steps that
/// are unusual for the tracker (`pose-jump`), and motion that is interpolated over more than 0.1 s
/// (`pose-interpolation`).
void checkMotion(const Findings& findings, std::vector<Warning>& warnings);
/// Checks a finished session: unused data, and holes in the map.
void checkSession(const Findings& findings, std::vector<Warning>& warnings);

/// Returns a warning for each missing part of a recording: events, calibration, poses.
std::vector<Warning> missingParts(const Rig& rig, bool has_events, bool has_poses);

/// Returns the warnings of the readers, and those of lost packets, of events without a time and of
/// skipped events.
std::vector<Warning> lossWarnings(const RecordingCounts& counts);

/// Returns the warning `far-coordinates` if floats are too coarse for the points of a map.
std::optional<Warning> farPointsWarning(const MapCloud& cloud, double voxel_size_m);

/// Returns the warning that automatic options were chosen without a scene.
Warning noSceneWarning();

/// Returns a sentence that says why a finished session made no keyframe: no events, no poses, poses
/// and events at different times (by how much), noise alone, or too little of both for one window.
OptionHint whyNoKeyframe(const SessionStatus& status, const FusionMapperOptions& options);

/// Returns the error of an interval without events: it names the times of the nearest events.
std::string noEventText(const TimeLimits& limits, const RecordingCounts& counts);

/// Returns what was found and done about the motion within the windows; empty: nothing was looked
/// at.
std::string motionText(const SessionStatus& status, const FusionMapperOptions& options);
/// Warns if the poses blur the events: `poses-blur`. @return std::nullopt if they do not.
std::optional<Warning> blurWarning(const SessionStatus& status, const FusionMapperOptions& options);

/// Removes `poses-blur` if a warning beside it names a mistake of the poses: wrong poses blur the
/// events, too.
void dropExplainedBlur(std::vector<Warning>& warnings);

/// Returns the warning about wrong poses, with the option or file that fixes them.
/// @param rig with which the mistake was found.
Warning poseWarning(const PoseFinding& finding, const Rig& rig);

/// Returns the offsets `rig.time_offsets_s` with which a clock is right: one value per camera.
/// @param camera the only one whose events are shifted; not given: all.
std::string offsetsText(const Rig& rig, std::optional<std::size_t> camera, double shift_s);

/// Returns the warning `extrinsics` or `camera-clocks` about two cameras, with the calibration with
/// which they fit. @return std::nullopt if nothing is wrong, or if it is not known what.
std::optional<Warning> cameraWarning(const CameraComparison& found, const Rig& rig);

/// Warns if the depths of the rig and those of its motion differ: `scale` or `depths-disagree`.
/// @return std::nullopt if they agree.
std::optional<Warning> agreementWarning(const DepthAgreement& agreement);

/// Warns if depths depend much on the clock and the travel of the poses: `depths-sensitive`.
/// @return std::nullopt if 10 ms change the depths by less than their standard deviation.
std::optional<Warning> sensitivityWarning(const DepthSensitivity& sensitivity);

}  // namespace efm
