// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <unistd.h>

#include <cstdlib>
#include <iostream>
#include <memory>
#include <stdexcept>

#include "mapping/geometry/timestamp.h"
#include "plugin/app/commands.h"
#include "plugin/app/interruption.h"
#include "plugin/app/program.h"
#include "plugin/options/option_file.h"
#include "plugin/playback/map_job.h"
#include "plugin/playback/output_checks.h"
#include "plugin/playback/session_map.h"
#include "plugin/recordings/open/mrpt_library.h"

namespace efm {
namespace {

OptionReader readerOf(const MappingArguments& arguments) {
  return asUsage([&] {
    OptionReader reader;
    if (!arguments.config.empty()) reader.readFile(findConfig(arguments.config, "--config "));
    for (const std::string& assignment : arguments.sets) reader.set(assignment);
    return reader;
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

/// Names how the file of an option was given, if it does not exist.
void requireFile(const OptionReader& reader, const char* key, const std::filesystem::path& file) {
  const std::string given = reader.given("rig", key);
  if (given.empty() || file.empty() || std::filesystem::exists(file)) return;
  throw std::runtime_error(given + ": no such file");
}

/// A job of the command line, and the options as they were given, for errors.
struct CommandLineJob {
  CommandLineJob(const MappingArguments& given, OutputKind output_kind)
      : arguments(given), kind(output_kind), reader(readerOf(given)) {
    job.source = arguments.source;
    job.options = asUsage([&] { return reader.options(); });
    const RigOptions& rig = job.options.rig;
    if (job.source.calibration.empty()) requireFile(reader, "calibration", rig.calibration);
    if (job.source.hand_eye.empty()) requireFile(reader, "hand_eye", rig.hand_eye);
    job.prepare();
    job.out = outputFolder(arguments, kind);
    job.force = arguments.force;
    job.plain_pictures = arguments.plain_pictures;
    if (!arguments.config.empty()) job.inputs = {findConfig(arguments.config)};
    job.verbosity = arguments.verbosity;
    job.stop = [this] { return interruption.requested(); };
    job.warn = [](const std::vector<Warning>& warnings) { printWarnings(warnings); };
    job.note = [](const std::string& text) { std::cerr << "event-fusion: note: " << text << "\n"; };
  }

  const MappingArguments& arguments;
  const OutputKind kind;
  const OptionReader reader;
  const Interruption interruption{};
  MapJob job;
  std::function<void(const std::string&)> on_error;  ///< Receives the error; may be empty.

  /// Runs the job, and prints the summary and the error. @return the exit status.
  int run();
};

int CommandLineJob::run() {
  MapResult result;
  try {
    result = kind == OutputKind::kMap ? mapInto(job) : mapWindowInto(job);
  } catch (const OptionError& error) {
    if (const auto wrong = reader.wrongOption(error)) throw UsageError(*wrong);
    throw;
  }
  if (!result.complete_before.empty()) return 0;  // a note has said so
  const RunReport& report = result.report;
  const bool quiet = arguments.verbosity == Verbosity::kQuiet;
  if (report.counts.keyframes > 0 && !quiet && !result.kept_earlier) {
    std::cout << summaryOf(report, kind, job.out);
  }
  if (const auto& error = result.error) {
    if (on_error) on_error(error->text);
    const auto wrong = error->wrong ? reader.wrongOption(*error->wrong) : std::nullopt;
    if (wrong) return fail(*wrong + error->more, kUsageStatus);
    return fail(error->text + reader.origins(error->options),
                job.plan && isTemporary(error->text) ? kTryAgainStatus : kFailedStatus);
  }
  if (report.stopped_at) {
    std::cerr << fmt::format("event-fusion: stopped at {:.0f} % of the recording\n",
                             100 * *report.stopped_at);
    return kInterruptedStatus;
  }
  const bool strict = arguments.strict && failStrictly(report.warnings);
  if (result.isWithoutPoints() && !job.plan) {
    return fail("the map has no point; its files are written");
  }
  return strict ? kFailedStatus : 0;
}

/// Watchers of the map after each keyframe: a window, and a folder of frames.
class Watchers {
 public:
  Watchers(const MapArguments& arguments, const MapJob& job) {
    if (arguments.view) all_.push_back(window_ = openWindow());
    if (arguments.record_frames.empty()) return;
    rejectReplacing(arguments.record_frames, job.allInputs());
    all_.push_back(
        mrptLibrary("--record-frames").recordFrames(arguments.record_frames, arguments.force));
  }

  void add(const RecordingKeyframes& run, const KeyframeDepthMap& keyframe) {
    if (!all_.empty()) newest_ = keyframe;
    show(run, false);
  }
  void show(const RecordingKeyframes& run, bool is_last) {
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

/// The job of `map` within its time limits.
/// @throws UsageError if the recording is a session, whose map is exported.
struct MapCommand : CommandLineJob {
  explicit MapCommand(const MapArguments& given)
      : CommandLineJob(checked(given), OutputKind::kMap) {
    TimeLimits& limits = job.options.mapper.limits;
    limits = RecordingTimes(job.sourceNow()).resolve(given.times);
    asUsage([&] { limits.validate(); });
  }

 private:
  static const MapArguments& checked(const MapArguments& given) {
    for (const std::filesystem::path& file : given.source.files) {
      if (!sessionAt(file) || std::filesystem::is_directory(file)) continue;
      throw UsageError(file.string() +
                       ": a session: its map is made again by `event-fusion export " +
                       file.string() + " --out map.pcd`");
    }
    return given;
  }
};

}  // namespace

int runMap(const MapArguments& arguments) {
  if (!arguments.plan.empty()) return runShard(arguments);
  MapCommand command(arguments);
  MapJob& job = command.job;
  job.resume = arguments.resume;
  job.plan = arguments.planned;
  job.shard = arguments.keyframes;
  job.by_shards = arguments.by_shards;
  for (const auto& session : job.by_shards) job.inputs.push_back(session->path());
  Watchers watchers(arguments, job);
  job.on_keyframe = [&](const KeyframeDepthMap& keyframe, const RecordingKeyframes& run) {
    watchers.add(run, keyframe);
  };
  job.on_last_keyframe = [&](const RecordingKeyframes& run) { watchers.show(run, true); };
  job.on_progress = arguments.on_progress;
  command.on_error = arguments.on_error;
  const int status = command.run();
  watchers.wait(command.interruption);
  return status;
}

PlannedMap planMapOf(const MapArguments& arguments) {
  MapCommand command(arguments);
  try {
    return planMap(command.job);
  } catch (const OptionError& error) {
    if (const auto wrong = command.reader.wrongOption(error)) throw UsageError(*wrong);
    throw;
  } catch (const std::invalid_argument& error) {
    throw UsageError(error.what());
  }
}

int runDepth(const DepthArguments& arguments) {
  CommandLineJob command(arguments, OutputKind::kDepth);
  MapJob& job = command.job;
  FusionMapperOptions& options = job.options.mapper;
  options.only_window = windowOf(arguments, job.sourceNow(), options.policy.reference);
  asUsage([&] { options.validate(); });
  job.save_dsi = arguments.save_dsi;
  return command.run();
}

}  // namespace efm
