// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/playback/map_job.h"

#include <fmt/format.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "mapping/base/stage_times.h"
#include "mapping/geometry/timestamp.h"
#include "maps/cloud/cloud_points.h"
#include "maps/cloud/keyframe_cloud.h"
#include "plugin/engine/first_look.h"
#include "plugin/engine/host_text.h"
#include "plugin/playback/output_checks.h"
#include "plugin/playback/stored_run.h"
#include "plugin/results/output/keyframe_writer.h"
#include "plugin/results/output/map_output.h"
#include "plugin/results/pictures/depth_picture.h"
#include "plugin/results/pictures/map_picture.h"
#include "plugin/results/pictures/picture.h"
#include "plugin/results/viewer/map_page.h"
#include "plugin/session_file/run_record.h"

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
  const bool reads_all = plan && !plan->from_begin.empty();
  now.limits = reads_all ? options.mapper.limits : options.mapper.interval();
  now.only_poses = !by_shards.empty() && !options.mapper.planned_windows.empty();
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

void warnOfNoPoints(RunReport& report) {
  if (report.counts.keyframes == 0 || report.points > 0) return;
  const PixelCounts& pixels = report.pixels;
  const std::uint64_t depths = pixels.candidates - pixels.at_nearest - pixels.at_farthest -
                               pixels.ambiguous + pixels.neighbours;
  addWarning(
      report.warnings, "no-points",
      "the map has no point. Of {} pixels with contrast, {} are at the nearest plane and {} at the "
      "farthest (widen [dsi] min_depth_m, max_depth_m), {} are ambiguous (longer [keyframes] "
      "window_s; [depth] min_probability), {} were removed ([map] min_keyframes, "
      "outlier_radius_m). If most are ambiguous, check the poses and the calibration",
      pixels.candidates, pixels.at_nearest, pixels.at_farthest, pixels.ambiguous, depths);
}

/// Returns the recording's files as paths that do not depend on the working folder.
std::vector<std::string> namesOf(const RecordingSource& source) {
  std::vector<std::string> names;
  for (const std::filesystem::path& file : source.files) {
    names.push_back(std::filesystem::weakly_canonical(file).string());
  }
  return names;
}

/// A job at work, and what its report has so far.
struct Job : MapJob {
  explicit Job(MapJob given) : MapJob(std::move(given)) {}

  RunReport report;
  std::optional<UserError> write_error;  // the first one
  nlohmann::ordered_json run;            // what the session file says of it
  std::optional<StoredRun> stored;
  std::unique_ptr<SessionWriter> session;
  std::size_t reported_warnings = 0;
  const double start_cpu_s = processSeconds();
  const double start_aside_s = asideSeconds();
  const std::chrono::steady_clock::time_point began = std::chrono::steady_clock::now();
};

double secondsSince(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

void requireNoStop(const Job& job) {
  if (job.stop && job.stop()) throw Interrupted();
}

/// Reports the warnings since the last call.
void warnOfNew(Job& job) {
  const std::vector<Warning>& all = job.report.warnings;
  const auto from = static_cast<std::ptrdiff_t>(std::exchange(job.reported_warnings, all.size()));
  if (job.warn) job.warn({all.begin() + from, all.end()});
}

/// Writes a file of the result. After an error, other files are written all the same.
template <typename Write>
void write(Job& job, const Write& file) {
  try {
    file();
  } catch (const std::exception& error) {
    if (!job.write_error) job.write_error = userError(error);
  }
}

/// Warns of replacing the result of another recording.
void warnOfReplacement(Job& job) {
  const auto earlier = ResultFolder::earlierResult(job.out);
  if (!earlier || earlier->keyframes == 0 || earlier->isOf(namesOf(job.source))) return;
  addWarning(job.report.warnings, "replaced-result",
             "{} holds the result of {} ({} keyframes): this run replaces it", job.out.string(),
             earlier->recording.empty() ? "an unknown recording"
                                        : fmt::format("{}", fmt::join(earlier->recording, ", ")),
             earlier->keyframes);
}

/// Returns whether the result is there already.
bool isComplete(const Job& job) { return job.stored && job.stored->is_complete; }

/// Returns the keyframes of a planned map that a job is for.
KeyframeRange rangeOf(const Job& job) { return job.shard.value_or(job.plan->all()); }

/// The first look at a recording.
struct Look {
  FirstPass first;
  std::unique_ptr<Recording> recording;         ///< The recording again, from its begin.
  std::vector<UndistortionTable> undistortion;  ///< The mapping shares these tables.
};

/// Takes the first look: chooses the automatic options, and warns of poses that do not explain the
/// events.
Look lookAt(Job& job) {
  EventFusionOptions& options = job.options;
  Look look;
  auto held =
      std::make_unique<HeldRecording>(openRecording(job.sourceNow()), options.live.max_queue_mb);
  if (!job.out.empty() && !isComplete(job)) {  // a recording that cannot be opened replaces nothing
    warnOfReplacement(job);
    warnOfNew(job);
  }
  Recording& source = held->source();
  if (std::vector<int> chosen = source.counts().of_calibration; !chosen.empty()) {
    job.source.cameras = std::move(chosen);  // they are all cameras of the recording
    options.mapper.cameras.clear();
  }
  RecordingStatistics& statistics = look.first.statistics;
  statistics = RecordingStatistics(statisticsOptions(options));
  statistics.setCameras(source.rig(), source.cameras());
  FirstLook samples(options);
  Progress progress("first look", job.verbosity);
  const auto next = [&] {
    requireNoStop(job);
    const StageScope scope(&look.first.times, &StageSeconds::read, Processors::kThis);
    return source.read();  // the mapping reports damage
  };
  bool takes = samples.take(source.rig());  // the mapping reports rejected samples
  std::optional<Sample> sample;
  while ((takes || options.live.enabled) && (sample = next())) {
    {
      const StageScope scope(&look.first.times, &StageSeconds::look, Processors::kThis);
      takes = samples.take(*sample);
      if (const auto* packet = std::get_if<EventPacket>(&*sample)) statistics.addEvents(*packet);
      held->hold(std::move(*sample));
    }
    progress.show(source.progress());
    if (job.on_progress) job.on_progress("first look", source.progress());
  }
  if (takes) held->end();

  Chosen chosen;
  {
    const StageScope scope(&look.first.times, &StageSeconds::look);
    RecordingSurvey survey = samples.finish();
    chosen = chooseAndJudge(survey, options);
    look.undistortion = std::move(survey.undistortion);
  }
  auto& [mapper, choice, verdict] = chosen;
  options.mapper = std::move(mapper);
  std::vector<std::string> doubts;
  if (options.automatic.any()) {
    look.first.chosen = std::move(choice.options);
    options.cloud.voxel_size_m = choice.voxel_size_m.value_or(options.cloud.voxel_size_m);
    options.automatic = {};
    if (!choice.is_proven) {
      doubts.push_back(choice.found_scene
                           ? "the parallax is too small to tell how far the scene is away"
                           : "no scene was found to choose depth limits from");
    }
  }
  append(job.report.warnings, std::move(verdict.warnings));
  warnOfNew(job);
  job.report.notes = source.counts().notes;  // not verdict.notes: the quality says them
  for (const Warning& note : job.report.notes) {
    if (job.note) job.note(note.name + ": " + note.text);
  }
  look.first.quality = std::move(verdict.quality);
  append(look.first.quality.doubts, std::move(doubts));
  const bool changes = job.sourceNow().faults.perturbation.keyframe.any();  // by the chosen stride
  if (job.plan) options.mapper.planned_windows = job.plan->windowsOf(rangeOf(job));
  if (held->isWhole() && !changes && !job.plan) {
    look.recording = std::move(held);
  } else {
    held.reset();
    look.recording = openRecording(job.sourceNow());
  }
  return look;
}

RecordingKeyframes::Host hostOf(const Job& job, const char* activity) {
  RecordingKeyframes::Host host;
  host.stop = job.stop;
  host.on_progress = [&job, activity](double fraction) {
    if (job.on_progress) job.on_progress(activity, fraction);
  };
  return host;
}

/// Returns a host whose run is no result if it is stopped.
RecordingKeyframes::Host interruptible(const Job& job, const char* activity) {
  RecordingKeyframes::Host host = hostOf(job, activity);
  host.stop = [&job] {
    requireNoStop(job);
    return false;
  };
  return host;
}

/// Finds the keyframes of an earlier run.
void findStored(Job& job) {
  if (job.options.live.enabled) {
    throw std::runtime_error(
        "--resume with live.enabled = true: a run at the speed of the sensor "
        "cannot go on: expected a run without one of them");
  }
  std::vector<std::string> notes;
  job.stored = findStored(job, job.run, notes);
  for (const std::string& note : notes) {
    if (job.note) job.note("resume: " + note);
  }
}

/// Returns a kernel that agrees with another one bit for bit.
std::string roundingOf(const std::string& kernel) { return kernel == "avx512" ? "avx2" : kernel; }

/// Requires that a part of a planned map is of the same recording, options and rounding.
void requirePlanned(const Job& job) {
  requireSameChoice(job.plan->run, job.run, "the plan", "");
  const std::string planned = job.plan->run.at("kernel"), now = job.run.at("kernel");
  if (roundingOf(planned) == roundingOf(now)) return;
  throw std::runtime_error(fmt::format(
      "the plan is for the kernel {}, this machine has {}, which rounds in another way: expected "
      "machines of one kind, or a plan with --set performance.kernel=sse4 or plain",
      planned, now));
}

/// Requires that a keyframe has the events of the plan.
/// @param damage of the recording: events after it are missing.
void requirePlanned(const PlannedMap& plan, std::uint64_t number, const KeyframeDepthMap& keyframe,
                    const std::optional<UserError>& damage) {
  const std::uint64_t unused = keyframe.without_pose + keyframe.outside_lens + keyframe.over_budget;
  const std::uint64_t events =
      std::accumulate(keyframe.events.begin(), keyframe.events.end(), unused);
  const PlannedMap::Keyframe& planned = plan.keyframes.at(number);
  if (events == planned.events && keyframe.window.t0_ns == planned.window.t0_ns) return;
  if (damage) throw ShardError(damage->text);
  throw PartDiffers(fmt::format("keyframe {} at {} s has {} events, by the plan {}", number,
                                formatSeconds(keyframe.window.t_ref_ns), events, planned.events));
}

/// Warns if stored keyframes are of a kernel that rounds in another way.
void warnOfKernels(Job& job) {
  const std::string now(nameOf(job.options.mapper.keyframe.sweep.kernelOrFastest()));
  for (const std::string& kernel : job.stored->kernels) {
    if (roundingOf(kernel) == roundingOf(now)) continue;
    addWarning(job.report.warnings, "mixed-kernels",
               "stored keyframes are by the kernel {}, the next ones by {}: they agree up to "
               "rounding (if all are of one: --set performance.kernel={} goes on exactly)",
               kernel, now, kernel);
  }
}

/// Passes over the recording for max_confidence = sequence: the robust maximum of the keyframes'
/// confidences. It costs as much as the mapping. @return std::nullopt if there is no keyframe.
std::optional<double> sequenceMaximum(const Job& job, const FirstPass& first) {
  EventFusionOptions of_pass = job.options;
  of_pass.mapper.only_window.reset();
  of_pass.refinement.enabled = false;  // changes no confidence
  of_pass.live.enabled = false;
  RobustMaximum maximum;
  const std::unique_ptr<Recording> all = openRecording(job.sourceNow());
  RecordingKeyframes pass(*all, of_pass, first, std::min(job.verbosity, Verbosity::kNormal),
                          interruptible(job, "first pass"), "first pass");
  while (const auto keyframe = pass.next()) maximum.add(keyframe->max_confidence);
  return maximum.value();  // the mapping reports an error
}

/// Tells of the keyframes of a killed run, which are removed when this result is complete.
void tellOfLeft(Job& job, const ResultFolder& folder) {
  if (folder.left().empty()) return;
  const std::string left = fmt::format("a run that did not end left {} keyframes in {}",
                                       countKeyframes(folder.left()), folder.left().string());
  if (job.resume || !job.by_shards.empty()) {  // no part of the result
    if (job.note) job.note(left + ", which are removed when this result is complete");
    return;
  }
  const bool can_resume =
      !job.options.live.enabled && std::filesystem::exists(folder.left() / "session.mcap");
  addWarning(job.report.warnings, "left-result",
             "{}{}; they are removed when this result is complete", left,
             can_resume
                 ? fmt::format("; `event-fusion map {} --out {} --resume`, with the options of "
                               "that run, goes on with them, after this one is stopped",
                               fmt::join(namesOf(job.source), " "), job.out.string())
                 : "");
}

/// Checks the folder of the result, takes the first look, and makes the folder.
/// @param folder stays empty if no file is written.
Look begin(Job& job, OutputKind kind, std::optional<ResultFolder>& folder) {
  const bool has_session = kind == OutputKind::kMap && job.options.session && !job.out.empty();
  if (!job.out.empty()) {
    rejectReplacing(job.out, job.allInputs());
    ResultFolder::require(job.out, kind, job.force);
    if (has_session || job.resume) job.run = runOf(job);
    if (job.resume) findStored(job);
    if (isComplete(job) && !job.needs_map) return Look();
  }
  Look look = lookAt(job);
  KeyframeMapperOptions& keyframe = job.options.mapper.keyframe;
  if (keyframe.extraction.max_confidence.level == WhiteLevel::kSequence) {
    const nlohmann::ordered_json run = job.stored ? job.stored->session->run() : nullptr;
    keyframe.sequence_maximum = run.contains("sequence_maximum")
                                    ? run.at("sequence_maximum").get<double>()
                                    : sequenceMaximum(job, look.first);
  }
  requireNoStop(job);
  if (job.out.empty()) return look;
  if (has_session) addChosen(job.run, look.recording->rig(), job.options, look.first.chosen);
  if (job.plan) requirePlanned(job);
  if (job.shard) job.options.refinement.enabled = false;  // it is for all keyframes together
  std::vector<StoredKeyframes> made;
  if (job.stored) {
    const SessionFile& stored = *job.stored->session;
    requireSameChoice(stored.run(), job.run, stored.path().string(), ", or no --resume");
    warnOfKernels(job);
    made.push_back({job.stored->session, job.stored->keyframes()});
  }
  for (const auto& session : job.by_shards) made.push_back({session, session->keyframes()});
  if (!made.empty()) keyframe.made_earlier = storedKeyframes(std::move(made));
  if (isComplete(job)) return look;
  folder.emplace(job.out, kind, job.stored ? job.stored->folder : std::filesystem::path());
  if (job.stored) {
    job.stored->removeOthers(folder->path());
    const SessionFile file(folder->path() / "session.mcap");
    job.session = std::make_unique<SessionWriter>(file, job.stored->keyframes());
  }
  tellOfLeft(job, *folder);
  warnOfNew(job);
  return look;
}

MapOutput outputOf(const Job& job, const ResultFolder& folder) {
  return MapOutput(folder.path(), job.options.mapper.keyframe.planes,
                   job.plain_pictures ? PictureStyle::kPlain : PictureStyle::kFigure);
}

/// Adds a keyframe to the session file. A result without keyframes has none.
void store(Job& job, const ResultFolder& folder, const KeyframeDepthMap& keyframe) {
  if (!job.options.session) return;
  if (!job.session) {
    job.session = std::make_unique<SessionWriter>(folder.path() / "session.mcap", job.run);
  }
  job.session->add(keyframe);
}

/// Copies the images of keyframes that shards made: they have more than the session file.
class ShardImages {
 public:
  explicit ShardImages(const Job& job) : shards_(job.by_shards) {}

  /// Copies those of the next keyframe.
  void copy(const std::filesystem::path& result, const KeyframeDepthMap& keyframe) {
    const std::filesystem::path name =
        std::filesystem::path("keyframes") / formatSeconds(keyframe.window.t_ref_ns);
    while (shard_ < shards_.size() && copied_ == shards_[shard_]->keyframes()) {
      ++shard_;
      copied_ = 0;
    }
    const std::filesystem::path from = shards_[shard_]->path().parent_path() / name;
    std::filesystem::create_directories(result / "keyframes");
    using Options = std::filesystem::copy_options;
    std::error_code error;  // another file system has no second names for these files
    std::filesystem::copy(from, result / name, Options::recursive | Options::create_hard_links,
                          error);
    if (error) {
      std::filesystem::remove_all(result / name);
      std::filesystem::copy(from, result / name, Options::recursive);
    }
    ++copied_;
  }

 private:
  const std::vector<std::shared_ptr<const SessionFile>>& shards_;
  std::size_t shard_ = 0;
  std::size_t copied_ = 0;  // of this shard
};

/// Fills in the report, except its points.
void describe(Job& job, RecordingKeyframes& run, const RecordingCounts& counts,
              const MapSnapshot& map) {
  RunReport& report = job.report;
  run.describe(report);
  if (!counts.of_calibration.empty()) report.options.mapper.cameras = counts.of_calibration;
  report.recording = namesOf(job.source);
  report.faults = job.sourceNow().faults;
  // The recording's own calibration may be the better one. --calibration is intended.
  if (counts.recalibrated && job.source.calibration.empty()) {
    report.warnings.push_back(
        {"calibration-replaced", job.options.rig.calibration.string() +
                                     " replaced another calibration, the recording's own; "
                                     "--set rig.calibration= keeps that"});
  }
  if (report.refinement && !map.trajectory.empty()) {
    report.pose_shift = shiftBetween(map.tracker_trajectory, map.trajectory);
  }
}

/// Warns if the map has no points, few points, or points too far away for floats.
void judgePoints(RunReport& report, const MapCloud& points) {
  warnOfNoPoints(report);
  if (auto warning = farPointsWarning(points, report.options.cloud.voxel_size_m)) {
    report.warnings.push_back(std::move(*warning));
  }
}

/// Ends the measured time of the mapping and its files.
void endTimes(Job& job) {
  StageTimes& times = job.report.times;
  times.real.total = secondsSince(job.began);
  times.cpu.start = job.start_cpu_s;
  times.cpu.images = asideSeconds() - job.start_aside_s;
  times.cpu.total = processSeconds();
}

/// Writes the report, and puts the result in its place. The result of an earlier run stays if this
/// run has no keyframe or could not write a file.
MapResult end(Job& job, std::optional<ResultFolder>& folder, std::shared_ptr<const MapSnapshot> map,
              std::optional<UserError> error) {
  RunReport& report = job.report;
  report.peak_memory_bytes = peakMemoryBytes();
  if (error) report.error = error->text;
  bool keeps_earlier = false;
  if (folder) {
    const bool has_earlier = folder->hasEarlier();
    keeps_earlier = has_earlier && report.counts.keyframes == 0;
    if (!keeps_earlier && !job.write_error) {
      write(job, [&] {
        const std::string json = reportJson(report);
        if (job.session) job.session->finish(json);
        outputOf(job, *folder).writeText("report.json", [&](std::ostream& file) { file << json; });
        folder->commit(!report.stopped_at);
      });
    }
    if (job.write_error) {
      job.write_error->add(folder->abandon());
      keeps_earlier = has_earlier;
    }
  }
  if (!error) error = job.write_error;
  warnOfNew(job);
  return {std::move(report), std::move(map), std::move(error), keeps_earlier, {}};
}

/// Throws the current error again, with what stays of the result; called within a handler.
[[noreturn]] void rethrow(std::optional<ResultFolder>& folder) {
  try {
    throw;
  } catch (const Interrupted&) {
    throw;
  } catch (const ShardError&) {  // the next try goes on
    if (folder) folder->abandon();
    throw;
  } catch (const std::runtime_error& error) {
    const std::string stays = folder ? folder->abandon() : std::string();
    if (stays.empty()) throw;
    throw std::runtime_error(userMessage(error) + stays);
  } catch (...) {
    if (folder) folder->abandon();
    throw;
  }
}

/// Gives the whole DSI to the job and to a file, if they ask for it.
class DsiReceiver : public DsiSink {
 public:
  DsiReceiver(const Job& job, const Rig& rig, const std::optional<ResultFolder>& folder)
      : on_plane_(job.on_dsi_plane), num_planes_(job.options.mapper.keyframe.planes.num_planes) {
    const KeyframeMapperOptions& keyframe = job.options.mapper.keyframe;
    const auto reference = static_cast<std::size_t>(keyframe.reference_camera);
    if (reference >= rig.cameras.size()) return;  // the mapping rejects it
    const ReferenceView view = makeReferenceView(rig.cameras[reference].model, keyframe.view);
    size_ = {view.width, view.height};
    if (!job.save_dsi || !folder) return;
    file_ = std::make_unique<NpyDsiFile>(folder->path() / "dsi.npy", num_planes_, view);
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
void writeMap(Job& job, const MapOutput& output, const MapSnapshot& map,
              const KeyframeSheet& sheet) {
  const EventFusionOptions& options = job.options;
  write(job, [&] { output.writeCloud("map.pcd", *map.points); });
  if (options.ply) {
    write(job, [&] {
      output.writeColouredCloud(*map.points, upwardOf(map.trajectory), map.trajectory);
    });
  }
  write(job, [&] { output.writeSimpleMap(map.keyframes); });
  write(job, [&] { output.writeTrajectory("trajectory.txt", map.trajectory); });
  if (options.refinement.enabled) {
    write(job, [&] { output.writeTrajectory("trajectory_tracker.txt", map.tracker_trajectory); });
  }
  write(job, [&] {
    output.writePicture("map.png",
                        drawMap(*map.points, map.trajectory, options.cloud.voxel_size_m));
    output.writePicture("overview.png", sheet.draw(options.mapper.keyframe.planes));
  });
}

/// Writes map.html, which shows the report, and adds the time to the report.
void writePage(Job& job, const MapOutput& output, const MapSnapshot& map,
               const KeyframePictures& pictures) {
  RunReport& report = job.report;
  StageTimes times;
  report.peak_memory_bytes = peakMemoryBytes();
  {
    const StageScope scope(&times, &StageSeconds::map, Processors::kThis);
    const std::filesystem::path folder = std::filesystem::absolute(job.out / "");
    const MapPage page = {folder.lexically_normal().parent_path().filename().string(),
                          *map.points,
                          report.options.cloud.voxel_size_m,
                          map.trajectory,
                          pictures,
                          report.view,
                          reportJson(report)};
    write(job, [&] {
      output.writeText("map.html", [&](std::ostream& file) { writeMapPage(file, page); });
    });
  }
  report.times.real.map += times.real.map;
  report.times.real.total += times.real.map;
  report.times.cpu.output += times.cpu.map;
  report.times.cpu.total += times.cpu.map;
}

}  // namespace

MapResult mapInto(MapJob given) {
  Job job(std::move(given));
  job.options.mapper.keyframe.view_events = !job.out.empty();  // the page shows them
  std::optional<ResultFolder> folder;
  try {
    Look look = begin(job, OutputKind::kMap, folder);
    MapResult result;
    if (isComplete(job)) {
      result.complete_before = job.stored->session->report();
      result.kept_earlier = true;
      result.map = std::make_shared<MapSnapshot>();
      if (!job.needs_map) return result;
    }
    const bool writes = folder.has_value();
    std::optional<MapOutput> output;
    if (folder) output = outputOf(job, *folder);
    KeyframeSheet sheet;
    KeyframePictures pictures(job.options.mapper.keyframe.planes);
    SessionCost cost;
    std::size_t stored = job.stored ? job.stored->keyframes() : 0;
    ShardImages of_shards(job);
    KeyframeWriter writer([&](const KeyframeDepthMap& keyframe) {
      const bool is_stored = stored > 0;
      if (is_stored) --stored;
      if (!is_stored && job.by_shards.empty()) output->writeKeyframe(keyframe);
      if (!job.by_shards.empty()) of_shards.copy(folder->path(), keyframe);
      if (!is_stored) store(job, *folder, keyframe);
      cost.depths += static_cast<std::uint64_t>(cv::countNonZero(keyframe.map.depth));
      sheet.add(keyframe.window.t_ref_ns, keyframe.map.depth);
      pictures.add(keyframe.map.depth, keyframe.view_events);
    });
    const bool joins = !job.by_shards.empty();
    const char* const activity = joins ? "joining" : "mapping";
    RecordingKeyframes::Host host = joins ? interruptible(job, activity) : hostOf(job, activity);
    if (joins) host.known = &job.plan->pass;
    RecordingKeyframes run(*look.recording, job.options, std::move(look.first), job.verbosity, host,
                           activity);
    std::uint64_t number = job.shard ? job.shard->begin : 0;
    while (!job.shard || number < job.shard->end) {
      const auto keyframe = run.next();
      if (!keyframe) break;
      if (job.plan) requirePlanned(*job.plan, number++, *keyframe, run.error());
      if (writes) writer.add(*keyframe);
      if (job.on_keyframe) job.on_keyframe(*keyframe, run);
    }
    if (job.on_last_keyframe) job.on_last_keyframe(run);
    writer.finish();
    if (job.shard && number < job.shard->end && !(job.stop && job.stop())) {
      if (run.error()) throw ShardError(run.error()->text);
      throw PartDiffers(fmt::format("keyframe {} of the plan has no events, or no pose", number));
    }

    StageTimes exporting;
    std::shared_ptr<const MapSnapshot> map;
    {
      const StageScope scope(&exporting, &StageSeconds::map, Processors::kThis);
      map = run.map();
    }
    const std::size_t judged = job.report.warnings.size();
    describe(job, run, look.recording->counts(), *map);
    if (job.shard) job.report.warnings.resize(judged);  // the join judges all keyframes together
    describePoints(*map->points, job.report);
    const bool has_files = writes && job.report.counts.keyframes > 0;
    if (has_files) {
      const StageScope scope(&exporting, &StageSeconds::map, Processors::kThis);
      writeMap(job, *output, *map, sheet);
    }
    job.report.times.real.map += exporting.real.map;
    job.report.times.cpu.output += exporting.cpu.map;
    if (!job.shard) judgePoints(job.report, *map->points);
    endTimes(job);
    if (!result.complete_before.empty()) {
      result.map = std::move(map);
      result.error = run.error();
      return result;
    }
    if (job.session) {
      if (job.options.refinement.enabled) job.session->addPoses(map->trajectory);
      cost.bytes = job.session->bytes();
      cost.seconds = job.session->seconds();
      job.report.session = cost;
    }
    if (has_files) writePage(job, *output, *map, pictures);
    return end(job, folder, std::move(map), job.shard ? std::nullopt : run.error());
  } catch (...) {
    rethrow(folder);
  }
}

namespace {

/// Rejects options with which a map cannot be divided.
void requireDivisible(const EventFusionOptions& options) {
  const auto reject = [](const std::string& option) {
    throw std::invalid_argument(
        option +
        ": a keyframe depends on all those before it, so that a map cannot be divided: "
        "expected another value (map RECORDING makes it in one run)");
  };
  if (options.mapper.policy.policy == KeyframePolicyKind::kBaseline)
    reject("keyframes.policy = baseline");
  if (options.mapper.keyframe.extraction.max_confidence.level == WhiteLevel::kSequence) {
    reject("depth.max_confidence = sequence");
  }
  if (options.live.enabled) reject("live.enabled = true");
  if (!options.session)
    throw std::invalid_argument(
        "output.session = false: shards need their sessions: expected true");
}

/// Returns the real time to open the recording again and reach the events of a window.
double secondsToReach(Job& job, const Window& window) {
  job.options.mapper.planned_windows = {window};
  const auto opened = std::chrono::steady_clock::now();
  const std::unique_ptr<Recording> part = openRecording(job.sourceNow());
  std::optional<Sample> sample;
  do {
    requireNoStop(job);
    sample = part->read();
  } while (sample && !std::holds_alternative<EventPacket>(*sample));
  return secondsSince(opened);
}

}  // namespace

PlannedMap planMap(MapJob given) {
  Job job(std::move(given));
  job.out.clear();
  requireDivisible(job.options);
  PlannedMap plan;
  plan.run = runOf(job);
  Look look = lookAt(job);
  addChosen(plan.run, look.recording->rig(), job.options, look.first.chosen);
  job.options.mapper.on_planned = [&](const Window& window, std::uint64_t events) {
    plan.keyframes.push_back({window, events});
  };
  const double looked_s = look.first.times.real.read;  // a short recording is not read again
  const auto began = std::chrono::steady_clock::now();
  RecordingKeyframes run(*look.recording, job.options, std::move(look.first), job.verbosity,
                         interruptible(job, "planning"), "planning");
  while (run.next()) {
  }
  if (run.error() && run.error()->wrong) throw *run.error()->wrong;
  plan.pass = run.pass();
  if (plan.pass.better_source) {
    throw std::invalid_argument(
        fmt::format("poses of {} begin after others were chosen, so that a map cannot be divided: "
                    "expected rig.pose_source (--set rig.pose_source={})",
                    asText(*plan.pass.better_source), plan.pass.better_source->label));
  }
  if (plan.keyframes.empty()) {
    const std::string why = plan.pass.error.empty() ? "map RECORDING says why" : plan.pass.error;
    throw std::runtime_error("there is no keyframe: " + why);
  }
  if (plan.pass.read.skipped_events > 0) plan.from_begin = "bad events are left out";
  plan.read_s = looked_s + secondsSince(began);
  // Where all is read from the begin, the interval does not count.
  plan.reach_s =
      plan.from_begin.empty() ? secondsToReach(job, plan.keyframes.back().window) : plan.read_s;
  return plan;
}

MapResult mapWindowInto(MapJob given) {
  Job job(std::move(given));
  std::optional<ResultFolder> folder;
  try {
    Look look = begin(job, OutputKind::kDepth, folder);
    const EventFusionOptions& options = job.options;
    MapCloud::ConstPtr points;
    KeyframeWriter writer([&](const KeyframeDepthMap& keyframe) {
      if (folder) outputOf(job, *folder).writeImages(keyframe);
      const std::vector<CloudPoint> in_world =
          pointsInWorld(options.late_fusion ? lateFusionPoints(keyframe) : viewPoints(keyframe),
                        keyframe.T_world_ref);
      points =
          mapCloudOf(removeOutliers(in_world, options.cloud.outliers), options.cloud.voxel_size_m);
    });
    DsiReceiver dsi(job, look.recording->rig(), folder);  // outlives the run
    RecordingKeyframes::Host host = interruptible(job, "mapping");
    if (dsi.receives()) host.sink = &dsi;
    RecordingKeyframes run(*look.recording, options, std::move(look.first), job.verbosity, host);
    while (const auto keyframe = run.next()) {
      job.stop = {};  // the window has its keyframe
      writer.add(*keyframe);
      if (job.on_keyframe) job.on_keyframe(*keyframe, run);
    }
    writer.finish();

    const auto map = run.map();
    describe(job, run, look.recording->counts(), *map);
    describePoints(points ? *points : *map->points, job.report);
    if (points && folder) {
      write(job, [&] { outputOf(job, *folder).writeCloud("points.pcd", *points); });
    }
    if (dsi.file()) write(job, [&] { dsi.file()->finish(); });
    if (dsi.file() && !points) std::filesystem::remove(folder->path() / "dsi.npy");  // no plane
    judgePoints(job.report, *map->points);
    endTimes(job);
    return end(job, folder, map, run.error());
  } catch (...) {
    rethrow(folder);
  }
}

namespace {

/// Returns what a complete report.json says.
Report reportOf(std::string json) {
  const auto values = nlohmann::json::parse(json);
  Report report;
  report.keyframes = values.at("keyframes");
  report.points = values.at("points");
  report.map_hash = values.value("map_hash", "");
  for (const auto& warning : values.at("warnings")) {
    report.warnings.push_back({warning.at("name"), warning.at("text")});
  }
  report.warnings = hostTexts(std::move(report.warnings), HostFace::kRecording);
  const auto& quality = values.at("quality");
  report.quality.word = fromName<QualityWord>(quality.at("word").get<std::string>());
  report.quality.wrong_share = quality.value("wrong_share", 0.0);
  report.quality.depth_error = quality.value("depth_error", 0.0);
  report.quality.support = quality.value("support", 0.0);
  report.quality.left_out = quality.at("left_out");
  report.quality.reasons = quality.at("reasons").get<std::vector<std::string>>();
  report.quality.keyframes = quality.at("keyframes").get<std::vector<float>>();
  report.quality.much_worse = quality.at("much_worse").get<std::vector<std::size_t>>();
  report.json = std::move(json);
  return report;
}

}  // namespace

Report mapRecording(const std::vector<std::filesystem::path>& files,
                    const std::filesystem::path& out, const Options& options,
                    const Overrides& overrides, bool resume) {
  MapResult result = forHost(HostFace::kRecording, [&] {
    MapJob job = MapJob::of(sourceOf(files, overrides), options);
    job.out = out;
    job.resume = resume;
    MapResult made = mapInto(std::move(job));
    made.rejectError();
    return made;
  });
  if (!result.complete_before.empty()) return reportOf(std::move(result.complete_before));
  RunReport& report = result.report;
  std::string json = reportJson(report);  // as the file, with the program's options
  return {report.counts.keyframes,   report.points,
          report.map_hash,           hostTexts(std::move(report.warnings), HostFace::kRecording),
          std::move(report.quality), std::move(json)};
}

}  // namespace efm
