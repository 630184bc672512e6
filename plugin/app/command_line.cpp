// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/app/command_line.h"

#include <CLI/CLI.hpp>
#include <memory>
#include <optional>
#include <string>

#include "mapping/quoted_text.h"
#include "mapping/timestamp.h"
#include "plugin/app/evaluate_command.h"
#include "plugin/app/import_command.h"
#include "plugin/app/info_command.h"
#include "plugin/app/map_command.h"
#include "plugin/app/simulate_command.h"
#include "plugin/recording.h"

namespace efm {
namespace {

using Run = std::function<int()>;

/// A command whose arguments live as long as the program's description.
template <typename Arguments>
std::shared_ptr<Arguments> onCommand(CLI::App& command, Run& run,
                                     int (*handler)(const Arguments&)) {
  auto arguments = std::make_shared<Arguments>();
  command.callback([arguments, handler, &run] { run = [=] { return handler(*arguments); }; });
  return arguments;
}

template <typename Arguments>
void addSource(CLI::App& command, Arguments& arguments) {
  command
      .add_option("SOURCE", arguments.source.files,
                  "The recording: a rawlog, or a folder with text files (camchain.yaml, "
                  "cam0/events.txt, poses.txt; or the UZH layout events.txt, groundtruth.txt, "
                  "calib.txt)")
      ->required();
  command
      .add_option("--format", arguments.source.format,
                  "How the recording is stored (auto: look at it)")
      ->check(CLI::IsMember(recordingFormats()))
      ->capture_default_str();
  command
      .add_option("--poses", arguments.source.poses,
                  "Poses in place of the recording's: t tx ty tz qx qy qz qw, the rig in the world")
      ->type_name("TUM.txt");
  command
      .add_option("--calibration", arguments.source.calibration,
                  "Calibration in place of the recording's: a Kalibr camera chain (YAML), or fx fy "
                  "cx cy k1 k2 p1 p2 k3 of one camera")
      ->type_name("FILE");
  command
      .add_option("--hand-eye", arguments.source.hand_eye,
                  "Where the rig is on the tracked body: YAML with T_body_rig, 4x4; the poses are "
                  "then the body's")
      ->type_name("FILE");
}

/// A time in seconds of the recording's own clock, exact to the nanosecond.
void setTime(const std::string& text, const std::string& name, std::int64_t& t_ns) {
  const std::optional<std::int64_t> parsed = parseSeconds(text);
  if (!parsed) {
    throw CLI::ValidationError(name, inQuotes(text) + ": expected a time in seconds");
  }
  if (*parsed >= kEndOfTimeNs || *parsed <= -kEndOfTimeNs) {
    throw CLI::ValidationError(name, inQuotes(text) + ": expected a time within 4.6e9 s of 0");
  }
  t_ns = *parsed;
}

CLI::Option* addTime(CLI::App& command, const std::string& name, std::int64_t& t_ns,
                     const std::string& help) {
  return command
      .add_option_function<std::string>(
          name, [&t_ns, name](const std::string& text) { setTime(text, name, t_ns); }, help)
      ->type_name("SECONDS");
}

void addTime(CLI::App& command, const std::string& name, std::optional<std::int64_t>& t_ns,
             const std::string& help) {
  command
      .add_option_function<std::string>(
          name, [&t_ns, name](const std::string& text) { setTime(text, name, t_ns.emplace(0)); },
          help)
      ->type_name("SECONDS");
}

template <typename Arguments>
void addTimeLimits(CLI::App& command, Arguments& arguments) {
  addTime(command, "--t0", arguments.t0_ns, "Leave out events before this time");
  addTime(command, "--t1", arguments.t1_ns, "Leave out events from this time on");
}

void addMappingArguments(CLI::App& command, MappingArguments& arguments) {
  command
      .add_option("CONFIG", arguments.config,
                  "The options: an .ini file, see config/default.ini for all keys")
      ->required();
  addSource(command, arguments);
  command.add_option("--out", arguments.out, "Folder for the results; made where missing")
      ->required()
      ->type_name("DIR");
  command
      .add_option("--set", arguments.sets,
                  "Overrides one option of CONFIG, e.g. --set dsi.num_planes=200; may be repeated")
      ->type_name("SECTION.KEY=VALUE")
      ->allow_extra_args(false);
}

void addSimulate(CLI::App& app, Run& run) {
  CLI::App& command = *app.add_subcommand(
      "simulate", "Make a recording with exact ground truth, as a dataset folder");
  auto arguments = onCommand(command, run, runSimulate);
  command.add_option("--preset", arguments->simulation.preset, "Scene, rig and motion")
      ->required()
      ->check(CLI::IsMember(simulationPresets()));
  command
      .add_option("--duration", arguments->simulation.duration_s,
                  "Length of the recording; the preset's own by default")
      ->type_name("SECONDS");
  command.add_option("--seed", arguments->simulation.seed, "Of everything random")
      ->capture_default_str();
  command.add_option("--out", arguments->out, "The folder to write; must not exist or be empty")
      ->required()
      ->type_name("DIR");
}

void addImport(CLI::App& app, Run& run) {
  CLI::App& command =
      *app.add_subcommand("import", "Turn a recording into a rawlog, MRPT's format");
  auto arguments = onCommand(command, run, runImport);
  addSource(command, *arguments);
  command.add_option("--out", arguments->out, "The rawlog to write")
      ->required()
      ->type_name("FILE.rawlog");
  addTimeLimits(command, *arguments);
}

void addMap(CLI::App& app, Run& run) {
  CLI::App& command = *app.add_subcommand(
      "map", "Map a whole recording: keyframe depth maps and one point cloud, map.pcd");
  auto arguments = onCommand(command, run, runMap);
  addMappingArguments(command, *arguments);
  addTimeLimits(command, *arguments);
}

void addDepth(CLI::App& app, Run& run) {
  CLI::App& command =
      *app.add_subcommand("depth", "Make the depth map of one stretch of a recording");
  auto arguments = onCommand(command, run, runDepth);
  addMappingArguments(command, *arguments);
  addTime(command, "--t0", arguments->t0_ns, "Where the stretch begins")->required();
  addTime(command, "--t1", arguments->t1_ns, "Where it ends; not part of it")->required();
  addTime(command, "--ref-time", arguments->t_ref_ns,
          "Time of the reference view; the middle of the stretch by default");
  command.add_flag("--save-dsi", arguments->save_dsi,
                   "Also write the whole DSI, dsi.npy (float32, [plane][row][column])");
}

void addEvaluate(CLI::App& app, Run& run) {
  CLI::App& evaluate = *app.add_subcommand("evaluate", "Hold results against the truth");
  evaluate.require_subcommand(1);
  CLI::App& command = *evaluate.add_subcommand(
      "depth", "Errors of depth maps: one file against another, or folders paired by time");
  auto arguments = onCommand(command, run, runEvaluateDepth);
  command
      .add_option("EST", arguments->estimate,
                  "Depth map (float32 TIFF, metres), or what `map` or `depth` wrote")
      ->required();
  command.add_option("GT", arguments->truth, "True depth map, or a folder of them with index.txt")
      ->required();
  command.add_option("--focal", arguments->focal_px, "Focal length in pixels, for bad-pix");
  command.add_option("--baseline", arguments->baseline_m, "Baseline in metres, for bad-pix");
  command
      .add_option("--tolerance-px", arguments->pairing.tolerance_px,
                  "Compare with the best truth within so many pixels")
      ->capture_default_str();
  command.add_option("--max-depth", arguments->pairing.max_depth_m,
                     "Leave out truth beyond this depth in metres");
  command.add_flag("--json", arguments->json, "Print JSON instead of a table");
}

void addInfo(CLI::App& app, Run& run) {
  CLI::App& command = *app.add_subcommand("info", "Say what a recording holds");
  auto arguments = onCommand(command, run, runInfo);
  addSource(command, *arguments);
  addTimeLimits(command, *arguments);
}

}  // namespace

void addCommands(CLI::App& app, Run& run) {
  app.require_subcommand(1);
  for (const auto add : {addSimulate, addImport, addMap, addDepth, addEvaluate, addInfo}) {
    add(app, run);
  }
}

}  // namespace efm
