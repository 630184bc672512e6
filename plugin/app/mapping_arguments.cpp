// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/app/mapping_arguments.h"

#include <CLI/CLI.hpp>
#include <string>

#include "plugin/app/config_files.h"
#include "plugin/app/map_command.h"
#include "plugin/app/source_arguments.h"

namespace efm {
namespace {

/// The option files that come with the program, for the end of a help text.
std::string configList() {
  std::string list;
  for (const std::string& name : configNames()) list += (list.empty() ? "" : ", ") + name;
  return list.empty() ? "" : "Option files that come with the program: " + list;
}

/// An option file before the sources is taken like --config.
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

void addMap(CLI::App& app, Run& run) {
  CLI::App& command = *app.add_subcommand(
      "map", "Map a whole recording: keyframe depth maps and one point cloud, map.pcd");
  auto arguments = argumentsOf(command, run, runMap);
  addMappingArguments(command, *arguments);
  addTimeLimits(command, arguments->times);
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
  command.parse_complete_callback([arguments] { takeConfig(*arguments); });
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
