// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <nlohmann/json_fwd.hpp>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "mapping/geometry/reference_view.h"
#include "mapping/geometry/trajectory.h"
#include "mapping/keyframes/fusion_mapper.h"
#include "maps/cloud/map_point.h"
#include "plugin/checks/health_checks.h"
#include "plugin/options/option_file.h"
#include "plugin/results/output/result_folder.h"
#include "plugin/session/map_refinement.h"
#include "plugin/session/session_status.h"
#include "tracking_stub/faults/tracker_faults.h"

namespace efm {

/// A box around points of a map, in metres, frame `world`.
struct MapExtent {
  Eigen::Vector3d min_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d max_m = Eigen::Vector3d::Zero();
};

/// Returns the box around the points of a map, std::nullopt if there are no points.
/// @param outside the fraction of the points that lie outside of the box, at each end of each axis;
/// 0 for the box around all points.
std::optional<MapExtent> extentOf(const MapCloud& cloud, double outside = 0);

/// Distances and angles by which the refinement moved the keyframes' poses.
struct PoseShift {
  double median_m = 0;
  double max_m = 0;
  double median_rad = 0;
  double max_rad = 0;
};

/// Compares poses before and after. Both lists have the same keyframes in the same order.
PoseShift shiftBetween(const std::vector<StampedPose>& before,
                       const std::vector<StampedPose>& after);

/// The size of a session file, and what it cost.
struct SessionCost {
  std::uint64_t bytes = 0;
  std::uint64_t depths = 0;  ///< Of all keyframes.
  double seconds = 0;        ///< Until the disk had the keyframes, beside the mapping.
  double bytesPerDepth() const {
    return depths > 0 ? static_cast<double>(bytes) / static_cast<double>(depths) : 0;
  }
};

/// The counts, times and options of a run: the content of report.json.
struct RunReport {
  std::vector<std::string> recording;  ///< Absolute names of the recording's files.
  MapperCounts counts;
  std::vector<std::uint64_t> silent_keyframes;  ///< Keyframes without events of a camera.
  std::optional<LiveStatus> live;               ///< The state of live operation.
  std::uint64_t points = 0;                     ///< Number of points of the exported map.
  std::string map_hash;                         ///< `mapHash` of the exported map.
  PixelCounts pixels;                           ///< Pixels of all keyframes.
  std::optional<MapExtent> extent;              ///< The box around all points.
  /// The box of 0.1 to 99.9 % of the points on each axis: a few wrong points are far away.
  std::optional<MapExtent> most_extent;
  double recording_s = 0;               ///< Time from the first event that was read to the last.
  std::uint64_t peak_memory_bytes = 0;  ///< Peak memory of the process.
  StageTimes times;
  EventFusionOptions options;                 ///< The options as used.
  std::vector<ChosenOption> chosen;           ///< The automatic options.
  TrackerFaults faults;                       ///< The faults of the perturbed poses.
  std::optional<RefinementState> refinement;  ///< The refinement, if poses were refined.
  std::string motion;                         ///< `motionText`.
  std::optional<PoseShift> pose_shift;        ///< The shift by the refinement.
  /// The value of `max_confidence = sequence`, if a first pass found it.
  std::optional<double> sequence_maximum;
  /// View of the depth maps, and distance of its camera to the nearest other selected camera, for
  /// disparity. std::nullopt if the rig was never complete or has one camera.
  std::optional<ReferenceView> view;
  std::optional<double> baseline_m;
  /// The fraction of the recording that was mapped, if the run was interrupted.
  std::optional<double> stopped_at;
  std::optional<SessionCost> session;
  std::string error;  ///< Why the recording was not mapped to its end; empty if it was.
  std::uint64_t skipped_events = 0;  ///< Bad events that the reader left out.
  std::vector<Warning> warnings;
  std::vector<Warning> notes;  ///< What could not be checked.
  MapQuality quality;
};

/// Writes the number of points and their extents into the report.
void describePoints(const MapCloud& cloud, RunReport& report);

/// Returns the report as indented JSON: schema (1), events (total and per camera; read = used +
/// without_pose + outside_window + late + dropped + unselected + filtered + outside_lens +
/// over_budget), event_uses, votes (their sum is event_uses x planes), keyframes, silent
/// (keyframes per camera, sub-intervals), points, map_hash (see `mapHash`), extent_m (min and max,
/// frame `world`; absent without points), pixels (see PixelCounts), most_extent_m (the extent of
/// 0.1 to 99.9 % of the points on each axis), recording_seconds (first event to last event),
/// seconds (real time), cpu_seconds (processor time: once per run, for events, for keyframes),
/// votes_per_second, sorted_events, skipped_events (bad events that the reader left out),
/// refinement if poses were refined (registered keyframes; loops; failed_solves; failures: errors,
/// after which a keyframe keeps the tracker's motion; last_error; the learnt errors of the tracker;
/// moved: the shift of the poses), kernel, threads, peak_memory_bytes (of this process),
/// reference_view and baseline_m if known, stopped_at if the run was interrupted (the fraction of
/// the recording that was mapped), error if it was not mapped to its end, live in live operation
/// (drop_ratio; counts of each camera's events before the mapping; windows_dropped and the reasons;
/// late_events, pose_jumps, clock_resets, rejected_poses, errors and last_error), warnings (each
/// with name and text), notes (the same; absent if there are none), quality (see MapQuality: word,
/// wrong_share, depth_error, support, agreement and sharpness if known, left_out, reasons,
/// keyframes, much_worse), recording (the files), session (bytes of session.mcap, per depth of a
/// keyframe, and the time to write it, beside the mapping), perturbation (the faults of the poses,
/// if any), chosen (the automatic options: key, value and reason), options (all options with the
/// used values) and version. Bytes of names that are not UTF-8 become U+FFFD.
std::string reportJson(const RunReport& report);

/// Returns a list of objects with name and text.
nlohmann::ordered_json asJson(const std::vector<Warning>& warnings);

/// Returns the peak memory of this process so far.
std::uint64_t peakMemoryBytes();

/// Returns the result of a run in plain words, for the user: a line per fact, under 20 lines. A
/// fact that is not known or does not apply has no line.
/// @param kind `kDepth`: the result is one keyframe.
/// @param folder the folder with the results.
std::string summaryOf(const RunReport& report, OutputKind kind,
                      const std::filesystem::path& folder);

}  // namespace efm
