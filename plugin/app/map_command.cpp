// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/app/commands.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <initializer_list>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <system_error>

#include "mapping/geometry/timestamp.h"
#include "maps/cloud/cloud_points.h"
#include "maps/cloud/keyframe_cloud.h"
#include "plugin/app/interruption.h"
#include "plugin/app/mapping_run.h"
#include "plugin/app/output_checks.h"
#include "plugin/app/program.h"
#include "plugin/recordings/open/mrpt_library.h"
#include "plugin/results/output/keyframe_writer.h"
#include "plugin/results/output/map_output.h"
#include "plugin/results/output/report.h"
#include "plugin/results/pictures/depth_picture.h"
#include "plugin/results/pictures/map_picture.h"
#include "plugin/results/pictures/picture.h"
#include "plugin/results/viewer/map_page.h"

namespace efm {
namespace {

OptionReader readerOf(const MappingArguments& arguments) {
  return asUsage([&] {
    OptionReader reader;
    if (!arguments.config.empty()) reader.readFile(findConfig(arguments.config));
    for (const std::string& assignment : arguments.sets) reader.set(assignment);
    return reader;
  });
}

/// The recording with the options' calibration and hand-eye transform, and with their stride for
/// tracker noise that is constant over a keyframe.
RecordingSource sourceOf(const MappingArguments& arguments, const OptionReader& reader,
                         const EventFusionOptions& options) {
  RecordingSource source = arguments.source;
  source.calibration = options.rig.calibration;
  source.hand_eye = options.rig.hand_eye;
  if (arguments.source.calibration.empty()) {
    source.calibration_given = reader.given("rig", "calibration");
  }
  if (arguments.source.hand_eye.empty()) source.hand_eye_given = reader.given("rig", "hand_eye");
  source.setup = options.rig.setup;
  source.time_offsets_ns = options.rig.time_offsets_ns;
  source.override_rig = false;  // the mapping's options do
  PosePerturbationOptions& perturbation = source.faults.perturbation;
  perturbation.max_pose_gap_s = options.mapper.trajectory.max_pose_gap_s;
  if (perturbation.keyframe.any() && !perturbation.keyframe.length_ns) {
    perturbation.keyframe.length_ns = durationFromSeconds(options.mapper.policy.stride_s);
  }
  source.limits = options.mapper.interval();
  return source;
}

/// With the content of the files that they name, which are read once.
EventFusionOptions optionsOf(const MappingArguments& arguments, const OptionReader& reader) {
  EventFusionOptions options = asUsage([&] { return reader.options(); });
  if (!arguments.source.calibration.empty()) options.rig.calibration = arguments.source.calibration;
  if (!arguments.source.poses.empty()) options.rig.pose_source.clear();  // the only source
  if (!arguments.source.hand_eye.empty()) options.rig.hand_eye = arguments.source.hand_eye;
  options.rig.setup =
      std::make_shared<RigSetup>(readRigSetup(sourceOf(arguments, reader, options)));
  return options;
}

/// Warns if the option file replaced the recording's own calibration, which may be the better one.
void warnOfRecalibration(const MappingArguments& arguments, MappingOutcome& outcome) {
  if (outcome.recalibrated_cameras == 0) return;
  if (!arguments.source.calibration.empty()) return;  // --calibration is intended
  outcome.report.warnings.push_back(
      {"calibration-replaced", outcome.report.options.rig.calibration.string() +
                                   " replaced another calibration, the recording's own; --set "
                                   "rig.calibration= keeps that"});
}

bool isWithoutPoints(const MapReport& report) {
  return report.counts.keyframes > 0 && report.points == 0;
}

void warnOfNoPoints(MapReport& report) {
  if (!isWithoutPoints(report)) return;
  const PixelCounts& pixels = report.pixels;
  const std::uint64_t depths =
      pixels.candidates - pixels.at_nearest - pixels.at_farthest - pixels.ambiguous;
  report.warnings.push_back(
      {"no-points",
       fmt::format(
           "the map has no point: of {} pixels with contrast, {} fit best to the nearest plane and "
           "{} to the farthest ([dsi] min_depth_m, max_depth_m), {} are ambiguous (the parallax is "
           "small: [keyframes] window_s; [depth] min_quality), and {} with a depth were removed "
           "([map] min_keyframes, outlier_radius_m); or the calibration and the poses do not "
           "explain the events",
           pixels.candidates, pixels.at_nearest, pixels.at_farthest, pixels.ambiguous, depths)});
}

/// Few points are little evidence, however sure each of them is.
void doubtFewPoints(MapReport& report) {
  constexpr std::uint64_t kFewPoints = 200;
  if (report.points >= kFewPoints || report.counts.keyframes == 0) return;
  report.doubts.push_back(fmt::format("the map has {} points", report.points));
}

void warnOfFarPoints(const MapCloud& cloud, MapReport& report) {
  const auto step_m = coarseStepOf(cloud, report.options.cloud.voxel_size_m);
  if (!step_m) return;
  const auto& origin = cloud.sensor_origin_;
  report.warnings.push_back(
      {"far-coordinates",
       fmt::format("a float has steps of {:.2g} m at the map's coordinates, over a tenth of a "
                   "voxel: x, y and z of the PCD file are relative to its VIEWPOINT, ({:.0f}, "
                   "{:.0f}, {:.0f}), which viewers do not add; MRPT's maps of points are rounded; "
                   "map.ply has doubles (--set output.ply=true)",
                   *step_m, origin.x(), origin.y(), origin.z())});
}

/// Writes all files, even if one fails. The outcome has the first error.
void writeAll(MappingOutcome& outcome, std::initializer_list<std::function<void()>> files) {
  for (const auto& write : files) {
    try {
      write();
    } catch (const std::exception& error) {
      if (!outcome.error) outcome.error = inWords(error);
      outcome.misses_file = true;
    }
  }
}

/// Not where MRPT is missing: a note says so.
void writeSimpleMap(MapOutput& output, const std::vector<StoredKeyframe>& keyframes) {
  const MrptLibrary* library = nullptr;
  try {
    library = &mrptLibrary("map.simplemap");
  } catch (const std::runtime_error& error) {
    std::cerr << "event-fusion: note: " << error.what() << "; the file is left out\n";
    return;
  }
  output.writeFile("map.simplemap", [&](const std::filesystem::path& file) {
    library->writeSimpleMap(file, keyframes);
  });
}

/// Opens a window. The library with MRPT's windows is loaded by this call alone.
std::unique_ptr<MapWindow> openWindow() {
  const char* const display = std::getenv("DISPLAY");
  if (!display || *display == '\0') {
    throw std::runtime_error(
        "--view needs a display: DISPLAY is not set; --record-frames DIR renders without a screen");
  }
  using Open = MapWindow* (*)();
  void* const open = symbolOf("libevent-fusion-window.so", "efmOpenMapWindow", "--view");
  std::unique_ptr<MapWindow> window(reinterpret_cast<Open>(open)());
  if (window) return window;
  throw std::runtime_error(std::string("--view: no window appears on the display ") + display +
                           "; --record-frames DIR renders without a screen");
}

/// Writes map.html, which shows the report, and adds its time to the report's.
void writePage(MappingOutcome& outcome, MapOutput& output, const KeyframePictures& pictures) {
  MapReport& report = outcome.report;
  double real_s = 0, cpu_s = 0;
  {
    const SecondsScope scope(real_s, cpu_s);
    const std::filesystem::path folder = std::filesystem::absolute(output.folder() / "");
    const MapPage page = {folder.lexically_normal().parent_path().filename().string(),
                          *outcome.points,
                          report.options.cloud.voxel_size_m,
                          outcome.trajectory,
                          pictures,
                          report.view,
                          reportJson(report)};
    writeAll(outcome,
             {[&] { output.writePage([&](std::ostream& file) { writeMapPage(file, page); }); }});
  }
  report.times.real.map += real_s;
  report.times.real.total += real_s;
  report.times.cpu.output += cpu_s;
  report.times.cpu.total += cpu_s;
}

std::string stays(const MapOutput& output) {
  return fmt::format("; the earlier result in {} stays", output.folder().string());
}

/// Writes the page of a map and the report; prints warnings, summary and error. @return the exit
/// status.
int conclude(MappingOutcome& outcome, OutputKind kind, MapOutput& output,
             const KeyframePictures& pictures, const MappingArguments& arguments,
             const OptionReader& reader) {
  outcome.report.peak_memory_bytes = peakMemoryBytes();
  if (kind == OutputKind::kMap && outcome.report.counts.keyframes > 0) {
    writePage(outcome, output, pictures);
    outcome.report.peak_memory_bytes = peakMemoryBytes();
  }
  // A run without a keyframe, or one that cannot write a file, leaves the result of an earlier run.
  const bool replaces =
      outcome.report.counts.keyframes > 0 && !(output.keepsEarlier() && outcome.misses_file);
  if (replaces || !std::filesystem::exists(output.folder() / "report.json")) {
    writeAll(outcome, {[&] { output.writeReport(reportJson(outcome.report)); }});
  }
  if (output.keepsEarlier() && outcome.error) *outcome.error += stays(output);
  const std::vector<Warning>& warnings = outcome.report.warnings;
  printWarnings(
      {warnings.begin() + static_cast<std::ptrdiff_t>(outcome.told_warnings), warnings.end()});
  const bool quiet = arguments.verbosity == Verbosity::kQuiet;
  if (outcome.report.counts.keyframes > 0 && !quiet && !output.keepsEarlier())
    std::cout << summaryOf(outcome.report, kind, output.folder());
  if (outcome.error) {
    if (const auto wrong = reader.wrongOption(*outcome.error)) return fail(*wrong, kUsageStatus);
    return fail(reader.withOrigins(*outcome.error));
  }
  if (!outcome.report.stopped_at) {
    const bool strict = arguments.strict && failStrictly(warnings);
    if (isWithoutPoints(outcome.report)) return fail("the map has no point; its files are written");
    return strict ? kFailedStatus : 0;
  }
  std::cerr << fmt::format("event-fusion: stopped at {:.0f} % of the recording\n",
                           100 * *outcome.report.stopped_at);
  return kInterruptedStatus;
}

Window windowOf(const DepthArguments& arguments, const RecordingSource& source,
                ReferenceTime reference) {
  RecordingTimes times(source);
  const TimeLimits limits = times.resolve(arguments.times);
  Window window = windowOf(*limits.t0_ns, *limits.t1_ns, reference);
  if (arguments.t_ref) window.t_ref_ns = times.resolve(*arguments.t_ref);
  return window;
}

/// The first pass over the recording, for max_confidence = sequence.
std::optional<double> sequenceMaximumOf(const RecordingSource& source, MappingJob job) {
  EventFusionOptions& options = job.options;
  if (options.mapper.keyframe.extraction.max_confidence.level != WhiteLevel::kSequence) {
    return std::nullopt;
  }
  options.mapper.only_window.reset();
  options.refinement.enabled = false;  // changes no confidence
  return sequenceMaximum(job, *openRecording(source));
}

/// A first pass over the recording: chooses the automatic options, and warns of poses that do not
/// explain the events.
/// @return the recording again, if its events fit into `[live] max_queue_mb`.
std::unique_ptr<Recording> survey(const RecordingSource& source, MappingJob& job) {
  std::unique_ptr<Recording> recording = openRecording(source);
  HeldSamples held(job.options.live.max_queue_mb);
  const RecordingSurvey survey = surveyRecording(job, *recording, held);
  FusionMapperOptions& options = job.options.mapper;
  if (job.options.automatic.any()) {
    OptionChoice choice = chooseOptions(job.options.automatic, survey.rig, survey.samples,
                                        survey.duration_s, options);
    const LiveOptions& live = job.options.live;
    const double passed = live.max_event_rate * static_cast<double>(survey.rig.cameras.size());
    const double most = survey.most_events_per_s;
    fitIntoQueue(live, passed > 0 ? std::min(passed, most) : most, options.policy, choice.options);
    job.chosen = std::move(choice.options);
    job.options.automatic = {};
    if (!choice.is_proven) {
      job.doubts.push_back(choice.found_scene
                               ? "the parallax is too small to tell how far the scene is away"
                               : "no scene was found to choose depth limits from");
    }
  }
  PoseVerdict verdict = survey.judgePoses(options);
  printWarnings(verdict.warnings);
  job.warnings.insert(job.warnings.end(), verdict.warnings.begin(), verdict.warnings.end());
  job.doubts.insert(job.doubts.end(), verdict.doubts.begin(), verdict.doubts.end());
  return std::move(held).recording(std::move(recording));
}

std::unique_ptr<Recording> openWhole(RecordingSource source) {
  source.limits = {};
  return openRecording(source);
}

/// "NAME_map" or "NAME_depth" in the working folder, after the first source.
std::filesystem::path outputFolder(const MappingArguments& arguments, OutputKind kind) {
  if (!arguments.out.empty()) return arguments.out;
  std::filesystem::path source = std::filesystem::absolute(arguments.source.files.at(0));
  source = source.lexically_normal();
  if (!source.has_filename()) source = source.parent_path();  // a trailing slash
  const bool is_folder = std::filesystem::is_directory(source);
  const std::string name = (is_folder ? source.filename() : source.stem()).string();
  return name + (kind == OutputKind::kMap ? "_map" : "_depth");
}

/// The recording's files in a form that another run from another folder gets, too.
std::vector<std::string> namesOf(const RecordingSource& source) {
  std::vector<std::string> names;
  for (const std::filesystem::path& file : source.files) {
    names.push_back(std::filesystem::weakly_canonical(file).string());
  }
  return names;
}

/// What this run is going to replace, unless it is a complete result of the same recording.
std::vector<Warning> replacementWarnings(const std::filesystem::path& folder,
                                         const RecordingSource& source) {
  const auto earlier = MapOutput::earlierResult(folder);
  if (!earlier || earlier->keyframes == 0) return {};
  if (earlier->complete && earlier->isOf(namesOf(source))) return {};
  const std::string recording = earlier->recording.empty()
                                    ? "an unknown recording"
                                    : fmt::format("{}", fmt::join(earlier->recording, ", "));
  const std::string text =
      earlier->complete
          ? fmt::format("{} holds the result of {} ({} keyframes): this run replaces it",
                        folder.string(), recording, earlier->keyframes)
          : fmt::format(
                "{} holds {} keyframes of {}, left by a run that did not end: this run replaces "
                "them",
                folder.string(), earlier->keyframes, recording);
  return {{"replaced-result", text}};
}

/// Refuses a folder with an input. One that holds something else than an earlier result of the same
/// kind is probably a mistake.
void refuseOutputFolder(const std::filesystem::path& folder, OutputKind kind,
                        const MappingArguments& arguments, const RecordingSource& source) {
  std::vector<std::filesystem::path> inputs = inputsOf(source);
  if (!arguments.config.empty()) inputs.push_back(findConfig(arguments.config));
  refuseToReplace(folder, inputs);
  std::error_code ignored;
  if (arguments.force || !std::filesystem::is_directory(folder, ignored)) return;
  if (std::filesystem::is_empty(folder)) return;
  if (!MapOutput::earlierResult(folder)) {
    throw std::runtime_error(folder.string() +
                             ": holds other files than a map's: expected a new folder, an empty "
                             "one, one of an earlier result, or --force");
  }
  const bool is_map = kind == OutputKind::kMap;
  if (MapOutput::holdsFilesOf(is_map ? OutputKind::kDepth : OutputKind::kMap, folder)) {
    throw std::runtime_error(fmt::format(
        "{}: holds the result of `{}`: expected another folder, or --force to replace it",
        folder.string(), is_map ? "depth" : "map"));
  }
}

/// Throws a UsageError where an error is about an option that was given.
void refuseOption(const OptionReader& reader, const std::invalid_argument& error) {
  if (const auto wrong = reader.wrongOption(error.what())) throw UsageError(*wrong);
}

/// Runs a job and writes its results.
/// @param kind of the output folder.
/// @param take receives each keyframe, in order, in a thread of its own.
/// @param write writes the results after the last keyframe, if there is one.
int runJob(const MappingArguments& arguments, const OptionReader& reader, MappingJob job,
           OutputKind kind, const std::function<void(MapOutput&, const KeyframeDepthMap&)>& take,
           const std::function<void(MapOutput&, MappingOutcome&)>& write) {
  StageTimes whole;
  whole.cpu.start = processSeconds();
  MappingOutcome outcome;
  std::optional<MapOutput> output;
  std::optional<KeyframePictures> pictures;
  {
    const SecondsScope total(whole.real.total, whole.cpu.total, processSeconds);
    RecordingSource source = sourceOf(arguments, reader, job.options);
    const std::filesystem::path folder = outputFolder(arguments, kind);
    refuseOutputFolder(folder, kind, arguments, source);
    job.warnings = replacementWarnings(folder, source);
    printWarnings(job.warnings);
    std::unique_ptr<Recording> recording;
    try {
      recording = survey(source, job);
    } catch (const std::invalid_argument& error) {
      refuseOption(reader, error);
      throw;
    }
    source = sourceOf(arguments, reader, job.options);  // the stride may have been chosen
    job.sequence_maximum = sequenceMaximumOf(source, job);
    const bool changes = source.faults.perturbation.keyframe.any();  // by the stride
    if (!recording || changes) recording = openRecording(source);
    output.emplace(folder, kind, job.options.mapper.keyframe.planes,
                   arguments.plain_pictures ? PictureStyle::kPlain : PictureStyle::kFigure,
                   namesOf(source));
    pictures.emplace(job.options.mapper.keyframe.planes);
    std::atomic<int> written = 0;
    KeyframeWriter writer([&](const KeyframeDepthMap& keyframe) {
      take(*output, keyframe);
      if (kind == OutputKind::kMap) pictures->add(keyframe.map.depth, keyframe.view_events);
      ++written;
    });
    job.on_keyframe = [&, note = job.on_keyframe](const KeyframeDepthMap& keyframe) {
      if (note) note(keyframe);
      writer.add(keyframe);
    };
    job.processor_clock = [&] { return processSeconds() - writer.cpuSeconds(); };
    try {
      outcome = runMapping(job, *recording);
      writer.finish();
    } catch (const Interrupted&) {
      throw;
    } catch (const std::invalid_argument& error) {
      refuseOption(reader, error);
      throw;
    } catch (const std::runtime_error& error) {
      if (output->keepsEarlier()) throw std::runtime_error(inWords(error) + stays(*output));
      if (written == 0) throw;
      throw std::runtime_error(fmt::format("{}; {} keyframes before it are written to {}",
                                           inWords(error), written.load(), folder.string()));
    }
    whole.cpu.images = writer.cpuSeconds();
    const bool limited = source.limits.t0_ns || source.limits.t1_ns;
    if (outcome.report.counts.keyframes == 0 && limited && !outcome.report.stopped_at) {
      outcome = runMapping(job, *openWhole(source));  // for the error, which says all its times
      writer.finish();  // without an error: the events after the end filled the window
    }
    outcome.report.recording = namesOf(source);
    outcome.report.faults = source.faults;
    warnOfRecalibration(arguments, outcome);
    if (outcome.report.counts.keyframes > 0) write(*output, outcome);
    warnOfNoPoints(outcome.report);
    doubtFewPoints(outcome.report);
    if (outcome.points) warnOfFarPoints(*outcome.points, outcome.report);
  }
  StageTimes& times = outcome.report.times;
  times.real.total = whole.real.total;
  times.cpu.start = whole.cpu.start;
  times.cpu.images = whole.cpu.images;
  times.cpu.total = whole.cpu.start + whole.cpu.total;
  return conclude(outcome, kind, *output, *pictures, arguments, reader);
}

}  // namespace

int runMap(const MapArguments& arguments) {
  const OptionReader reader = readerOf(arguments);
  MappingJob job;
  job.options = optionsOf(arguments, reader);
  job.verbosity = arguments.verbosity;
  job.options.mapper.limits =
      RecordingTimes(sourceOf(arguments, reader, job.options)).resolve(arguments.times);
  asUsage([&] { job.options.mapper.limits.validate(); });
  job.options.mapper.keyframe.view_events = true;  // the page shows them
  const Interruption interruption;
  job.stop_requested = [&] { return interruption.requested(); };
  std::unique_ptr<MapWindow> window;
  if (arguments.view) {
    window = openWindow();
    job.watchers.push_back(window.get());
  }
  std::unique_ptr<MapWatcher> frames;
  if (!arguments.record_frames.empty()) {
    std::vector<std::filesystem::path> inputs = inputsOf(sourceOf(arguments, reader, job.options));
    if (!arguments.config.empty()) inputs.push_back(findConfig(arguments.config));
    refuseToReplace(arguments.record_frames, inputs);
    frames = mrptLibrary("--record-frames").recordFrames(arguments.record_frames, arguments.force);
    job.watchers.push_back(frames.get());
  }
  const bool refined = job.options.refinement.enabled;
  KeyframeSheet sheet;
  const auto take = [&](MapOutput& output, const KeyframeDepthMap& keyframe) {
    output.writeKeyframe(keyframe);
    sheet.add(keyframe.window.t_ref_ns, keyframe.map.depth);
  };
  const auto write = [&](MapOutput& output, MappingOutcome& outcome) {
    const DepthPlanesOptions& limits = outcome.report.options.mapper.keyframe.planes;
    StageTimes& times = outcome.report.times;
    const SecondsScope scope(times.real.map, times.cpu.output);
    writeAll(outcome,
             {[&] { output.writeCloud("map.pcd", *outcome.points); },
              [&] {
                if (!job.options.ply) return;
                output.writeColouredCloud(*outcome.points, upwardOf(outcome.trajectory));
              },
              [&] { writeSimpleMap(output, outcome.keyframes); },
              [&] { output.writeTrajectory("trajectory.txt", outcome.trajectory); },
              [&] {
                if (!refined) return;
                output.writeTrajectory("trajectory_tracker.txt", outcome.tracker_trajectory);
              },
              [&] {
                if (outcome.trajectory.empty()) return;  // nothing to draw
                output.writePicture("map.png", drawMap(*outcome.points, outcome.trajectory,
                                                       outcome.report.options.cloud.voxel_size_m));
                output.writePicture("overview.png", sheet.draw(limits));
              }});
  };
  const int status = runJob(arguments, reader, job, OutputKind::kMap, take, write);
  const bool interactive = isatty(STDIN_FILENO) == 1 && isatty(STDERR_FILENO) == 1;
  if (window && interactive && window->isOpen()) {
    std::cerr << "event-fusion: the window stays until it is closed or a key is pressed in it\n";
    window->wait(job.stop_requested);
  }
  return status;
}

int runDepth(const DepthArguments& arguments) {
  const Interruption interruption;
  const OptionReader reader = readerOf(arguments);
  MappingJob job;
  job.options = optionsOf(arguments, reader);
  job.verbosity = arguments.verbosity;
  job.options.mapper.only_window = windowOf(arguments, sourceOf(arguments, reader, job.options),
                                            job.options.mapper.policy.reference);
  asUsage([&] { job.options.mapper.validate(); });
  const EventFusionOptions options = job.options;
  std::unique_ptr<NpyDsiFile> dsi;
  if (arguments.save_dsi) {
    job.make_dsi_sink = [&](const ReferenceView& view, int num_planes) {
      dsi = std::make_unique<NpyDsiFile>(outputFolder(arguments, OutputKind::kDepth) / "dsi.npy",
                                         num_planes, view);
      return dsi.get();
    };
  }
  bool made = false;
  // A part of the window is no result. A keyframe that is made is written.
  job.on_keyframe = [&](const KeyframeDepthMap&) { made = true; };
  job.stop_requested = [&] {
    if (!made) interruption.check();
    return false;
  };
  MapCloud::ConstPtr points;
  const auto take = [&](MapOutput& output, const KeyframeDepthMap& keyframe) {
    output.writeImages(keyframe);
    const std::vector<CloudPoint> in_world =
        pointsInWorld(options.late_fusion ? lateFusionPoints(keyframe) : viewPoints(keyframe),
                      keyframe.T_world_ref);
    points =
        mapCloudOf(removeOutliers(in_world, options.cloud.outliers), options.cloud.voxel_size_m);
  };
  const auto write = [&](MapOutput& output, MappingOutcome& outcome) {
    describePoints(*points, outcome.report);
    writeAll(outcome, {[&] { output.writeCloud("points.pcd", *points); },
                       [&] {
                         if (dsi) output.add(dsi->finish());
                       }});
  };
  return runJob(arguments, reader, job, OutputKind::kDepth, take, write);
}

}  // namespace efm
