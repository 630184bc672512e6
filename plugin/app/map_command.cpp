// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/app/map_command.h"

#include <cstdio>
#include <functional>
#include <initializer_list>
#include <iostream>
#include <memory>

#include "mapping/geometry/timestamp.h"
#include "maps/cloud/keyframe_cloud.h"
#include "maps/cloud/outlier_removal.h"
#include "plugin/app/mapping_run.h"
#include "plugin/output/map_output.h"
#include "plugin/output/npy_file.h"

namespace efm {
namespace {

EventFusionOptions optionsOf(const MappingArguments& arguments) {
  OptionReader reader;
  reader.readFile(arguments.config);
  for (const std::string& assignment : arguments.sets) reader.set(assignment);
  EventFusionOptions options = reader.options();
  if (!arguments.source.calibration.empty()) options.rig.calibration = arguments.source.calibration;
  if (!arguments.source.poses.empty()) options.rig.pose_source.clear();  // there are no others
  if (!arguments.source.hand_eye.empty()) options.rig.hand_eye = arguments.source.hand_eye;
  return options;
}

/// The recording with what the options say of its rig, and of keyframes to a tracker whose noise is
/// constant in each.
RecordingSource sourceOf(const MappingArguments& arguments, const EventFusionOptions& options) {
  RecordingSource source = arguments.source;
  source.calibration = options.rig.calibration;
  source.hand_eye = options.rig.hand_eye;
  source.override_rig = false;  // the builder's options do
  PosePerturbationOptions& perturbation = source.faults.perturbation;
  perturbation.max_pose_gap_s = options.mapper.trajectory.max_pose_gap_s;
  if (perturbation.keyframe.any() && !perturbation.keyframe.length_ns) {
    perturbation.keyframe.length_ns = durationFromSeconds(options.mapper.keyframes.stride_s);
  }
  return source;
}

void printSummary(const MapReport& report, const std::filesystem::path& folder) {
  std::printf("%llu keyframes, %llu points, %.1f million votes/s; written to %s\n",
              static_cast<unsigned long long>(report.counts.keyframes),
              static_cast<unsigned long long>(report.points), votesPerSecond(report) * 1e-6,
              folder.c_str());
}

/// An option file that names a calibration must not replace a better one in silence.
void warnOfRecalibration(const MappingArguments& arguments, MappingOutcome& outcome) {
  if (outcome.recalibrated_cameras == 0) return;
  if (!arguments.source.calibration.empty()) return;  // it was asked for
  outcome.warnings.push_back(outcome.report.options.rig.calibration.string() +
                             " replaced another calibration, the recording's own; --set "
                             "rig.calibration= keeps that");
}

/// Writes each file, also where one before it could not be: the first error is the outcome's.
void writeAll(MappingOutcome& outcome, std::initializer_list<std::function<void()>> files) {
  for (const auto& write : files) {
    try {
      write();
    } catch (const std::runtime_error& error) {
      if (!outcome.error) outcome.error = error.what();
    }
  }
}

std::function<void(const std::filesystem::path&)> saverOf(const mrpt::maps::CSimpleMap& map) {
  return [&map](const std::filesystem::path& file) {
    if (map.saveToFile(file.string())) return;
    throw std::runtime_error("the file cannot be created or the disk is full");
  };
}

/// What `map` and `depth` end with: the report, then words to the user.
int conclude(const MappingOutcome& outcome, MapOutput& output) {
  // A run that failed before its first keyframe leaves the results of an earlier one as they were.
  const bool made_nothing = outcome.error && outcome.report.counts.keyframes == 0;
  if (!made_nothing || !std::filesystem::exists(output.folder() / "report.json")) {
    output.writeReport(reportJson(outcome.report));
  }
  for (const std::string& warning : outcome.warnings) {
    std::cerr << "event-fusion: warning: " << warning << "\n";
  }
  if (outcome.report.counts.keyframes > 0) printSummary(outcome.report, output.folder());
  if (!outcome.error) return 0;
  std::cerr << "event-fusion: error: " << *outcome.error << "\n";
  return 1;
}

Window windowOf(const DepthArguments& arguments, ReferenceTime reference) {
  Window window = windowOf(arguments.t0_ns, arguments.t1_ns, reference);
  window.t_ref_ns = arguments.t_ref_ns.value_or(window.t_ref_ns);
  return window;
}

/// The first pass over the whole recording, where the options ask for its maximum.
std::optional<double> sequenceMaximumOf(const RecordingSource& source, EventFusionOptions options) {
  if (options.mapper.keyframe.extraction.max_confidence.level != WhiteLevel::kSequence) {
    return std::nullopt;
  }
  options.mapper.only_window.reset();
  options.refinement.enabled = false;  // moves no confidence
  return sequenceMaximum(options, *openRecording(source));
}

}  // namespace

int runMap(const MapArguments& arguments) {
  StageSeconds clock;
  MappingOutcome outcome;
  std::optional<MapOutput> output;
  {
    const SecondsScope total(clock.total);
    MappingJob job;
    job.options = optionsOf(arguments);
    job.options.mapper.limits = {arguments.t0_ns, arguments.t1_ns};
    job.options.mapper.limits.validate();
    const RecordingSource source = sourceOf(arguments, job.options);
    job.sequence_maximum = sequenceMaximumOf(source, job.options);
    const std::unique_ptr<Recording> recording = openRecording(source);
    output.emplace(arguments.out, OutputKind::kMap, job.options.mapper.keyframe.planes);
    job.take_keyframe = [&](const KeyframeDepthMap& keyframe) { output->writeKeyframe(keyframe); };

    outcome = runMapping(job, *recording);
    outcome.report.faults = source.faults;
    warnOfRecalibration(arguments, outcome);
    if (outcome.report.counts.keyframes > 0) {
      const SecondsScope map(outcome.report.seconds.map);
      writeAll(outcome, {[&] { output->writeCloud("map.pcd", outcome.points); },
                         [&] { output->writeFile("map.simplemap", saverOf(outcome.keyframes)); },
                         [&] { output->writeTrajectory("trajectory.txt", outcome.trajectory); },
                         [&] {
                           if (!job.options.refinement.enabled) return;
                           output->writeTrajectory("trajectory_tracker.txt",
                                                   outcome.tracker_trajectory);
                         }});
    }
  }
  outcome.report.seconds.total = clock.total;
  return conclude(outcome, *output);
}

int runDepth(const DepthArguments& arguments) {
  StageSeconds clock;
  MappingOutcome outcome;
  std::optional<MapOutput> output;
  {
    const SecondsScope total(clock.total);
    MappingJob job;
    job.options = optionsOf(arguments);
    job.options.mapper.only_window = windowOf(arguments, job.options.mapper.keyframes.reference);
    job.options.mapper.validate();
    const RecordingSource source = sourceOf(arguments, job.options);
    job.sequence_maximum = sequenceMaximumOf(source, job.options);
    const std::unique_ptr<Recording> recording = openRecording(source);
    output.emplace(arguments.out, OutputKind::kDepth, job.options.mapper.keyframe.planes);

    std::vector<CloudPoint> points;
    job.take_keyframe = [&](const KeyframeDepthMap& keyframe) {
      output->writeImages(keyframe);
      const std::vector<CloudPoint> cloud =
          job.options.late_fusion ? lateFusionCloud(keyframe) : keyframeCloud(keyframe);
      points = removeOutliers(cloud, job.options.cloud.outliers);
    };
    std::unique_ptr<NpyDsiFile> dsi;
    if (arguments.save_dsi) {
      job.make_dsi_sink = [&](const ReferenceView& view) {
        dsi = std::make_unique<NpyDsiFile>(arguments.out / "dsi.npy",
                                           job.options.mapper.keyframe.planes.num_planes, view);
        return dsi.get();
      };
    }

    outcome = runMapping(job, *recording);
    outcome.report.faults = source.faults;
    warnOfRecalibration(arguments, outcome);
    outcome.report.points = points.size();
    if (outcome.report.counts.keyframes > 0) {
      writeAll(outcome, {[&] { output->writeCloud("points.pcd", points); },
                         [&] {
                           if (dsi) dsi->finish();
                         }});
    }
  }
  outcome.report.seconds.total = clock.total;
  return conclude(outcome, *output);
}

}  // namespace efm
