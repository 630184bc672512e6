// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "mapping/geometry/reference_view.h"
#include "mapping/geometry/trajectory.h"
#include "mapping/keyframes/fusion_mapper.h"
#include "maps/cloud/map_point.h"
#include "plugin/options/option_file.h"
#include "plugin/results/output/map_output.h"
#include "plugin/session/health_checks.h"
#include "plugin/session/map_refinement.h"
#include "plugin/session/session_status.h"
#include "tracking_stub/faults/tracker_faults.h"

namespace efm {

/// A box around points of a map, in metres, frame `world`.
struct MapExtent {
  Eigen::Vector3d min_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d max_m = Eigen::Vector3d::Zero();
};

/// @param outside the fraction of the points that lie outside, at each end of each axis; 0 for the
/// box around all of them.
/// @return nothing without points.
std::optional<MapExtent> extentOf(const MapCloud& cloud, double outside = 0);

/// How far the refinement moved the keyframes' poses.
struct PoseShift {
  double median_m = 0;
  double max_m = 0;
  double median_rad = 0;
  double max_rad = 0;
};

/// @param before and `after`: poses of the same keyframes, in the same order.
PoseShift shiftBetween(const std::vector<StampedPose>& before,
                       const std::vector<StampedPose>& after);

/// The counts, times and options of a run: the content of report.json.
struct MapReport {
  std::vector<std::string> recording;  ///< The absolute names of its files.
  MapperCounts counts;
  std::vector<std::uint64_t> silent_keyframes;  ///< Per camera: keyframes without its events.
  std::optional<LiveStatus> live;               ///< Of live operation.
  std::uint64_t points = 0;                     ///< Of the exported map.
  PixelCounts pixels;                           ///< Of all keyframes.
  std::optional<MapExtent> extent;              ///< Of these points.
  /// Of 0.1 to 99.9 % of them on each axis: a few wrong points lie far from all others.
  std::optional<MapExtent> most_extent;
  double recording_s = 0;               ///< From the first event that was read to the last.
  std::uint64_t peak_memory_bytes = 0;  ///< Of the process.
  StageTimes times;
  EventFusionOptions options;                 ///< As used.
  std::vector<ChosenOption> chosen;           ///< Those of them that were automatic.
  TrackerFaults faults;                       ///< Of the perturbed poses.
  std::optional<RefinementState> refinement;  ///< Where poses were refined.
  std::optional<PoseShift> pose_shift;        ///< By the refinement.
  /// The value of `max_confidence = sequence`, where a first pass found it.
  std::optional<double> sequence_maximum;
  /// The view of the depth maps, and the distance of its camera to the nearest other selected one:
  /// they turn depth into disparity. Nothing where the rig was never complete or has one camera.
  std::optional<ReferenceView> view;
  std::optional<double> baseline_m;
  /// The fraction of the recording that was mapped, where the run was interrupted.
  std::optional<double> stopped_at;
  std::uint64_t skipped_events = 0;  ///< Bad ones that the reader left out.
  std::vector<Warning> warnings;
  std::vector<std::string> doubts;  ///< Why the map rests on little evidence; usually none.
};

/// Enters the number of points and their extents.
void describePoints(const MapCloud& cloud, MapReport& report);

/// The report as indented JSON: events (total and per camera; read = used + without_pose +
/// outside_window + dropped + filtered + outside_lens + over_budget), event_uses, votes (event_uses
/// x planes = their sum), keyframes, silent (keyframes per camera, sub-intervals), points, extent_m
/// (min and max, frame `world`; absent without points), pixels (see PixelCounts), most_extent_m
/// (the same of 0.1 to 99.9 % of the points on each axis), recording_seconds (from the first event
/// to the last), seconds (real time), cpu_seconds (processor time: once per run, for events, for
/// keyframes), votes_per_second, sorted_events, skipped_events (bad ones that the reader left out),
/// refinement where poses were refined (registered keyframes, loops, failed_solves: minima that
/// could not be computed, failures: errors, after which a keyframe keeps the tracker's motion,
/// last_error, the learnt errors of the tracker, and under `moved` how far it moved poses), kernel,
/// threads, peak_memory_bytes (of this process), reference_view and baseline_m where known,
/// stopped_at where the run was interrupted (the fraction of the recording that was mapped),
/// live in live operation (drop_ratio, per camera what became of its events before the mapping,
/// dropped_windows and for which reason, late_events, pose_jumps, clock_steps, refused_poses,
/// errors and last_error), warnings (each with name and text), doubtful (why the map rests on
/// little evidence; absent where it does not), recording (its files), perturbation (the faults of
/// the poses, if any), chosen (the automatic options: key, value and reason), options (all of them,
/// with these values) and version. Bytes of names that are not UTF-8 become U+FFFD.
std::string reportJson(const MapReport& report);

/// The most memory that this process has had so far.
std::uint64_t peakMemoryBytes();

/// The result of a run in plain words, for the user: a line per fact, under 20 lines. A fact that
/// is not known or does not apply has no line.
/// @param kind `kDepth`: of one keyframe.
/// @param folder with the results.
std::string summaryOf(const MapReport& report, OutputKind kind,
                      const std::filesystem::path& folder);

}  // namespace efm
