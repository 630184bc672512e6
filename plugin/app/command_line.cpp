// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/app/command_line.h"

#include <CLI/CLI.hpp>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "mapping/geometry/timestamp.h"
#include "mapping/options/quoted_text.h"
#include "plugin/app/config_files.h"
#include "plugin/app/evaluate_arguments.h"
#include "plugin/app/export_command.h"
#include "plugin/app/import_command.h"
#include "plugin/app/info_command.h"
#include "plugin/app/map_command.h"
#include "plugin/app/simulate_command.h"
#include "plugin/formats/open_recording.h"
#include "plugin/options/tracker_fault_keys.h"
#include "tracking_stub/presets/simulation_preset.h"
#include "tracking_stub/presets/trajectory_simulation.h"

namespace efm {
namespace {

void setFaults(const std::vector<std::string>& assignments, TrackerFaults& faults) {
  try {
    for (const std::string& assignment : assignments) setTrackerFault(assignment, faults);
  } catch (const std::invalid_argument& error) {
    throw CLI::ValidationError("--perturb", error.what());
  }
}

template <typename Arguments>
void addSource(CLI::App& command, Arguments& arguments) {
  command
      .add_option("SOURCE", arguments.source.files,
                  "The recording: a rawlog, a folder, or the files of one recording (text, HDF5, "
                  "ROS bags, MCAP, Prophesee RAW, AEDAT4, NumPy): see docs/recordings.md")
      ->required();
  command
      .add_option("--format", arguments.source.format,
                  "The format of the recording (auto: detected)")
      ->check(CLI::IsMember(recordingFormats()))
      ->capture_default_str();
  command
      .add_option(
          "--poses", arguments.source.poses,
          "Poses that replace the recording's, of the rig in the world: text (t tx ty tz qx qy qz "
          "qw, or columns with a header), NumPy arrays, or a recording with poses")
      ->type_name("FILE");
  command
      .add_option("--calibration", arguments.source.calibration,
                  std::string("Calibration that replaces the recording's: ") + kCalibrationFiles)
      ->type_name("FILE");
  command
      .add_option("--hand-eye", arguments.source.hand_eye,
                  "Pose of the rig on the tracked body; the poses are then those of the body: YAML "
                  "with T_body_rig, 4x4; a Kalibr camera chain with T_cam_imu; with --calibration, "
                  "DSEC's cam_to_lidar.yaml or TUM-VIE's mocap-imu-calibration*.json")
      ->type_name("FILE");
  command
      .add_option("--topics", arguments.source.reader.topics,
                  "Topics of a bag, or streams of a file, to read: events, one for each camera, "
                  "and poses (default: found by their type)")
      ->type_name("TOPIC[,TOPIC...]")
      ->delimiter(',')
      ->allow_extra_args(false);
  command
      .add_option(
          "--event-columns", arguments.source.reader.columns,
          "The columns of text events: t, x, y, p, and - for one to ignore, e.g. \"x y p t\" "
          "(default: those of the header, else t x y p)")
      ->type_name("COLUMNS");
  command
      .add_option("--time-unit", arguments.source.reader.time_unit,
                  "The unit of times in text events and NumPy arrays (default: found, else s)")
      ->check(CLI::IsMember({"s", "ms", "us", "ns"}));
  command
      .add_option_function<std::vector<std::string>>(
          "--perturb",
          [&arguments](const std::vector<std::string>& assignments) {
            setFaults(assignments, arguments.source.faults);
          },
          "Simulated faults of the tracker: " + knownTrackerFaults() + "; may be repeated")
      ->type_name("KEY=VALUE[,KEY=VALUE...]")
      ->delimiter(',')
      ->allow_extra_args(false);
}

template <typename Arguments>
void addStrict(CLI::App& command, Arguments& arguments) {
  command.add_flag("--strict", arguments.strict,
                   "A warning is an error: exit status 1, after the results are written");
}

/// For a command without an option file, which has the length of a keyframe.
template <typename Arguments>
void requireKeyframeLengthOf(const Arguments& arguments) {
  try {
    requireKeyframeLength(arguments.source.faults);
  } catch (const std::invalid_argument& error) {
    throw CLI::ValidationError("--perturb", error.what());
  }
}

/// A number of seconds, exact to the nanosecond.
std::int64_t nanosecondsOf(const std::string& text, const std::string& name) {
  const std::optional<std::int64_t> parsed = parseSeconds(text);
  if (!parsed) {
    throw CLI::ValidationError(name, inQuotes(text) + ": expected a time in seconds");
  }
  if (*parsed >= kEndOfTimeNs || *parsed <= -kEndOfTimeNs) {
    throw CLI::ValidationError(name, inQuotes(text) + ": expected a time within 4.6e9 s of 0");
  }
  return *parsed;
}

CLI::Option* addTime(CLI::App& command, const std::string& name, std::optional<TimeArgument>& time,
                     const std::string& help) {
  return command
      .add_option_function<std::string>(
          name,
          [&time, name](const std::string& text) {
            const bool from_start = text[0] == '+';
            time =
                TimeArgument{nanosecondsOf(from_start ? text.substr(1) : text, name), from_start};
          },
          help + "; +S: S seconds after the first event")
      ->type_name("[+]SECONDS");
}

/// @return --t0.
template <typename Arguments>
CLI::Option* addTimeLimits(CLI::App& command, Arguments& arguments) {
  CLI::Option* const t0 =
      addTime(command, "--t0", arguments.times.t0, "Leave out events before this time");
  CLI::Option* const t1 =
      addTime(command, "--t1", arguments.times.t1, "Leave out events from this time on");
  command
      .add_option_function<std::string>(
          "--duration",
          [&arguments](const std::string& text) {
            const std::int64_t duration_ns = nanosecondsOf(text, "--duration");
            if (duration_ns <= 0) {
              throw CLI::ValidationError("--duration",
                                         inQuotes(text) + ": expected a time above 0");
            }
            arguments.times.duration_ns = duration_ns;
          },
          "Instead of --t1: the time from --t0, or from the first event")
      ->type_name("SECONDS")
      ->excludes(t1);
  return t0;
}

/// For commands that write a rawlog.
void addPacketLength(CLI::App& command, std::int64_t& packet_ns) {
  command
      .add_option_function<std::string>(
          "--packet-s",
          [&packet_ns](const std::string& text) {
            const std::optional<std::int64_t> length_ns = parseSeconds(text);
            if (!length_ns || *length_ns < 1'000 || *length_ns > kNanosecondsPerSecond) {
              throw CLI::ValidationError("--packet-s",
                                         inQuotes(text) + ": expected 0.000001 to 1 seconds");
            }
            packet_ns = *length_ns;
          },
          "Length of a packet of events; of a rawlog, packets stay as they are (default 0.01)")
      ->type_name("SECONDS");
}

/// The names of the program's option files, for a help text.
std::string configList() {
  std::string list;
  for (const std::string& name : configNames()) list += (list.empty() ? "" : ", ") + name;
  return list.empty() ? "" : " (" + list + ")";
}

/// An option file before the sources is CONFIG.
void takeConfig(MappingArguments& arguments) {
  auto& files = arguments.source.files;
  if (files.front().extension() != ".ini") return;
  if (!arguments.config.empty()) {
    throw CLI::ValidationError("--config", "a second option file: " + files.front().string());
  }
  arguments.config = files.front().string();
  files.erase(files.begin());
  if (files.empty()) throw CLI::RequiredError("SOURCE");
}

void addMappingArguments(CLI::App& command, MappingArguments& arguments) {
  addSource(command, arguments);
  command.get_option("SOURCE")->description("[CONFIG.ini] SOURCE...: the option file, if any; " +
                                            command.get_option("SOURCE")->get_description());
  command
      .add_option("--config", arguments.config,
                  "The option file, in place of CONFIG.ini: a file, or a name" + configList() +
                      "; the default has all keys")
      ->type_name("NAME|FILE");
  command
      .add_option("-o,--out", arguments.out,
                  "Folder for the results; an earlier result is replaced (default: named after the "
                  "recording, in the working folder)")
      ->type_name("DIR");
  command.add_flag("--force", arguments.force, "Write into a folder that holds other files");
  command
      .add_option("--set", arguments.sets,
                  "Overrides one option of CONFIG, e.g. --set dsi.num_planes=200; may be repeated")
      ->type_name("SECTION.KEY=VALUE")
      ->allow_extra_args(false);
  addStrict(command, arguments);
}

void addPixelOptions(CLI::App& command, SimulateArguments& arguments) {
  constexpr const char* kGroup = "Pixels (ideal by default)";
  command
      .add_option("--threshold-on", arguments.threshold_on,
                  "Increase of log intensity per ON event; by default the preset's, or 0.3")
      ->group(kGroup);
  command
      .add_option("--threshold-off", arguments.threshold_off,
                  "Decrease of log intensity per OFF event; by default the preset's, or 0.3")
      ->group(kGroup);
  command
      .add_option("--mismatch", arguments.mismatch,
                  "Standard deviation of the pixels' thresholds, as a fraction of them, 0 to 0.5")
      ->capture_default_str()
      ->group(kGroup);
  command
      .add_option("--refractory-us", arguments.refractory_us,
                  "Dead time of a pixel after an event, in microseconds")
      ->capture_default_str()
      ->group(kGroup);
  command
      .add_option("--noise-hz", arguments.noise.background_hz,
                  "Background noise: events per second and pixel")
      ->capture_default_str()
      ->group(kGroup);
  command
      .add_option("--hot-pixels", arguments.noise.hot_fraction, "Fraction of hot pixels, 0 to 1")
      ->capture_default_str()
      ->group(kGroup);
  command.add_option("--hot-hz", arguments.noise.hot_hz, "Events per second of a hot pixel")
      ->capture_default_str()
      ->group(kGroup);
}

void addSimulate(CLI::App& app, Run& run) {
  CLI::App& command = *app.add_subcommand(
      "simulate",
      "Simulate a recording with exact ground truth, as a dataset folder: a preset, or a scene "
      "around a trajectory, seen by a calibrated rig");
  auto arguments = argumentsOf(command, run, runSimulate);
  CLI::Option* preset = command.add_option("--preset", arguments->preset, "Scene, rig and motion")
                            ->check(CLI::IsMember(simulationPresets()));
  CLI::Option* scene = command
                           .add_option("--scene", arguments->scene,
                                       "A scene around the trajectory; upwards is the cameras' -y")
                           ->check(CLI::IsMember(simulationScenes()))
                           ->excludes(preset);
  CLI::Option* trajectory =
      command
          .add_option("--trajectory", arguments->trajectory,
                      "Poses of camera 0 (z forward), TUM format; the truth is this trajectory, "
                      "low-pass filtered at 10 Hz")
          ->type_name("TUM.txt");
  CLI::Option* calibration =
      command.add_option("--calibration", arguments->calibration, "The rig, as Kalibr writes it")
          ->type_name("CAMCHAIN.yaml");
  trajectory->needs(scene);
  calibration->needs(scene);
  scene->needs(trajectory)->needs(calibration);
  command
      .add_option_function<std::string>(
          "--start",
          [arguments](const std::string& text) {
            arguments->start_ns = nanosecondsOf(text, "--start");
          },
          "Start time on the trajectory, in its clock; by default the first half second with at "
          "least half the mean speed")
      ->type_name("SECONDS")
      ->needs(scene);
  command
      .add_option(
          "--duration", arguments->duration_s,
          "Duration of the recording; by default the preset's; on a trajectory 5, or less if "
          "it ends earlier")
      ->type_name("SECONDS");
  command
      .add_option("--seed", arguments->seed, "Seed of all random numbers, a whole number from 0")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  addPixelOptions(command, *arguments);
  command.add_option("--out", arguments->out, "The folder to write: a new or an empty one")
      ->required()
      ->type_name("DIR");
  command.parse_complete_callback([preset, scene] {
    if (preset->count() + scene->count() == 0) {
      throw CLI::RequiredError("--preset, or --scene with --trajectory and --calibration,");
    }
  });
}

void addImport(CLI::App& app, Run& run) {
  CLI::App& command =
      *app.add_subcommand("import", "Turn a recording into a rawlog, MRPT's format");
  auto arguments = argumentsOf(command, run, runImport);
  addSource(command, *arguments);
  command.add_option("--out", arguments->out, "The rawlog to write")
      ->required()
      ->type_name("FILE.rawlog");
  addTimeLimits(command, *arguments);
  static const std::map<std::string, RawlogCompression> kCompressions = {
      {"gzip", RawlogCompression::kGzip},
      {"zstd", RawlogCompression::kZstd},
      {"none", RawlogCompression::kNone}};
  command
      .add_option("--compression", arguments->compression,
                  "gzip: the whole rawlog (default). zstd: the events alone, in a plain rawlog; "
                  "faster to write and to read. none")
      ->transform(CLI::Transformer(kCompressions))
      ->type_name("gzip|zstd|none");
  addPacketLength(command, arguments->source.packet_ns);
  command.parse_complete_callback([arguments] { requireKeyframeLengthOf(*arguments); });
}

void addExport(CLI::App& app, Run& run) {
  CLI::App& command =
      *app.add_subcommand("export", "Write a recording for other tools: text, DSEC's HDF5, MCAP");
  auto arguments = argumentsOf(command, run, runExport);
  addSource(command, *arguments);
  command.add_option("--to", arguments->format, "The format to write")
      ->required()
      ->check(CLI::IsMember(exportFormats()));
  command.add_option("--out", arguments->out, "The folder or the file to write; a new one")
      ->required()
      ->type_name("PATH");
  addTimeLimits(command, *arguments);
  command.parse_complete_callback([arguments] { requireKeyframeLengthOf(*arguments); });
}

void addMap(CLI::App& app, Run& run) {
  CLI::App& command = *app.add_subcommand(
      "map", "Map a whole recording: keyframe depth maps and one point cloud, map.pcd");
  auto arguments = argumentsOf(command, run, runMap);
  addMappingArguments(command, *arguments);
  addTimeLimits(command, *arguments);
  command.parse_complete_callback([arguments] { takeConfig(*arguments); });
}

void addDepth(CLI::App& app, Run& run) {
  CLI::App& command =
      *app.add_subcommand("depth", "Make the depth map of one time window of a recording");
  auto arguments = argumentsOf(command, run, runDepth);
  addMappingArguments(command, *arguments);
  addTimeLimits(command, *arguments)->required();
  addTime(command, "--ref-time", arguments->t_ref,
          "Time of the reference view; by default the middle of the window");
  command.parse_complete_callback([arguments] {
    takeConfig(*arguments);
    if (!arguments->times.t1 && !arguments->times.duration_ns) throw CLI::RequiredError("--t1");
  });
  command.add_flag("--save-dsi", arguments->save_dsi,
                   "Also write the whole DSI, dsi.npy (float32, [plane][row][column])");
}

void addInfo(CLI::App& app, Run& run) {
  CLI::App& command = *app.add_subcommand(
      "info", "Print the contents of a recording, or the processor and its kernels");
  auto arguments = argumentsOf(command, run, runInfo);
  addSource(command, *arguments);
  addTimeLimits(command, *arguments);
  addStrict(command, *arguments);
  command.add_flag("--system", arguments->system,
                   "Print the processor and the kernels of the inner loops that it can run, and "
                   "test them; needs no recording");
  command.get_option("SOURCE")->required(false);
  command.parse_complete_callback([arguments] {
    if (!arguments->system && arguments->source.files.empty()) throw CLI::RequiredError("SOURCE");
    requireKeyframeLengthOf(*arguments);
  });
}

}  // namespace

std::function<int()> parseCommandLine(int argc, char** argv) {
  CLI::App app(
      "Maps with event cameras: events and poses in, semi-dense depth maps and one global point "
      "cloud out.\n\n"
      "From a recording to a map:\n"
      "  event-fusion simulate --preset desk_stereo --out desk\n"
      "  event-fusion import desk --out desk.rawlog\n"
      "  event-fusion map config/simulated_stereo.ini desk.rawlog --out out\n",
      "event-fusion");
  app.set_version_flag("--version", std::string("event-fusion ") + EFM_VERSION);
  app.set_help_all_flag("--help-all", "Print the help of every command and exit");
  app.require_subcommand(1);
  Run run;
  for (const auto add :
       {addSimulate, addImport, addExport, addMap, addDepth, addEvaluate, addInfo}) {
    add(app, run);
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return [status = app.exit(error)] { return status; };  // also prints help and version
  }
  return run;
}

}  // namespace efm
