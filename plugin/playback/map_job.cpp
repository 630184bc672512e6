// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/playback/map_job.h"

#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "mapping/geometry/timestamp.h"
#include "maps/cloud/cloud_points.h"
#include "maps/cloud/keyframe_cloud.h"
#include "plugin/playback/output_checks.h"
#include "plugin/recordings/open/mrpt_library.h"
#include "plugin/results/output/keyframe_writer.h"
#include "plugin/results/pictures/depth_picture.h"
#include "plugin/results/pictures/map_picture.h"
#include "plugin/results/pictures/picture.h"
#include "plugin/results/viewer/map_page.h"
#include "plugin/session/first_look.h"
#include "plugin/session/host_text.h"
#include "plugin/session/mapper_driver.h"

namespace efm {

void MapResult::rejectError() const {
  if (error && error->wrong) throw std::invalid_argument(error->text);
  if (error) throw std::runtime_error(error->text);
}

MapJob MapJob::of(RecordingSource source, const Options& options) {
  MapJob job;
  job.source = std::move(source);
  job.options = options.values();
  job.options.mapper.limits = job.source.limits;
  job.prepare();
  return job;
}

RecordingSource MapJob::sourceNow() const {
  RecordingSource now = source;
  now.calibration = options.rig.calibration;
  now.hand_eye = options.rig.hand_eye;
  if (!options.mapper.cameras.empty()) now.cameras = options.mapper.cameras;
  now.time_offsets_ns = options.rig.time_offsets_ns;
  PosePerturbationOptions& perturbation = now.faults.perturbation;
  perturbation.max_pose_gap_s = options.mapper.trajectory.max_pose_gap_s;
  if (perturbation.keyframe.any() && !perturbation.keyframe.length_ns) {
    perturbation.keyframe.length_ns = durationFromSeconds(options.mapper.policy.stride_s);
  }
  now.limits = options.mapper.interval();
  return now;
}

std::vector<std::filesystem::path> MapJob::allInputs() const {
  std::vector<std::filesystem::path> all = inputsOf(sourceNow());
  all.insert(all.end(), inputs.begin(), inputs.end());
  return all;
}

void MapJob::prepare() {
  source.reader.scan = std::make_shared<std::any>();  // a long recording is opened twice
  if (!source.calibration.empty()) options.rig.calibration = source.calibration;
  if (!source.poses.empty()) options.rig.pose_source.clear();  // a single source
  if (!source.hand_eye.empty()) options.rig.hand_eye = source.hand_eye;
  source.setup = std::make_shared<RigSetup>(readRigSetup(sourceNow()));
}

namespace {

void warnOfNoPoints(MapReport& report) {
  if (report.counts.keyframes == 0 || report.points > 0) return;
  const PixelCounts& pixels = report.pixels;
  const std::uint64_t depths = pixels.candidates - pixels.at_nearest - pixels.at_farthest -
                               pixels.ambiguous + pixels.neighbours;
  addWarning(
      report.warnings, "no-points",
      "the map has no point: of {} pixels with contrast, {} fit best to the nearest plane and "
      "{} to the farthest ([dsi] min_depth_m, max_depth_m), {} are ambiguous (the parallax is "
      "small: [keyframes] window_s; [depth] min_probability), and {} with a depth were removed "
      "([map] min_keyframes, outlier_radius_m); or the calibration and the poses do not "
      "explain the events",
      pixels.candidates, pixels.at_nearest, pixels.at_farthest, pixels.ambiguous, depths);
}

/// Writes map.simplemap. Without MRPT, gives a note instead.
void writeSimpleMap(const MapJob& job, MapOutput& output,
                    const std::vector<StoredKeyframe>& keyframes) {
  const MrptLibrary* library = nullptr;
  try {
    library = &mrptLibrary("map.simplemap");
  } catch (const std::runtime_error& error) {
    if (job.note) job.note(std::string(error.what()) + "; the file is left out");
    return;
  }
  output.writeFile("map.simplemap", [&](const std::filesystem::path& file) {
    library->writeSimpleMap(file, keyframes);
  });
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

/// Rejects a folder with an input. A folder with files that do not belong to an earlier result of
/// the same kind is probably a mistake.
void rejectOutputFolder(const MapJob& job, OutputKind kind) {
  const std::filesystem::path& folder = job.out;
  rejectReplacing(folder, job.allInputs());
  std::error_code ignored;
  if (job.force || !std::filesystem::is_directory(folder, ignored)) return;
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

/// Steps of a job before and after its loop over the recording: the first look, the folder of the
/// result and its report.
class MapSteps {
 public:
  MapSteps(MapJob given, OutputKind output_kind)
      : job(std::move(given)), kind(output_kind), options(job.options) {}

  MapJob job;
  const OutputKind kind;
  EventFusionOptions& options;
  FirstPass first;
  std::unique_ptr<Recording> recording;
  std::optional<MapOutput> output;  // none if no file is written
  MapReport report;
  std::shared_ptr<const MapSnapshot> map;

  /// Returns whether the caller asks for the end.
  bool asksToStop() const { return job.stop && job.stop(); }
  void requireNoStop() const {
    if (asksToStop()) throw Interrupted();
  }
  /// Checks the folder of the result, takes the first look and opens the recording to map it.
  void begin();
  /// Writes a file of the result. After an error, other files are written all the same.
  void write(const std::function<void()>& file);
  void tellProgress(const char* activity, double fraction) const {
    if (job.on_progress) job.on_progress(activity, fraction);
  }
  /// Takes the map, and fills in the report, except its points.
  void describe(MappingRun& run, bool stopped);
  /// Warns if the map has no points, few points, or points too far away for floats.
  void judgePoints(const MapCloud& points);
  /// Ends the measured time of the mapping and its files.
  void endTimes(const KeyframeWriter& writer);
  /// Writes the report, and reports the last warnings.
  MapResult end(std::optional<UserError> error);
  /// Throws the current error again, as text for the user; called within a handler.
  /// @param written number of keyframes in the folder.
  [[noreturn]] void rethrow(int written) const;

 private:
  std::unique_ptr<Recording> firstLook();
  std::optional<double> sequenceMaximum();
  std::string stays() const;
  void warnOfNew();

  std::size_t reported_warnings_ = 0;
  std::optional<UserError> write_error_;
  const double start_cpu_s_ = processSeconds();
  std::chrono::steady_clock::time_point began_;
};

/// Reports the warnings since the last call.
void MapSteps::warnOfNew() {
  const auto from =
      static_cast<std::ptrdiff_t>(std::exchange(reported_warnings_, report.warnings.size()));
  if (job.warn) job.warn({report.warnings.begin() + from, report.warnings.end()});
}

void MapSteps::begin() {
  began_ = std::chrono::steady_clock::now();
  const RecordingSource all = job.sourceNow();
  if (!job.out.empty()) rejectOutputFolder(job, kind);
  recording = firstLook();
  options.mapper.keyframe.sequence_maximum = sequenceMaximum();
  const bool changes = job.sourceNow().faults.perturbation.keyframe.any();  // by the chosen stride
  if (!recording || changes) recording = openRecording(job.sourceNow());
  requireNoStop();
  if (job.out.empty()) return;
  output.emplace(job.out, kind, options.mapper.keyframe.planes,
                 job.plain_pictures ? PictureStyle::kPlain : PictureStyle::kFigure, namesOf(all));
}

/// Chooses the automatic options, and warns of poses that do not explain the events.
/// @return the recording again, if its events fit into `[live] max_queue_mb`; otherwise null.
std::unique_ptr<Recording> MapSteps::firstLook() {
  auto held =
      std::make_unique<HeldRecording>(openRecording(job.sourceNow()), options.live.max_queue_mb);
  if (!job.out.empty()) {  // a recording that cannot be opened replaces nothing
    report.warnings = replacementWarnings(job.out, job.sourceNow());
    warnOfNew();
  }
  Recording& source = held->source();
  if (std::vector<int> chosen = source.counts().of_calibration; !chosen.empty()) {
    job.source.cameras = std::move(chosen);  // they are all cameras of the recording
    options.mapper.cameras.clear();
  }
  first.statistics = RecordingStatistics(statisticsOptions(options));
  first.statistics.setCameras(source.rig(), source.cameras());
  FirstLook look(options);
  Progress progress("first look", job.verbosity);
  const auto next = [&] {
    requireNoStop();
    return source.read();  // the mapping reports damage
  };
  bool takes = look.take(source.rig());  // the mapping reports rejected samples
  std::optional<Sample> sample;
  while ((takes || options.live.enabled) && (sample = next())) {
    takes = look.take(*sample);
    if (const auto* packet = std::get_if<EventPacket>(&*sample))
      first.statistics.addEvents(*packet);
    held->hold(std::move(*sample));
    progress.show(source.progress());
    tellProgress("first look", source.progress());
  }
  if (takes) held->end();
  const RecordingSurvey survey = look.finish();
  auto [mapper, choice, verdict] = choose(survey, options, true);
  options.mapper = std::move(mapper);
  if (options.automatic.any()) {
    first.chosen = std::move(choice.options);
    options.cloud.voxel_size_m = choice.voxel_size_m.value_or(options.cloud.voxel_size_m);
    options.automatic = {};
    if (!choice.is_proven) {
      first.quality.doubts.push_back(
          choice.found_scene ? "the parallax is too small to tell how far the scene is away"
                             : "no scene was found to choose depth limits from");
    }
  }
  append(report.warnings, std::move(verdict.warnings));
  warnOfNew();
  verdict.notes = source.counts().notes;  // the quality says what could not be checked
  for (const Warning& note : verdict.notes) {
    if (job.note) job.note(note.name + ": " + note.text);
  }
  report.notes = std::move(verdict.notes);
  append(verdict.quality.doubts, std::move(first.quality.doubts));
  first.quality = std::move(verdict.quality);
  if (!held->isWhole()) return nullptr;
  return held;
}

/// Passes over the recording for max_confidence = sequence: the robust maximum of the keyframes'
/// confidences. It costs as much as the mapping. @return std::nullopt if there is no keyframe.
std::optional<double> MapSteps::sequenceMaximum() {
  if (options.mapper.keyframe.extraction.max_confidence.level != WhiteLevel::kSequence) {
    return std::nullopt;
  }
  EventFusionOptions of_pass = options;
  of_pass.mapper.only_window.reset();
  of_pass.refinement.enabled = false;  // changes no confidence
  of_pass.live.enabled = false;
  RobustMaximum maximum;
  const std::unique_ptr<Recording> all = openRecording(job.sourceNow());
  MappingRun pass(
      *all, of_pass, first, std::min(job.verbosity, Verbosity::kNormal),
      [&](const KeyframeDepthMap& keyframe, const MappingRun&) {
        maximum.add(keyframe.max_confidence);
      },
      "first pass");
  while (pass.mapNext()) {
    requireNoStop();
    tellProgress("first pass", pass.fraction());
  }
  pass.finish();  // the mapping reports its error
  return maximum.value();
}

void MapSteps::write(const std::function<void()>& file) {
  try {
    file();
  } catch (const std::exception& error) {
    if (!write_error_) write_error_ = userError(error);
  }
}

void MapSteps::describe(MappingRun& run, bool stopped) {
  run.describe(report, stopped);
  const RecordingCounts counts = recording->counts();
  if (!counts.of_calibration.empty()) report.options.mapper.cameras = counts.of_calibration;
  report.recording = namesOf(job.source);
  report.faults = job.sourceNow().faults;
  const std::string calibration = options.rig.calibration.string();
  // The recording's own calibration may be the better one. --calibration is intended.
  if (counts.recalibrated && job.source.calibration.empty()) {
    report.warnings.push_back({"calibration-replaced",
                               calibration + " replaced another calibration, the recording's own; "
                                             "--set rig.calibration= keeps that"});
  }
  {
    const SecondsScope scope(report.times.real.map, report.times.cpu.output);
    map = run.mapper().snapshot();
  }
  describePoints(*map->points, report);
  if (report.refinement && !map->trajectory.empty()) {
    report.pose_shift = shiftBetween(map->tracker_trajectory, map->trajectory);
  }
}

void MapSteps::judgePoints(const MapCloud& points) {
  warnOfNoPoints(report);
  if (auto warning = farPointsWarning(points, report.options.cloud.voxel_size_m)) {
    report.warnings.push_back(std::move(*warning));
  }
}

void MapSteps::endTimes(const KeyframeWriter& writer) {
  StageTimes& times = report.times;
  times.real.total =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - began_).count();
  times.cpu.start = start_cpu_s_;
  times.cpu.images = writer.cpuSeconds();
  times.cpu.total = processSeconds();
}

std::string MapSteps::stays() const {
  return fmt::format("; the earlier result in {} stays", output->folder().string());
}

MapResult MapSteps::end(std::optional<UserError> error) {
  if (!error) error = write_error_;
  report.peak_memory_bytes = peakMemoryBytes();
  if (!output) {
    warnOfNew();
    return {std::move(report), std::move(map), std::move(error)};
  }
  // The result of an earlier run stays if this run has no keyframe or cannot write a file.
  const bool replaces = report.counts.keyframes > 0 && !(output->keepsEarlier() && write_error_);
  if (replaces || !std::filesystem::exists(output->folder() / "report.json")) {
    write([&] { output->writeReport(reportJson(report)); });
    if (!error) error = write_error_;
  }
  if (output->keepsEarlier() && error) error->add(stays());
  warnOfNew();
  return {std::move(report), std::move(map), std::move(error), output->keepsEarlier()};
}

void MapSteps::rethrow(int written) const {
  try {
    throw;
  } catch (const Interrupted&) {
    throw;
  } catch (const std::runtime_error& error) {
    if (output && output->keepsEarlier()) throw std::runtime_error(userMessage(error) + stays());
    if (written == 0 || !output) throw;
    throw std::runtime_error(fmt::format("{}; {} keyframes before it are written to {}",
                                         userMessage(error), written, output->folder().string()));
  }
}

/// Gives the whole DSI to the job and to a file, if they ask for it.
class DsiReceiver : public DsiSink {
 public:
  explicit DsiReceiver(const MapSteps& steps)
      : on_plane_(steps.job.on_dsi_plane),
        num_planes_(steps.options.mapper.keyframe.planes.num_planes) {
    const KeyframeMapperOptions& keyframe = steps.options.mapper.keyframe;
    const auto reference = static_cast<std::size_t>(keyframe.reference_camera);
    const std::vector<RigCamera>& cameras = steps.recording->rig().cameras;
    if (reference >= cameras.size()) return;  // the mapping rejects it
    const ReferenceView view = makeReferenceView(cameras[reference].model, keyframe.view);
    size_ = {view.width, view.height};
    if (!steps.job.save_dsi || !steps.output) return;
    file_ = std::make_unique<NpyDsiFile>(steps.output->folder() / "dsi.npy", num_planes_, view);
  }

  bool receives() const { return file_ || on_plane_; }
  NpyDsiFile* file() const { return file_.get(); }
  void addPlane(int plane, const float* values) override {
    if (file_) file_->addPlane(plane, values);
    if (on_plane_)
      on_plane_(plane, num_planes_,
                cv::Mat1f(size_.height, size_.width, const_cast<float*>(values)));
  }

 private:
  std::function<void(int, int, const cv::Mat1f&)> on_plane_;
  int num_planes_;
  cv::Size size_;
  std::unique_ptr<NpyDsiFile> file_;
};

/// Writes the files of a map, except its page and its report.
void writeMap(MapSteps& steps, const KeyframeSheet& sheet) {
  const MapSnapshot& map = *steps.map;
  MapOutput& output = *steps.output;
  const EventFusionOptions& options = steps.options;
  StageTimes& times = steps.report.times;
  const SecondsScope scope(times.real.map, times.cpu.output);
  steps.write([&] { output.writeCloud("map.pcd", *map.points); });
  if (options.ply) {
    steps.write(
        [&] { output.writeColouredCloud(*map.points, upwardOf(map.trajectory), map.trajectory); });
  }
  steps.write([&] { writeSimpleMap(steps.job, output, map.keyframes); });
  steps.write([&] { output.writeTrajectory("trajectory.txt", map.trajectory); });
  if (options.refinement.enabled) {
    steps.write([&] { output.writeTrajectory("trajectory_tracker.txt", map.tracker_trajectory); });
  }
  steps.write([&] {
    output.writePicture("map.png",
                        drawMap(*map.points, map.trajectory, options.cloud.voxel_size_m));
    output.writePicture("overview.png", sheet.draw(options.mapper.keyframe.planes));
  });
}

/// Writes map.html, which shows the report, and adds the time to the report.
void writePage(MapSteps& steps, const KeyframePictures& pictures) {
  const MapSnapshot& map = *steps.map;
  MapReport& report = steps.report;
  double real_s = 0, cpu_s = 0;
  report.peak_memory_bytes = peakMemoryBytes();
  {
    const SecondsScope scope(real_s, cpu_s);
    MapOutput& output = *steps.output;
    const std::filesystem::path folder = std::filesystem::absolute(output.folder() / "");
    const MapPage page = {folder.lexically_normal().parent_path().filename().string(),
                          *map.points,
                          report.options.cloud.voxel_size_m,
                          map.trajectory,
                          pictures,
                          report.view,
                          reportJson(report)};
    steps.write([&] { output.writePage([&](std::ostream& file) { writeMapPage(file, page); }); });
  }
  report.times.real.map += real_s;
  report.times.real.total += real_s;
  report.times.cpu.output += cpu_s;
  report.times.cpu.total += cpu_s;
}

}  // namespace

MapResult mapInto(MapJob job) {
  MapSteps steps(std::move(job), OutputKind::kMap);
  const bool writes = !steps.job.out.empty();
  steps.options.mapper.keyframe.view_events = writes;  // the page shows them
  std::atomic<int> written = 0;
  try {
    steps.begin();
    KeyframeSheet sheet;
    KeyframePictures pictures(steps.options.mapper.keyframe.planes);
    KeyframeWriter writer([&](const KeyframeDepthMap& keyframe) {
      steps.output->writeKeyframe(keyframe);
      sheet.add(keyframe.window.t_ref_ns, keyframe.map.depth);
      pictures.add(keyframe.map.depth, keyframe.view_events);
      ++written;
    });
    MappingRun run(*steps.recording, steps.options, std::move(steps.first), steps.job.verbosity,
                   [&](const KeyframeDepthMap& keyframe, const MappingRun& so_far) {
                     if (writes) writer.add(keyframe);
                     if (steps.job.on_keyframe) steps.job.on_keyframe(keyframe, so_far);
                   });
    run.mapper().driver().setClock([&] { return processSeconds() - writer.cpuSeconds(); });
    bool stopped = false;
    while (!(stopped = steps.asksToStop()) && run.mapNext()) {
      steps.tellProgress("mapping", run.fraction());
    }
    run.finish();
    if (steps.job.on_last_keyframe) steps.job.on_last_keyframe(run);
    writer.finish();

    steps.describe(run, stopped);
    const bool has_files = writes && steps.report.counts.keyframes > 0;
    if (has_files) writeMap(steps, sheet);
    steps.judgePoints(*steps.map->points);
    steps.endTimes(writer);
    if (has_files) writePage(steps, pictures);
    return steps.end(run.error());
  } catch (...) {
    steps.rethrow(written);
  }
}

MapResult mapWindowInto(MapJob job) {
  MapSteps steps(std::move(job), OutputKind::kDepth);
  EventFusionOptions& options = steps.options;
  std::atomic<int> written = 0;
  try {
    steps.begin();
    MapCloud::ConstPtr points;
    KeyframeWriter writer([&](const KeyframeDepthMap& keyframe) {
      if (steps.output) steps.output->writeImages(keyframe);
      const std::vector<CloudPoint> in_world =
          pointsInWorld(options.late_fusion ? lateFusionPoints(keyframe) : viewPoints(keyframe),
                        keyframe.T_world_ref);
      points =
          mapCloudOf(removeOutliers(in_world, options.cloud.outliers), options.cloud.voxel_size_m);
      ++written;
    });
    DsiReceiver dsi(steps);  // outlives the run
    bool made = false;
    MappingRun run(*steps.recording, options, std::move(steps.first), steps.job.verbosity,
                   [&](const KeyframeDepthMap& keyframe, const MappingRun& so_far) {
                     made = true;
                     writer.add(keyframe);
                     if (steps.job.on_keyframe) steps.job.on_keyframe(keyframe, so_far);
                   });
    run.mapper().driver().setClock([&] { return processSeconds() - writer.cpuSeconds(); });
    if (dsi.receives()) run.mapper().driver().setSink(&dsi);
    while (run.mapNext()) {  // without its keyframe, a window has no result
      if (!made) steps.requireNoStop();
      steps.tellProgress("mapping", run.fraction());
    }
    run.finish();
    writer.finish();

    steps.describe(run, false);
    if (points) {
      describePoints(*points, steps.report);
      if (steps.output) {
        steps.write([&] { steps.output->writeCloud("points.pcd", *points); });
        if (dsi.file()) steps.write([&] { steps.output->add(dsi.file()->finish()); });
      }
    }
    steps.judgePoints(*steps.map->points);
    steps.endTimes(writer);
    return steps.end(run.error());
  } catch (...) {
    steps.rethrow(written);
  }
}

Report mapRecording(const std::vector<std::filesystem::path>& files,
                    const std::filesystem::path& out, const Options& options,
                    const Overrides& overrides) {
  MapResult result = forHost(HostFace::kRecording, [&] {
    MapJob job = MapJob::of(sourceOf(files, overrides), options);
    job.out = out;
    MapResult made = mapInto(std::move(job));
    made.rejectError();
    return made;
  });
  MapReport& report = result.report;
  std::string json = reportJson(report);  // as the file, with the program's options
  return {report.counts.keyframes, report.points,
          hostTexts(std::move(report.warnings), HostFace::kRecording), std::move(report.quality),
          std::move(json)};
}

}  // namespace efm
