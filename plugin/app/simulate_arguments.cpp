// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/app/simulate_arguments.h"

#include <CLI/CLI.hpp>
#include <string>

#include "plugin/app/argument_checks.h"
#include "plugin/app/simulate_command.h"
#include "plugin/app/source_arguments.h"
#include "tracking_stub/presets/presets.h"
#include "tracking_stub/presets/trajectory_simulation.h"

namespace efm {
namespace {

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

}  // namespace

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
