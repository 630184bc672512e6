// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fmt/core.h>
#include <Eigen/Core>

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <map>
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
#include "mapping/survey/depth_agreement.h"
#include "mapping/survey/option_choice.h"
#include "mapping/survey/pose_check.h"
#include "plugin/session/event_fusion_options.h"
#include "plugin/session/recording_statistics.h"
#include "plugin/session/session_status.h"

namespace efm {

/// Whether a recording knows the camera's calibration. Without one, the focal length is 0.
bool isCalibrated(const CameraModel& model);

/// Horizontal and vertical field of view, radians: of the pinhole, or, for a fisheye lens, of its
/// angles in proportion to the distance from the centre. The distortion is left out, so it is
/// defined for any coefficients.
Eigen::Vector2d fieldOfView(const CameraModel& model);

/// Distance of two cameras on the rig, metres.
double baselineOf(const RigCamera& a, const RigCamera& b);

/// Counts what became of the pixels of keyframes, and depths near the limits.
class DepthStatistics {
 public:
  /// @param chosen the options that were automatic: their limits are not the user's.
  explicit DepthStatistics(const DepthPlanesOptions& planes, std::vector<ChosenOption> chosen = {})
      : planes_(planes), chosen_(std::move(chosen)) {}

  void add(const KeyframeDepthMap& keyframe);
  std::vector<Warning> warnings() const;
  const PixelCounts& pixels() const { return pixels_; }
  /// Why the depths rest on little evidence; empty where they do not.
  std::vector<std::string> doubts() const;

 private:
  void compareWithLast(const KeyframeDepthMap& keyframe);

  DepthPlanesOptions planes_;
  std::vector<ChosenOption> chosen_;
  PixelCounts pixels_;
  KeyframeDepthMap last_;              // depths, view and pose
  std::uint64_t shared_ = 0;           // points that two keyframes in a row have
  std::uint64_t agreeing_ = 0;         // with the same depth
  std::vector<double> parallaxes_px_;  // of the median depth of each keyframe
  std::uint64_t depths_ = 0;
  std::uint64_t nearest_ = 0;   // near the nearest plane
  std::uint64_t farthest_ = 0;  // near the farthest plane
};

/// What is known of a recording and, after it was mapped, of its map.
struct Findings {
  const RecordingStatistics& recording;
  RecordingCounts read;
  std::int64_t until_ns = kMaxTimeNs;  ///< The recording was read until this time.
  double near_depth_m = 0.5;           ///< The nearest depth that the motion is compared with.
  double far_depth_m = 5;
  double max_pose_gap_s = 0.25;  ///< Events in longer gaps are not used.

  // After the mapping; otherwise null.
  const SessionStatus* session = nullptr;
  const FusionMapperOptions* options = nullptr;
  const DepthStatistics* depths = nullptr;

  /// With the depths that a map uses.
  void use(const DepthPlanesOptions& planes, const std::vector<ChosenOption>& chosen);
  /// First and last event of all cameras.
  std::optional<TimeSpan> events() const;
};

/// All warnings about a recording and its map: the one function for each program.
std::vector<Warning> warningsOf(const Findings& findings);

/// Adds a warning: its name, and its text in fmt's format.
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

/// What is implausible about the cameras: their calibration, and their events.
void checkCameras(const Findings& findings, std::vector<Warning>& warnings);
/// What is implausible about the motion of the poses beside the events: poses that repeat
/// (`poses-frozen`), steps that the tracker otherwise does not make (`pose-jump`), and motion that
/// is interpolated over more than 0.1 s (`pose-interpolation`).
void checkMotion(const Findings& findings, std::vector<Warning>& warnings);
/// What a finished session did not use, and where its map has holes.
void checkSession(const Findings& findings, std::vector<Warning>& warnings);

/// The parts that a recording lacks for a map: events, calibration, poses.
/// @param cameras by their index.
std::vector<Warning> missingParts(const std::map<int, CameraModel>& cameras, bool has_events,
                                  bool has_poses);

/// Warnings of the readers, and of what the recording lacks: packets, the times of events, or
/// events that were left out.
std::vector<Warning> lossWarnings(const RecordingCounts& counts);

/// Automatic options were chosen without a scene.
Warning noSceneWarning();

/// Says in a sentence why a finished session made no keyframe: no events, no poses, poses and
/// events that miss each other (by how much), noise alone, or too few of both for one window.
OptionHint whyNoKeyframe(const SessionStatus& status, const FusionMapperOptions& options);

/// Says what is wrong about the poses, and the option or file that would mend it.
/// @param rig with which it was found.
Warning poseWarning(const PoseFinding& finding, const Rig& rig);

/// Says how the depths of the rig and those of its motion differ: `scale` or `depths-disagree`.
/// @return nothing where they agree.
std::optional<Warning> agreementWarning(const DepthAgreement& agreement);

/// Says how much the depths change with the clock and the travel of the poses: `depths-sensitive`.
/// @return nothing where 10 ms change less than the depths' standard deviation.
std::optional<Warning> sensitivityWarning(const DepthSensitivity& sensitivity);

}  // namespace efm
