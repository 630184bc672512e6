// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/app/arguments.h"

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <set>
#include <stdexcept>

#include "mapping/base/named_choice.h"
#include "mapping/base/text.h"
#include "mapping/geometry/timestamp.h"
#include "plugin/app/commands.h"
#include "plugin/app/program.h"
#include "plugin/options/option_file.h"
#include "plugin/options/tracker_fault_keys.h"
#include "plugin/recordings/streams/time_unit.h"

namespace efm {
namespace {

template <typename Holds>
CLI::Validator numberThat(const Holds& holds, const std::string& expected) {
  return {[=](std::string& text) {
            const std::optional<double> number = parseFinite(text);
            if (number && holds(*number)) return std::string();
            return fmt::format("{}: expected {}", inQuotes(text), expected);
          },
          ""};
}

/// Returns the command that the command line chose: "event-fusion evaluate depth".
const CLI::App& chosenCommand(const CLI::App& app, std::string& path) {
  path = app.get_name();
  const CLI::App* command = &app;
  while (!command->get_subcommands().empty()) {
    command = command->get_subcommands().front();
    path += " " + command->get_name();
  }
  return *command;
}

std::vector<std::string> commandsOf(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    names.push_back(command->get_name());
  }
  return names;
}

std::vector<std::string> optionsOf(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  return names;
}

/// Returns the error for a word of the command line that belongs to no option.
std::string extraText(const CLI::App& command, const std::string& path, const std::string& word) {
  if (word.front() == '-' && word.size() > 1) {
    const std::string name = word.substr(0, word.find('='));
    const auto near = nearestName(name, optionsOf(command));
    return near ? fmt::format("{}: unknown option: did you mean {}?", printable(name), *near)
                : fmt::format("{}: unknown option; {} --help lists all", printable(name), path);
  }
  const std::vector<std::string> commands = commandsOf(command);
  if (commands.empty()) {
    return fmt::format("{}: one word too many; see {} --help", inQuotes(word), path);
  }
  return fmt::format("{}: unknown command: {}", inQuotes(word), expectedName(word, commands));
}

void setFaults(const std::vector<std::string>& assignments, TrackerFaults& faults) {
  try {
    for (const std::string& assignment : assignments) setTrackerFault(assignment, faults);
  } catch (const std::invalid_argument& error) {
    throw CLI::ValidationError("--perturb", error.what());
  }
}

/// Returns the option files of the program, for the end of a help text.
std::string configList() {
  const std::string list = fmt::format("{}", fmt::join(configNames(), ", "));
  const std::string first =
      "Options of --set that matter first (config/default.ini explains all): dsi.min_depth_m, "
      "dsi.max_depth_m, dsi.num_planes, keyframes.window_s, keyframes.stride_s, rig.cameras, "
      "map.voxel_size_m, refinement.enabled, live.enabled";
  return list.empty() ? first : first + "\nOption files that come with the program: " + list;
}

/// Takes an option file before the sources as --config.
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
  addSource(command, arguments.source);
  command
      .add_option(
          "--config", arguments.config,
          "The option file: a name of those listed below, or a file; `default` has all keys")
      ->type_name("NAME|FILE");
  command
      .add_option("-o,--out", arguments.out,
                  "Folder for the results; an earlier result is replaced (default: named after the "
                  "recording, in the working folder)")
      ->type_name("DIR");
  command.add_flag("--force", arguments.force, "Write into a folder that holds other files");
  command
      .add_option("--set", arguments.sets,
                  "Overrides one option, e.g. --set dsi.num_planes=200; may be repeated")
      ->type_name("SECTION.KEY=VALUE")
      ->allow_extra_args(false);
  command.add_flag("--plain-pictures", arguments.plain_pictures,
                   "Write depth.png and confidence.png in the sensor's size, without colour bar");
  addStrict(command, arguments.strict);
  addVerbosity(command, arguments.verbosity, true);
  command.footer(configList);
}

}  // namespace

CLI::Validator oneOf(const std::vector<std::string>& names) {
  return {[names](std::string& text) {
            if (std::count(names.begin(), names.end(), text) > 0) return std::string();
            return inQuotes(text) + ": " + expectedName(text, names);
          },
          fmt::format("{{{}}}", fmt::join(names, ","))};
}

CLI::Validator aboveZero() {
  return numberThat([](double number) { return number > 0; }, "a number above 0");
}

CLI::Validator zeroOrMore() {
  return numberThat([](double number) { return number >= 0; }, "a number, 0 or more");
}

CLI::Validator between(double low, double high, const std::string& range) {
  return numberThat([=](double number) { return number >= low && number <= high; }, range);
}

std::string errorText(const CLI::App& app, const CLI::ParseError& error) {
  std::string path;
  const CLI::App& command = chosenCommand(app, path);
  const bool wrong_value = dynamic_cast<const CLI::ValidationError*>(&error) != nullptr ||
                           dynamic_cast<const CLI::ConversionError*>(&error) != nullptr ||
                           dynamic_cast<const CLI::ArgumentMismatch*>(&error) != nullptr;
  // A mistyped name may be the reason of a missing argument.
  const std::vector<std::string> extras = app.remaining(true);
  if (!wrong_value && !extras.empty()) return extraText(command, path, extras.front());
  const std::vector<std::string> commands = commandsOf(command);
  if (!wrong_value && !commands.empty()) {
    return fmt::format("no command: expected one of {}", fmt::join(commands, ", "));
  }
  const std::string text = error.what();
  const std::string conversion = "Could not convert: ";
  if (text.compare(0, conversion.size(), conversion) == 0) {  // only numbers are converted
    return text.substr(conversion.size()) + ": expected a number";
  }
  const std::size_t repeated = text.find(": At Most 1 required but received ");
  if (repeated != std::string::npos) {
    return text.substr(0, repeated) + ": given more than once: expected it once";
  }
  return wrong_value ? text : text + "; see " + path + " --help";
}

void addTimeUnit(CLI::App& command, const std::string& name, std::string& unit,
                 const std::string& help) {
  command.add_option(name, unit, help)->check(oneOf({"s", "ms", "us", "ns"}));
}

void addSource(CLI::App& command, RecordingSource& source) {
  command
      .add_option("SOURCE", source.files,
                  "The recording: a rawlog, a folder, or the files of one recording (text, HDF5, "
                  "ROS bags, MCAP, Prophesee RAW, AEDAT4, NumPy): see docs/recordings.md")
      ->required();
  command.add_option("--format", source.format, "The format of the recording (auto: detected)")
      ->check(oneOf(recordingFormats()))
      ->capture_default_str();
  command
      .add_option(
          "--poses", source.poses,
          "Poses that replace the recording's, of the rig in the world: text (t tx ty tz qx qy qz "
          "qw, or columns with a header), or a recording with poses")
      ->type_name("FILE");
  command
      .add_option("--calibration", source.calibration,
                  std::string("Calibration that replaces the recording's: ") + kCalibrationFiles)
      ->type_name("FILE");
  command
      .add_option("--hand-eye", source.hand_eye,
                  "Pose of the rig on the tracked body; the poses are then those of the body: YAML "
                  "with T_body_rig, 4x4; a Kalibr camera chain with T_cam_imu; with --calibration, "
                  "DSEC's cam_to_lidar.yaml or TUM-VIE's mocap-imu-calibration*.json")
      ->type_name("FILE");
  command
      .add_option("--topics", source.reader.topics,
                  "Topics of a bag, or streams of a file, to read: events, one for each camera, "
                  "and poses, or \"/tf:world->body\" (default: found by their type)")
      ->type_name("TOPIC[,TOPIC...]")
      ->delimiter(',')
      ->allow_extra_args(false);
  command
      .add_option(
          "--event-columns", source.reader.columns,
          "The columns of text events and N x 4 arrays: t, x, y, p, and - for one to ignore, e.g. "
          "\"x y p t\" (default: those of the header, else t x y p); or the names of arrays, "
          "fields "
          "or data sets in NumPy and HDF5: \"t=NAME x=NAME y=NAME p=NAME\"")
      ->type_name("COLUMNS");
  addTimeUnit(command, "--time-unit", source.reader.time_unit,
              "The unit of times in text events, NumPy arrays and real times of HDF5 (default: "
              "found, else s)");
  addTimeUnit(command, "--pose-time-unit", source.reader.pose_time_unit,
              "The unit of times in text poses whose header names none (default: found, else "
              "--time-unit for whole numbers, else s)");
  command
      .add_option_function<std::string>(
          "--sensor-size",
          [&source](const std::string& text) {
            source.reader.sensor_size = cameraSizeOf(text);
            if (!source.reader.sensor_size) {
              throw CLI::ValidationError("--sensor-size",
                                         inQuotes(text) + ": expected columns x rows, as 346x260");
            }
          },
          "The pixels of the sensors, where neither the recording nor the calibration says them")
      ->type_name("WIDTHxHEIGHT");
  command
      .add_option("--skip-bad-events", source.skip_bad_events,
                  "Leave out up to N bad events of the recording: lines that are none (text), "
                  "pixels outside the sensor, times over 10 ms late (default 0: an error)")
      ->type_name("N")
      ->check(zeroOrMore());
  command
      .add_option_function<std::vector<std::string>>(
          "--perturb",
          [&source](const std::vector<std::string>& assignments) {
            setFaults(assignments, source.faults);
          },
          "Simulated faults of the tracker: " + knownTrackerFaults() + "; may be repeated")
      ->type_name("KEY=VALUE[,KEY=VALUE...]")
      ->delimiter(',')
      ->allow_extra_args(false);
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

CLI::Option* addTimeLimits(CLI::App& command, TimeArguments& times) {
  CLI::Option* const t0 = addTime(command, "--t0", times.t0, "Leave out events before this time");
  CLI::Option* const t1 = addTime(command, "--t1", times.t1, "Leave out events from this time on");
  command
      .add_option_function<std::string>(
          "--duration",
          [&times](const std::string& text) {
            const std::int64_t duration_ns = nanosecondsOf(text, "--duration");
            if (duration_ns <= 0) {
              throw CLI::ValidationError("--duration",
                                         inQuotes(text) + ": expected a time above 0");
            }
            times.duration_ns = duration_ns;
          },
          "Instead of --t1: the time from --t0, or from the first event")
      ->type_name("SECONDS")
      ->excludes(t1);
  return t0;
}

void addStrict(CLI::App& command, bool& strict) {
  command.add_flag("--strict", strict,
                   "A warning is an error: exit status 1, after the results are written");
}

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

void requireKeyframeLength(const TrackerFaults& faults) {
  const KeyframeNoiseOptions& keyframe = faults.perturbation.keyframe;
  if (!keyframe.any() || keyframe.length_ns) return;
  throw CLI::ValidationError(
      "--perturb",
      "keyframe_s: must be given with keyframe_noise_m and keyframe_noise_deg, 0.001 to 1e6 "
      "(seconds)");
}

namespace {

void addMapOptions(CLI::App& command, const std::shared_ptr<MapArguments>& arguments) {
  addMappingArguments(command, *arguments);
  addTimeLimits(command, arguments->times);
  command.add_flag("--resume", arguments->resume,
                   "Go on with the keyframes of a run that was stopped or killed, with the same "
                   "arguments: the result is that of one run. A complete result is not changed");
  command.add_flag(
      "--view", arguments->view,
      "Show the growing map in a window; the mouse turns, moves and zooms it. Closing it "
      "does not end the mapping. At the end it stays until a key is pressed in it or it is "
      "closed; without a terminal it closes at once");
  command
      .add_option("--record-frames", arguments->record_frames,
                  "Draw the growing map after each keyframe, without a screen: frame_000001.png, … "
                  "in DIR, with the trajectory, the newest depth map and rates")
      ->type_name("DIR");
}

}  // namespace

void addMap(CLI::App& app, Run& run) {
  CLI::App& command = *app.add_subcommand(
      "map", "Map a whole recording: keyframe depth maps and one point cloud, map.pcd");
  auto arguments = argumentsOf(command, run, runMap);
  addMapOptions(command, arguments);
  CLI::Option* const source = command.get_option("SOURCE")->required(false);
  command
      .add_option("--plan", arguments->plan,
                  "Make one shard of this plan (event-fusion plan), into --out; the plan has all "
                  "other arguments")
      ->type_name("FILE")
      ->excludes(source);
  command
      .add_option("--shard", arguments->shard,
                  "Its number, from 0 (default: that of GNU parallel, Slurm, Kubernetes or AWS "
                  "Batch)")
      ->needs("--plan")
      ->type_name("K");
  command.parse_complete_callback([arguments, command = &command] {
    if (!arguments->plan.empty()) {
      const std::set<std::string> own = {"help", "help-all", "plan",  "shard",
                                         "out",  "force",    "quiet", "verbose"};
      for (const CLI::Option* option : command->get_options()) {
        if (option->count() == 0 ||
            own.count(option->get_lnames().empty() ? "" : option->get_lnames().front()) > 0)
          continue;
        throw CLI::ValidationError(option->get_name(),
                                   "the plan has it: expected --shard, --out and --force alone");
      }
      return;
    }
    if (arguments->source.files.empty()) throw CLI::RequiredError("SOURCE");
    takeConfig(*arguments);
  });
}

MapArguments mapArgumentsOf(const std::vector<std::string>& words) {
  CLI::App app("", "event-fusion");
  CLI::App& command = *app.add_subcommand("map");
  auto arguments = std::make_shared<MapArguments>();
  addMapOptions(command, arguments);
  command.parse_complete_callback([arguments] { takeConfig(*arguments); });
  std::vector<std::string> reversed(words.rbegin(), words.rend());
  reversed.emplace_back("map");
  try {
    app.parse(reversed);
  } catch (const CLI::ParseError& error) {
    throw UsageError(errorText(app, error));
  }
  return *arguments;
}

void addShards(CLI::App& app, Run& run) {
  CLI::App& plan = *app.add_subcommand("plan",
                                       "Divide the map of a recording into shards, for several "
                                       "machines or processes: plan RECORDING "
                                       "[options of map] --shards N --out plan.json");
  auto planned = argumentsOf(plan, run, runPlan);
  plan.allow_extras();
  plan.add_option("--shards", planned->shards, "Number of shards; 64 keyframes are not divided")
      ->required()
      ->check(between(1, 1e6, "1 to 1000000"))
      ->type_name("N");
  plan.add_option("-o,--out", planned->out, "The file to write")->required()->type_name("FILE");
  addVerbosity(plan, planned->verbosity);
  plan.parse_complete_callback([planned, &plan] { planned->words = plan.remaining(); });

  CLI::App& join =
      *app.add_subcommand("join", "Make the map of all shards of a plan: that of one run");
  auto joined = argumentsOf(join, run, runJoin);
  join.add_option("PLAN", joined->plan, "plan.json")->required()->type_name("FILE");
  join.add_option("SHARD", joined->shards, "The folders of all shards, in any order")
      ->required()
      ->type_name("DIR");
  join.add_option("-o,--out", joined->out, "Folder for the results, as of map")
      ->required()
      ->type_name("DIR");
  addVerbosity(join, joined->verbosity);
}

void addDepth(CLI::App& app, Run& run) {
  CLI::App& command =
      *app.add_subcommand("depth", "Make the depth map of one time window of a recording");
  auto arguments = argumentsOf(command, run, runDepth);
  addMappingArguments(command, *arguments);
  addTimeLimits(command, arguments->times)->required();
  addTime(command, "--ref-time", arguments->t_ref,
          "Time of the reference view; by default the middle of the window");
  command.parse_complete_callback([arguments] {
    takeConfig(*arguments);
    if (!arguments->times.t1 && !arguments->times.duration_ns) throw CLI::RequiredError("--t1");
  });
  command.add_flag("--save-dsi", arguments->save_dsi,
                   "Also write the whole DSI, dsi.npy (float32, [plane][row][column])");
}

}  // namespace efm
