// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/app/commands.h"

#include <CLI/CLI.hpp>
#include <map>

#include "mapping/base/text.h"
#include "mapping/geometry/timestamp.h"
#include "plugin/app/arguments.h"
#include "plugin/app/program.h"

namespace efm {
namespace {

void addImport(CLI::App& app, Run& run) {
  CLI::App& command =
      *app.add_subcommand("import", "Turn a recording into a rawlog, MRPT's format");
  auto arguments = argumentsOf(command, run, runImport);
  addSource(command, arguments->source);
  command.add_option("--out", arguments->out, "The rawlog to write")
      ->required()
      ->type_name("FILE.rawlog");
  addTimeLimits(command, arguments->times);
  static const std::map<std::string, RawlogCompression> kCompressions = {
      {"gzip", RawlogCompression::kGzip},
      {"zstd", RawlogCompression::kZstd},
      {"none", RawlogCompression::kNone}};
  command
      .add_option_function<std::string>(
          "--compression",
          [arguments](const std::string& name) { arguments->compression = kCompressions.at(name); },
          "gzip: the whole rawlog (default). zstd: the events alone, in a plain rawlog; "
          "faster to write and to read. none")
      ->check(oneOf({"gzip", "zstd", "none"}))
      ->type_name("");
  command
      .add_option_function<std::string>(
          "--packet-s",
          [arguments](const std::string& text) {
            const std::optional<std::int64_t> length_ns = parseSeconds(text);
            if (!length_ns || *length_ns < 1'000 || *length_ns > kNanosecondsPerSecond) {
              throw CLI::ValidationError("--packet-s",
                                         inQuotes(text) + ": expected 0.000001 to 1 seconds");
            }
            arguments->source.packet_ns = *length_ns;
          },
          "Length of a packet of events (default 0.01)")
      ->type_name("SECONDS");
  addVerbosity(command, arguments->verbosity);
  command.parse_complete_callback([arguments] { requireKeyframeLength(arguments->source.faults); });
}

void addExport(CLI::App& app, Run& run) {
  CLI::App& command = *app.add_subcommand(
      "export",
      "Write a recording for other tools: text, MCAP; or the map of sessions "
      "(session.mcap) again: .pcd, .ply, .html, .simplemap, .mcap, a folder colmap");
  auto arguments = argumentsOf(command, run, runExport);
  addSource(command, arguments->source);
  const auto name_example = [](const std::string& format) {
    return format == "dsec" ? "'dsec': Python writes it: examples/python/export_dsec.py"
                            : std::string();
  };
  command.add_option("--to", arguments->format, "The format to write (recordings)")
      ->check(CLI::Validator(name_example, ""))
      ->check(oneOf(exportFormats()));
  command
      .add_option("--set", arguments->sets,
                  "Sessions: another option of [map], or a higher depth.min_probability; may be "
                  "repeated")
      ->type_name("SECTION.KEY=VALUE")
      ->allow_extra_args(false);
  command
      .add_option("--transform", arguments->transforms,
                  "Sessions: T_first_this of the second session and further ones, as --hand-eye is "
                  "read; once per session")
      ->type_name("FILE")
      ->allow_extra_args(false);
  command.add_flag("--register", arguments->registers,
                   "Sessions: correct the transforms by what the keyframes see: about 5 % of the "
                   "scene's depth, and 3 degrees");
  command.add_flag("--store", arguments->store,
                   "Sessions: add the poses of --poses FILE to the session, for later exports");
  constexpr int kCorners = 6;
  command.add_option("--box", arguments->box_m, "Sessions: the points inside alone, world metres")
      ->type_name("X0,Y0,Z0,X1,Y1,Z1")
      ->delimiter(',')
      ->expected(kCorners);
  command.add_option("--out", arguments->out, "The folder or the file to write; a new one")
      ->required()
      ->type_name("PATH");
  addTimeLimits(command, arguments->times);
  addVerbosity(command, arguments->verbosity);
  command.parse_complete_callback([arguments] { requireKeyframeLength(arguments->source.faults); });
}

void addInfo(CLI::App& app, Run& run) {
  CLI::App& command = *app.add_subcommand(
      "info", "Print the contents of a recording, or the processor and its kernels");
  auto arguments = argumentsOf(command, run, runInfo);
  addSource(command, arguments->source);
  addTimeLimits(command, arguments->times);
  addStrict(command, arguments->strict);
  addVerbosity(command, arguments->verbosity);
  command.add_flag("--system", arguments->system,
                   "Print the processor and the kernels of the inner loops that it can run; "
                   "needs no recording");
  command.add_flag("--json", arguments->json, "Print JSON instead of text");
  command.get_option("SOURCE")->required(false);
  command.parse_complete_callback([arguments] {
    if (!arguments->system && arguments->source.files.empty()) throw CLI::RequiredError("SOURCE");
    requireKeyframeLength(arguments->source.faults);
  });
}

void addView(CLI::App& app, Run& run) {
  CLI::App& command = *app.add_subcommand("view", "Open a map's page, map.html, in the browser");
  auto arguments = argumentsOf(command, run, runView);
  command.add_option("DIR", arguments->path, "The folder that `map` wrote, or its map.html")
      ->required();
}

}  // namespace

void addVerbosity(CLI::App& command, Verbosity& verbosity, bool has_keyframes) {
  CLI::Option* const quiet = command.add_flag_callback(
      "-q,--quiet", [&verbosity] { verbosity = Verbosity::kQuiet; },
      "Print warnings and errors alone: no progress, no result");
  if (!has_keyframes) return;
  command
      .add_flag_callback(
          "-v,--verbose", [&verbosity] { verbosity = Verbosity::kVerbose; },
          "Also print a line per keyframe, with the time that it took")
      ->excludes(quiet);
}

std::function<int()> parseCommandLine(int argc, char** argv) {
  CLI::App app(
      "Maps with event cameras: events and poses in, semi-dense depth maps and one global point "
      "cloud out.\n\n"
      "From a recording to a map:\n"
      "  event-fusion info RECORDING             what it holds, and what is not plausible\n"
      "  event-fusion map  RECORDING --out out   makes a map; no option is needed\n"
      "  event-fusion view out                   opens out/map.html in the browser\n\n"
      "RECORDING is a rawlog, a folder, or the files of one recording. Without one:\n"
      "  event-fusion simulate --preset desk_stereo --out RECORDING\n",
      "event-fusion");
  app.set_version_flag("--version", std::string("event-fusion ") + EFM_VERSION);
  app.set_help_all_flag("--help-all", "Print the help of every command and exit");
  app.require_subcommand(1);
  app.footer(
      "Exit status:\n"
      "  0    the job is done\n"
      "  1    the job could not be done: data, files, disk, memory; or a warning, with --strict\n"
      "  2    the command line or an option file is wrong\n"
      "  75   of map --plan and join: try again (memory, disk, another process, a signal)\n"
      "  130  stopped as requested (Ctrl-C)");
  Run run;
  for (const auto add : {addSimulate, addImport, addExport, addMap, addDepth, addShards,
                         addEvaluate, addInfo, addView}) {
    add(app, run);
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() != 0) throw UsageError(errorText(app, error));
    return [status = app.exit(error)] { return status; };  // prints help or the version
  }
  return run;
}

}  // namespace efm
