// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "mapping/base/atomic_file.h"
#include "mapping/base/option.h"
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

void requireThreshold(const char* option, const std::optional<double>& threshold) {
  if (!threshold) return;
  requireOption(*threshold >= EventPixelOptions::kMinThreshold && std::isfinite(*threshold), option,
                *threshold, "0.01 or more (log intensity)");
}

void requireRate(const char* option, double hz) {
  requireOption(hz >= 0 && hz <= EventNoiseOptions::kMaxHz, option, hz,
                "0 to 1e5 (events per second and pixel)");
}

/// Checks the ranges of the arguments. The simulator checks them, too, but these errors have the
/// names and units of the command line.
void requireRanges(const SimulateArguments& arguments) {
  if (arguments.duration_s) {
    requireOption(*arguments.duration_s >= 0.001 && *arguments.duration_s <= 600, "--duration",
                  *arguments.duration_s, "0.001 to 600 (seconds)");
  }
  requireThreshold("--threshold-on", arguments.threshold_on);
  requireThreshold("--threshold-off", arguments.threshold_off);
  requireOption(arguments.mismatch >= 0 && arguments.mismatch <= 0.5, "--mismatch",
                arguments.mismatch, "0 to 0.5 (a share of the thresholds)");
  requireOption(arguments.refractory_us >= 0 && arguments.refractory_us <= 1e6, "--refractory-us",
                arguments.refractory_us, "0 to 1e6 (microseconds)");
  requireRate("--noise-hz", arguments.noise.background_hz);
  requireOption(arguments.noise.hot_fraction >= 0 && arguments.noise.hot_fraction <= 1,
                "--hot-pixels", arguments.noise.hot_fraction, "0 to 1 (a share of the pixels)");
  requireRate("--hot-hz", arguments.noise.hot_hz);
}

Simulation makePreset(const SimulateArguments& arguments) {
  SimulationOptions options;
  options.preset = arguments.preset;
  options.duration_s = arguments.duration_s;
  options.seed = arguments.seed;
  return makeSimulation(options);
}

Simulation makeOnTrajectory(const SimulateArguments& arguments) {
  TrajectorySimulationOptions options;
  options.scene = arguments.scene;
  options.start_ns = arguments.start_ns;
  options.duration_s = arguments.duration_s;
  options.seed = arguments.seed;
  ReaderOptions reader;
  reader.pose_time_unit = arguments.time_unit;
  const std::vector<StampedPose> poses = readPoses(arguments.trajectory, reader);
  const Calibration calibration = readCalibration(arguments.calibration);
  Rig rig = calibration.rig;
  for (RigCamera& camera : rig.cameras) {
    camera.time_offset_ns = 0;  // they share a clock
    if (camera.model.width > 0) continue;
    throw std::runtime_error(calibration.file.string() +
                             ": no size of the sensor: expected a calibration that has it, as a "
                             "camera chain or nine numbers and width height");
  }
  try {
    return makeTrajectorySimulation(options, poses, rig);
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(arguments.trajectory.string() + ": " + error.what());
  }
}

void setPixels(const SimulateArguments& arguments, Simulation& simulation) {
  EventPixelOptions& pixels = simulation.pixels;
  pixels.threshold_on = arguments.threshold_on.value_or(pixels.threshold_on);
  pixels.threshold_off = arguments.threshold_off.value_or(pixels.threshold_off);
  pixels.mismatch = arguments.mismatch;
  pixels.refractory_ns = durationFromSeconds(arguments.refractory_us * 1e-6);
  simulation.noise = arguments.noise;
  pixels.validate();
  simulation.noise.validate();
}

void addPixelOptions(CLI::App& command, SimulateArguments& arguments) {
  const auto add = [&](const char* name, auto& value, const char* help) {
    return command.add_option(name, value, help)->group("Pixels (ideal by default)");
  };
  add("--threshold-on", arguments.threshold_on,
      "Increase of log intensity per ON event; by default the preset's, or 0.3");
  add("--threshold-off", arguments.threshold_off,
      "Decrease of log intensity per OFF event; by default the preset's, or 0.3");
  add("--mismatch", arguments.mismatch,
      "Standard deviation of the pixels' thresholds, as a fraction of them, 0 to 0.5")
      ->capture_default_str();
  add("--refractory-us", arguments.refractory_us,
      "Dead time of a pixel after an event, in microseconds")
      ->capture_default_str();
  add("--noise-hz", arguments.noise.background_hz, "Background noise: events per second and pixel")
      ->capture_default_str();
  add("--hot-pixels", arguments.noise.hot_fraction, "Fraction of hot pixels, 0 to 1")
      ->capture_default_str();
  add("--hot-hz", arguments.noise.hot_hz, "Events per second of a hot pixel")
      ->capture_default_str();
}

}  // namespace

int runSimulate(const SimulateArguments& arguments) {
  asUsage([&] { requireRanges(arguments); });
  Simulation simulation =
      arguments.preset.empty() ? makeOnTrajectory(arguments) : makePreset(arguments);
  setPixels(arguments, simulation);
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
  CLI::Option* preset = command.add_option("--preset", arguments->preset, "Scene, rig and motion")
                            ->check(oneOf(simulationPresets()));
  CLI::Option* scene = command
                           .add_option("--scene", arguments->scene,
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
      ->check(zeroOrMore())
      ->capture_default_str();
  addPixelOptions(command, *arguments);
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
