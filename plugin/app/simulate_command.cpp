// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "mapping/base/atomic_file.h"
#include "mapping/geometry/timestamp.h"
#include "mapping/geometry/trajectory.h"
#include "plugin/app/arguments.h"
#include "plugin/app/commands.h"
#include "plugin/app/interruption.h"
#include "plugin/app/program.h"
#include "plugin/playback/progress.h"
#include "plugin/recordings/calibration/calibration_file.h"
#include "plugin/recordings/open/recording_formats.h"
#include "tracking_stub/presets/presets.h"
#include "tracking_stub/sensor/simulated_rig.h"
#include "tracking_stub/truth/dataset_writer.h"

namespace efm {
namespace {

void readRig(const SimulateArguments& arguments, SimulationOptions& options) {
  ReaderOptions reader;
  reader.pose_time_unit = arguments.time_unit;
  options.poses = readPoses(arguments.trajectory, reader);
  const Calibration calibration = readCalibration(arguments.calibration);
  options.cameras = calibration.rig.cameras;
  for (RigCamera& camera : options.cameras) {
    camera.time_offset_ns = 0;  // they share a clock
    if (camera.model.width > 0) continue;
    throw std::runtime_error(calibration.file.string() +
                             ": no size of the sensor: expected a calibration that has it, as a "
                             "camera chain or nine numbers and width height");
  }
}

Simulation simulationOf(const SimulateArguments& arguments) {
  SimulationOptions options = arguments.simulation;
  if (options.scene.empty()) return makeSimulation(options);
  readRig(arguments, options);
  try {
    return makeSimulation(options);
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(arguments.trajectory.string() + ": " + error.what());
  }
}

void addPixelOptions(CLI::App& command, SimulationOptions& options) {
  constexpr double kEndless = std::numeric_limits<double>::max();
  const auto add = [&](const char* name, auto& value, double low, double high, const char* range,
                       const char* help) {
    return command.add_option(name, value, help)
        ->group("Pixels (ideal by default)")
        ->check(between(low, high, range));
  };
  const auto add_threshold = [&](const char* name, std::optional<double>& value, const char* help) {
    add(name, value, EventPixelOptions::kMinThreshold, kEndless, "0.01 or more (log intensity)",
        help);
  };
  const auto add_rate = [&](const char* name, double& hz, const char* help) {
    add(name, hz, 0, EventNoiseOptions::kMaxHz, "0 to 1e5 (events per second and pixel)", help)
        ->capture_default_str();
  };
  add_threshold("--threshold-on", options.threshold_on,
                "Increase of log intensity per ON event; by default the preset's, or 0.3");
  add_threshold("--threshold-off", options.threshold_off,
                "Decrease of log intensity per OFF event; by default the preset's, or 0.3");
  add("--mismatch", options.mismatch, 0, 0.5, "0 to 0.5 (a share of the thresholds)",
      "Standard deviation of the pixels' thresholds, as a fraction of them, 0 to 0.5")
      ->capture_default_str();
  add("--refractory-us", options.refractory_us, 0, 1e6, "0 to 1e6 (microseconds)",
      "Dead time of a pixel after an event, in microseconds")
      ->capture_default_str();
  add_rate("--noise-hz", options.noise.background_hz,
           "Background noise: events per second and pixel");
  add("--hot-pixels", options.noise.hot_fraction, 0, 1, "0 to 1 (a share of the pixels)",
      "Fraction of hot pixels, 0 to 1")
      ->capture_default_str();
  add_rate("--hot-hz", options.noise.hot_hz, "Events per second of a hot pixel");
}

}  // namespace

int runSimulate(const SimulateArguments& arguments) {
  const Simulation simulation = simulationOf(arguments);
  const Interruption interruption;
  NewFolder folder(arguments.out);  // reports errors before the simulation runs
  std::vector<CameraRecording> recordings;
  {
    Progress progress("simulating", arguments.verbosity);
    SimulationRun run;
    run.progress = [&](double fraction) {
      interruption.check();
      progress.show(fraction);
    };
    recordings = simulateEvents(simulation, run);
    progress.begin("writing the recording");
    writeDataset(folder.temporary(), simulation, recordings, [&] { interruption.check(); });
    folder.finish();
  }
  if (arguments.verbosity == Verbosity::kQuiet) return 0;
  for (std::size_t c = 0; c < recordings.size(); ++c) {
    fmt::print("cam{}: {} events\n", c, recordings[c].events.size());
  }
  fmt::print("written to {}\n", arguments.out.string());
  return 0;
}

void addSimulate(CLI::App& app, Run& run) {
  CLI::App& command = *app.add_subcommand(
      "simulate",
      "Simulate a recording with exact ground truth, as a dataset folder: a preset, or a scene "
      "around a trajectory, seen by a calibrated rig");
  auto arguments = argumentsOf(command, run, runSimulate);
  SimulationOptions& options = arguments->simulation;
  CLI::Option* preset = command.add_option("--preset", options.preset, "Scene, rig and motion")
                            ->check(oneOf(simulationPresets()));
  CLI::Option* scene = command
                           .add_option("--scene", options.scene,
                                       "A scene around the trajectory; upwards is the cameras' -y")
                           ->check(oneOf(simulationScenes()))
                           ->excludes(preset);
  CLI::Option* trajectory =
      command
          .add_option(
              "--trajectory", arguments->trajectory,
              "Poses of camera 0 (z forward), a file that `map --poses` reads; the truth is "
              "this trajectory, low-pass filtered at 10 Hz")
          ->type_name("POSES");
  addTimeUnit(command, "--pose-time-unit", arguments->time_unit,
              "The unit of the trajectory's times, where the file names none");
  CLI::Option* calibration = command
                                 .add_option("--calibration", arguments->calibration,
                                             "The rig, a file that `map --calibration` reads")
                                 ->type_name("FILE");
  trajectory->needs(scene);
  calibration->needs(scene);
  scene->needs(trajectory)->needs(calibration);
  command
      .add_option_function<std::string>(
          "--start",
          [arguments](const std::string& text) {
            arguments->simulation.start_ns = nanosecondsOf(text, "--start");
          },
          "Start time on the trajectory, in its clock; by default the first half second with at "
          "least half the mean speed")
      ->type_name("SECONDS")
      ->needs(scene);
  command
      .add_option(
          "--duration", options.duration_s,
          "Duration of the recording; by default the preset's; on a trajectory 5, or less if "
          "it ends earlier")
      ->type_name("SECONDS")
      ->check(between(0.001, 600, "0.001 to 600 (seconds)"));
  command.add_option("--seed", options.seed, "Seed of all random numbers, a whole number from 0")
      ->check(zeroOrMore())
      ->capture_default_str();
  addPixelOptions(command, options);
  addVerbosity(command, arguments->verbosity);
  command.add_option("--out", arguments->out, "The folder to write: a new or an empty one")
      ->required()
      ->type_name("DIR");
  command.parse_complete_callback([preset, scene] {
    if (preset->count() + scene->count() == 0) {
      throw CLI::RequiredError("--preset, or --scene with --trajectory and --calibration,");
    }
  });
}

}  // namespace efm
