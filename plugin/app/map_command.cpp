// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/app/commands.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
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

/// Returns the recording with the options' calibration and hand-eye transform. The options' stride
/// is the length of tracker noise that is constant over a keyframe.
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
  source.override_rig = false;  // the mapping applies the options
  PosePerturbationOptions& perturbation = source.faults.perturbation;
  perturbation.max_pose_gap_s = options.mapper.trajectory.max_pose_gap_s;
  if (perturbation.keyframe.any() && !perturbation.keyframe.length_ns) {
    perturbation.keyframe.length_ns = durationFromSeconds(options.mapper.policy.stride_s);
  }
  source.limits = options.mapper.interval();
  return source;
}

/// Returns the options with the content of their files, which are read once.
EventFusionOptions optionsOf(const MappingArguments& arguments, const OptionReader& reader) {
  EventFusionOptions options = asUsage([&] { return reader.options(); });
  if (!arguments.source.calibration.empty()) options.rig.calibration = arguments.source.calibration;
  if (!arguments.source.poses.empty()) options.rig.pose_source.clear();  // a single source
  if (!arguments.source.hand_eye.empty()) options.rig.hand_eye = arguments.source.hand_eye;
  options.rig.setup =
      std::make_shared<RigSetup>(readRigSetup(sourceOf(arguments, reader, options)));
  return options;
}

bool isWithoutPoints(const MapReport& report) {
  return report.counts.keyframes > 0 && report.points == 0;
}

void warnOfNoPoints(MapReport& report) {
  if (!isWithoutPoints(report)) return;
  const PixelCounts& pixels = report.pixels;
  const std::uint64_t depths =
      pixels.candidates - pixels.at_nearest - pixels.at_farthest - pixels.ambiguous;
  addWarning(
      report.warnings, "no-points",
      "the map has no point: of {} pixels with contrast, {} fit best to the nearest plane and "
      "{} to the farthest ([dsi] min_depth_m, max_depth_m), {} are ambiguous (the parallax is "
      "small: [keyframes] window_s; [depth] min_quality), and {} with a depth were removed "
      "([map] min_keyframes, outlier_radius_m); or the calibration and the poses do not "
      "explain the events",
      pixels.candidates, pixels.at_nearest, pixels.at_farthest, pixels.ambiguous, depths);
}

void warnOfFarPoints(const MapCloud& cloud, MapReport& report) {
  const auto step_m = coarseStepOf(cloud, report.options.cloud.voxel_size_m);
  if (!step_m) return;
  const auto& origin = cloud.sensor_origin_;
  addWarning(report.warnings, "far-coordinates",
             "a float has steps of {:.2g} m at the map's coordinates, over a tenth of a "
             "voxel: x, y and z of the PCD file are relative to its VIEWPOINT, ({:.0f}, "
             "{:.0f}, {:.0f}), which viewers do not add; MRPT's maps of points are rounded; "
             "map.ply has doubles (--set output.ply=true)",
             *step_m, origin.x(), origin.y(), origin.z());
}

/// Writes map.simplemap. Without MRPT, prints a note instead.
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

/// Opens a window. Only this call loads the library with MRPT's windows.
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

Window windowOf(const DepthArguments& arguments, const RecordingSource& source,
                ReferenceTime reference) {
  RecordingTimes times(source);
  const TimeLimits limits = times.resolve(arguments.times);
  Window window = windowOf(*limits.t0_ns, *limits.t1_ns, reference);
  if (arguments.t_ref) window.t_ref_ns = times.resolve(*arguments.t_ref);
  return window;
}

/// Returns --out or "NAME_map", "NAME_depth" in the working folder, after the first source.
std::filesystem::path outputFolder(const MappingArguments& arguments, OutputKind kind) {
  if (!arguments.out.empty()) return arguments.out;
  std::filesystem::path source = std::filesystem::absolute(arguments.source.files.at(0));
  source = source.lexically_normal();
  if (!source.has_filename()) source = source.parent_path();  // a trailing slash
  const bool is_folder = std::filesystem::is_directory(source);
  const std::string name = (is_folder ? source.filename() : source.stem()).string();
  return name + (kind == OutputKind::kMap ? "_map" : "_depth");
}

/// Returns the recording's files as paths that do not depend on the working folder.
std::vector<std::string> namesOf(const RecordingSource& source) {
  std::vector<std::string> names;
  for (const std::filesystem::path& file : source.files) {
    names.push_back(std::filesystem::weakly_canonical(file).string());
  }
  return names;
}

/// Warns of replacing a result, except a complete result of the same recording.
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

/// Returns all files that a run reads.
std::vector<std::filesystem::path> inputsOf(const MappingArguments& arguments,
                                            const RecordingSource& source) {
  std::vector<std::filesystem::path> inputs = inputsOf(source);
  if (!arguments.config.empty()) inputs.push_back(findConfig(arguments.config));
  return inputs;
}

/// Rejects a folder with an input. A folder with files that do not belong to an earlier result of
/// the same kind is probably a mistake.
void rejectOutputFolder(const std::filesystem::path& folder, OutputKind kind,
                        const MappingArguments& arguments, const RecordingSource& source) {
  rejectReplacing(folder, inputsOf(arguments, source));
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

/// Steps of `map` and `depth` before and after their loop over a recording: the options and the
/// recording, the first look, the folder of the result, its report and the exit status.
class MapCommand {
 public:
  MapCommand(const MappingArguments& given, OutputKind output_kind)
      : arguments(given), kind(output_kind), reader(readerOf(given)) {
    options = optionsOf(arguments, reader);
    first.statistics = RecordingStatistics(statisticsOptions(options));
  }

  const MappingArguments& arguments;
  const OutputKind kind;
  const OptionReader reader;
  const Interruption interruption{};
  EventFusionOptions options;
  FirstPass first;
  std::unique_ptr<Recording> recording;
  std::optional<MapOutput> output;
  MapReport report;

  /// Returns the recording for the options so far: the stride may be chosen later.
  RecordingSource source() const { return sourceOf(arguments, reader, options); }

  /// Checks the folder of the result, takes the first look and opens the recording to map it.
  void begin();
  /// Writes a file of the result. After an error, other files are written all the same.
  void write(const std::function<void()>& file);
  /// Fills in the report, except its points. @return the map.
  std::shared_ptr<const MapSnapshot> describe(MappingRun& run, bool stopped);
  /// Warns if the map has no points, few points, or points too far away for floats.
  void judgePoints(const MapCloud& points);
  /// Ends the measured time of the mapping and its files.
  void endTimes(const KeyframeWriter& writer);
  /// Writes the report, and prints the warnings, the summary and the error.
  /// @return the exit status.
  int writeReport(std::optional<UserError> error);
  /// Throws the current error again, as text for the user; called within a handler.
  /// @param written number of keyframes in the folder.
  [[noreturn]] void rethrow(int written) const;

 private:
  std::unique_ptr<Recording> firstLook();
  std::optional<double> sequenceMaximum();
  std::string stays() const;

  std::size_t printed_warnings_ = 0;
  std::optional<UserError> write_error_;
  const double start_cpu_s_ = processSeconds();
  std::chrono::steady_clock::time_point began_;
};

void MapCommand::begin() {
  began_ = std::chrono::steady_clock::now();
  const std::filesystem::path folder = outputFolder(arguments, kind);
  const RecordingSource all = source();
  rejectOutputFolder(folder, kind, arguments, all);
  report.warnings = replacementWarnings(folder, all);
  printWarnings(report.warnings);
  recording = firstLook();
  options.mapper.keyframe.sequence_maximum = sequenceMaximum();
  const bool changes = source().faults.perturbation.keyframe.any();  // by the chosen stride
  if (!recording || changes) recording = openRecording(source());
  interruption.check();
  output.emplace(folder, kind, options.mapper.keyframe.planes,
                 arguments.plain_pictures ? PictureStyle::kPlain : PictureStyle::kFigure,
                 namesOf(all));
  printed_warnings_ = report.warnings.size();
}

/// Chooses the automatic options, and warns of poses that do not explain the events.
/// @return the recording again, if its events fit into `[live] max_queue_mb`; otherwise null.
std::unique_ptr<Recording> MapCommand::firstLook() {
  auto held = std::make_unique<HeldRecording>(openRecording(source()), options.live.max_queue_mb);
  FirstLook look(options);
  Progress progress("first look", arguments.verbosity);
  std::exception_ptr damage;  // the mapping reports it
  const auto next = [&]() -> std::optional<Sample> {
    interruption.check();
    try {
      return held->read().next();
    } catch (const std::exception&) {
      damage = std::current_exception();
      return std::nullopt;
    }
  };
  bool takes = true;  // the mapping reports rejected samples
  std::optional<Sample> sample;
  while ((takes || options.live.enabled) && (sample = next())) {
    takes = look.take(*sample);
    if (const auto* packet = std::get_if<EventPacket>(&*sample))
      first.statistics.addEvents(*packet);
    held->hold(std::move(*sample));
    progress.show(held->read().progress());
  }
  if (takes) held->end(damage);
  const RecordingSurvey survey = look.finish();
  if (options.automatic.any()) {
    OptionChoice choice = chooseOptions(options.automatic, survey.rig, survey.samples,
                                        survey.duration_s, options.mapper);
    const double passed =
        options.live.max_event_rate * static_cast<double>(survey.rig.cameras.size());
    const double most = survey.most_events_per_s;
    fitIntoQueue(options.live, passed > 0 ? std::min(passed, most) : most, options.mapper.policy,
                 choice.options);
    first.chosen = std::move(choice.options);
    options.automatic = {};
    if (!choice.is_proven) {
      report.doubts.push_back(choice.found_scene
                                  ? "the parallax is too small to tell how far the scene is away"
                                  : "no scene was found to choose depth limits from");
    }
  }
  PoseVerdict verdict = survey.judgePoses(options.mapper);
  printWarnings(verdict.warnings);
  append(report.warnings, std::move(verdict.warnings));
  append(report.doubts, std::move(verdict.doubts));
  if (!held->isWhole()) return nullptr;
  return held;
}

/// Passes over the recording for max_confidence = sequence: the robust maximum of the keyframes'
/// confidences. It costs as much as the mapping. @return std::nullopt if there is no keyframe.
std::optional<double> MapCommand::sequenceMaximum() {
  if (options.mapper.keyframe.extraction.max_confidence.level != WhiteLevel::kSequence) {
    return std::nullopt;
  }
  EventFusionOptions of_pass = options;
  of_pass.mapper.only_window.reset();
  of_pass.refinement.enabled = false;  // changes no confidence
  of_pass.live.enabled = false;
  RobustMaximum maximum;
  const std::unique_ptr<Recording> all = openRecording(source());
  MappingRun pass(
      *all, of_pass, first, std::min(arguments.verbosity, Verbosity::kNormal),
      [&](const KeyframeDepthMap& keyframe, const MappingRun&) {
        maximum.add(keyframe.max_confidence);
      },
      "first pass");
  while (pass.mapNext()) interruption.check();
  pass.finish();  // the mapping reports its error
  return maximum.value();
}

void MapCommand::write(const std::function<void()>& file) {
  try {
    file();
  } catch (const std::exception& error) {
    if (!write_error_) write_error_ = userError(error);
  }
}

std::shared_ptr<const MapSnapshot> MapCommand::describe(MappingRun& run, bool stopped) {
  run.describe(report, stopped);
  report.recording = namesOf(arguments.source);
  report.faults = source().faults;
  const std::string calibration = options.rig.calibration.string();
  // The recording's own calibration may be the better one. --calibration is intended.
  if (run.mapper().status().recalibrated_cameras > 0 && arguments.source.calibration.empty()) {
    report.warnings.push_back({"calibration-replaced",
                               calibration + " replaced another calibration, the recording's own; "
                                             "--set rig.calibration= keeps that"});
  }
  std::shared_ptr<const MapSnapshot> map;
  {
    const SecondsScope scope(report.times.real.map, report.times.cpu.output);
    map = run.mapper().snapshot();
  }
  describePoints(*map->points, report);
  if (report.refinement && !map->trajectory.empty()) {
    report.pose_shift = shiftBetween(map->tracker_trajectory, map->trajectory);
  }
  return map;
}

void MapCommand::judgePoints(const MapCloud& points) {
  warnOfNoPoints(report);
  constexpr std::uint64_t kFewPoints = 200;  // fewer are little evidence, even if each is sure
  if (report.points < kFewPoints && report.counts.keyframes > 0) {
    report.doubts.push_back(fmt::format("the map has {} points", report.points));
  }
  warnOfFarPoints(points, report);
}

void MapCommand::endTimes(const KeyframeWriter& writer) {
  StageTimes& times = report.times;
  times.real.total =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - began_).count();
  times.cpu.start = start_cpu_s_;
  times.cpu.images = writer.cpuSeconds();
  times.cpu.total = processSeconds();
}

std::string MapCommand::stays() const {
  return fmt::format("; the earlier result in {} stays", output->folder().string());
}

int MapCommand::writeReport(std::optional<UserError> error) {
  if (!error) error = write_error_;
  report.peak_memory_bytes = peakMemoryBytes();
  // The result of an earlier run stays if this run has no keyframe or cannot write a file.
  const bool replaces = report.counts.keyframes > 0 && !(output->keepsEarlier() && write_error_);
  if (replaces || !std::filesystem::exists(output->folder() / "report.json")) {
    write([&] { output->writeReport(reportJson(report)); });
    if (!error) error = write_error_;
  }
  if (output->keepsEarlier() && error) error->add(stays());
  printWarnings({report.warnings.begin() + static_cast<std::ptrdiff_t>(printed_warnings_),
                 report.warnings.end()});
  const bool quiet = arguments.verbosity == Verbosity::kQuiet;
  if (report.counts.keyframes > 0 && !quiet && !output->keepsEarlier()) {
    std::cout << summaryOf(report, kind, output->folder());
  }
  if (error) {
    const auto wrong = error->wrong ? reader.wrongOption(*error->wrong) : std::nullopt;
    if (wrong) return fail(*wrong + error->more, kUsageStatus);
    return fail(error->text + reader.origins(error->options));
  }
  if (report.stopped_at) {
    std::cerr << fmt::format("event-fusion: stopped at {:.0f} % of the recording\n",
                             100 * *report.stopped_at);
    return kInterruptedStatus;
  }
  const bool strict = arguments.strict && failStrictly(report.warnings);
  if (isWithoutPoints(report)) return fail("the map has no point; its files are written");
  return strict ? kFailedStatus : 0;
}

void MapCommand::rethrow(int written) const {
  try {
    throw;
  } catch (const Interrupted&) {
    throw;
  } catch (const OptionError& error) {
    if (const auto wrong = reader.wrongOption(error)) throw UsageError(*wrong);
    throw;
  } catch (const std::runtime_error& error) {
    if (output && output->keepsEarlier()) throw std::runtime_error(userMessage(error) + stays());
    if (written == 0) throw;
    throw std::runtime_error(fmt::format("{}; {} keyframes before it are written to {}",
                                         userMessage(error), written, output->folder().string()));
  }
}

/// Watchers of the map after each keyframe: a window, and a folder of frames.
class Watchers {
 public:
  Watchers(const MapArguments& arguments, const MapCommand& command) {
    if (arguments.view) all_.push_back(window_ = openWindow());
    if (arguments.record_frames.empty()) return;
    rejectReplacing(arguments.record_frames, inputsOf(arguments, command.source()));
    all_.push_back(
        mrptLibrary("--record-frames").recordFrames(arguments.record_frames, arguments.force));
  }

  void add(const MappingRun& run, const KeyframeDepthMap& keyframe) {
    if (!all_.empty()) newest_ = keyframe;
    show(run, false);
  }
  void show(const MappingRun& run, bool is_last) {
    if (!newest_) return;
    const double start_s = run.seconds();
    for (const auto& watcher : all_) {
      if (watcher->due(is_last)) watcher->show(run.watched(*newest_, watched_s_));
    }
    watched_s_ += run.seconds() - start_s;
  }
  /// Keeps the window until the user closes it, if there is a user.
  void wait(const Interruption& interruption) {
    const bool interactive = isatty(STDIN_FILENO) == 1 && isatty(STDERR_FILENO) == 1;
    if (!window_ || !interactive || !window_->isOpen()) return;
    std::cerr << "event-fusion: the window stays until it is closed or a key is pressed in it\n";
    window_->wait([&] { return interruption.requested(); });
  }

 private:
  std::vector<std::shared_ptr<MapWatcher>> all_;
  std::shared_ptr<MapWindow> window_;
  std::optional<KeyframeDepthMap> newest_;
  double watched_s_ = 0;
};

/// Opens the file of the whole DSI; null if it is not asked for.
std::unique_ptr<NpyDsiFile> dsiFile(const MapCommand& command, const DepthArguments& arguments) {
  const KeyframeMapperOptions& keyframe = command.options.mapper.keyframe;
  const auto reference = static_cast<std::size_t>(keyframe.reference_camera);
  const std::vector<RigCamera>& cameras = command.recording->rig().cameras;
  if (!arguments.save_dsi || reference >= cameras.size()) return nullptr;
  return std::make_unique<NpyDsiFile>(command.output->folder() / "dsi.npy",
                                      keyframe.planes.num_planes,
                                      makeReferenceView(cameras[reference].model, keyframe.view));
}

/// Writes the files of a map, except its page and its report.
void writeMap(MapCommand& command, const MapSnapshot& map, const KeyframeSheet& sheet) {
  MapOutput& output = *command.output;
  const EventFusionOptions& options = command.options;
  StageTimes& times = command.report.times;
  const SecondsScope scope(times.real.map, times.cpu.output);
  command.write([&] { output.writeCloud("map.pcd", *map.points); });
  if (options.ply) {
    command.write([&] { output.writeColouredCloud(*map.points, upwardOf(map.trajectory)); });
  }
  command.write([&] { writeSimpleMap(output, map.keyframes); });
  command.write([&] { output.writeTrajectory("trajectory.txt", map.trajectory); });
  if (options.refinement.enabled) {
    command.write(
        [&] { output.writeTrajectory("trajectory_tracker.txt", map.tracker_trajectory); });
  }
  command.write([&] {
    output.writePicture("map.png",
                        drawMap(*map.points, map.trajectory, options.cloud.voxel_size_m));
    output.writePicture("overview.png", sheet.draw(options.mapper.keyframe.planes));
  });
}

/// Writes map.html, which shows the report, and adds the time to the report.
void writePage(MapCommand& command, const MapSnapshot& map, const KeyframePictures& pictures) {
  MapReport& report = command.report;
  double real_s = 0, cpu_s = 0;
  report.peak_memory_bytes = peakMemoryBytes();
  {
    const SecondsScope scope(real_s, cpu_s);
    MapOutput& output = *command.output;
    const std::filesystem::path folder = std::filesystem::absolute(output.folder() / "");
    const MapPage page = {folder.lexically_normal().parent_path().filename().string(),
                          *map.points,
                          report.options.cloud.voxel_size_m,
                          map.trajectory,
                          pictures,
                          report.view,
                          reportJson(report)};
    command.write([&] { output.writePage([&](std::ostream& file) { writeMapPage(file, page); }); });
  }
  report.times.real.map += real_s;
  report.times.real.total += real_s;
  report.times.cpu.output += cpu_s;
  report.times.cpu.total += cpu_s;
}

}  // namespace

int runMap(const MapArguments& arguments) {
  MapCommand command(arguments, OutputKind::kMap);
  FusionMapperOptions& options = command.options.mapper;
  options.limits = RecordingTimes(command.source()).resolve(arguments.times);
  asUsage([&] { options.limits.validate(); });
  options.keyframe.view_events = true;  // the page shows them
  Watchers watchers(arguments, command);
  std::atomic<int> written = 0;
  try {
    command.begin();
    KeyframeSheet sheet;
    KeyframePictures pictures(options.keyframe.planes);
    KeyframeWriter writer([&](const KeyframeDepthMap& keyframe) {
      command.output->writeKeyframe(keyframe);
      sheet.add(keyframe.window.t_ref_ns, keyframe.map.depth);
      pictures.add(keyframe.map.depth, keyframe.view_events);
      ++written;
    });
    MappingRun run(*command.recording, command.options, std::move(command.first),
                   arguments.verbosity,
                   [&](const KeyframeDepthMap& keyframe, const MappingRun& so_far) {
                     writer.add(keyframe);
                     watchers.add(so_far, keyframe);
                   });
    run.mapper().setClock([&] { return processSeconds() - writer.cpuSeconds(); });
    bool stopped = false;
    while (!(stopped = command.interruption.requested()) && run.mapNext()) {
    }
    run.finish();
    watchers.show(run, true);
    writer.finish();

    const auto map = command.describe(run, stopped);
    const bool has_keyframes = command.report.counts.keyframes > 0;
    if (has_keyframes) writeMap(command, *map, sheet);
    command.judgePoints(*map->points);
    command.endTimes(writer);
    if (has_keyframes) writePage(command, *map, pictures);
    const int status = command.writeReport(run.error());
    watchers.wait(command.interruption);
    return status;
  } catch (...) {
    command.rethrow(written);
  }
}

int runDepth(const DepthArguments& arguments) {
  MapCommand command(arguments, OutputKind::kDepth);
  EventFusionOptions& options = command.options;
  options.mapper.only_window =
      windowOf(arguments, command.source(), options.mapper.policy.reference);
  asUsage([&] { options.mapper.validate(); });
  std::atomic<int> written = 0;
  try {
    command.begin();
    MapCloud::ConstPtr points;
    KeyframeWriter writer([&](const KeyframeDepthMap& keyframe) {
      command.output->writeImages(keyframe);
      const std::vector<CloudPoint> in_world =
          pointsInWorld(options.late_fusion ? lateFusionPoints(keyframe) : viewPoints(keyframe),
                        keyframe.T_world_ref);
      points =
          mapCloudOf(removeOutliers(in_world, options.cloud.outliers), options.cloud.voxel_size_m);
      ++written;
    });
    const std::unique_ptr<NpyDsiFile> dsi = dsiFile(command, arguments);  // outlives the run
    bool made = false;
    MappingRun run(*command.recording, options, std::move(command.first), arguments.verbosity,
                   [&](const KeyframeDepthMap& keyframe, const MappingRun&) {
                     made = true;
                     writer.add(keyframe);
                   });
    run.mapper().setClock([&] { return processSeconds() - writer.cpuSeconds(); });
    run.mapper().setSink(dsi.get());
    while (run.mapNext()) {  // without its keyframe, a window has no result
      if (!made) command.interruption.check();
    }
    run.finish();
    writer.finish();

    const auto map = command.describe(run, false);
    if (points) {
      describePoints(*points, command.report);
      command.write([&] { command.output->writeCloud("points.pcd", *points); });
      if (dsi) command.write([&] { command.output->add(dsi->finish()); });
    }
    command.judgePoints(*map->points);
    command.endTimes(writer);
    return command.writeReport(run.error());
  } catch (...) {
    command.rethrow(written);
  }
}

}  // namespace efm
