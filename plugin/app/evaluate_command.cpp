// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <iostream>
#include <stdexcept>
#include <string>
#include <utility>

#include "plugin/app/arguments.h"
#include "plugin/app/commands.h"
#include "plugin/evaluation/cloud_evaluation.h"
#include "plugin/evaluation/depth_evaluation.h"
#include "plugin/evaluation/trajectory_evaluation.h"

namespace efm {
namespace {

/// Returns the given focal length and baseline; a missing value comes from the folders.
std::optional<StereoBaseline> stereoBaseline(const EvaluateDepthArguments& arguments) {
  if (arguments.focal_px && arguments.baseline_m) {
    return StereoBaseline{*arguments.focal_px, *arguments.baseline_m, "as given"};
  }
  std::optional<StereoBaseline> stereo = findStereoBaseline(arguments.estimate, arguments.truth);
  if (!stereo && (arguments.focal_px || arguments.baseline_m)) {
    throw std::invalid_argument(
        fmt::format("bad-pix needs both --focal and --baseline: neither {} nor {} says the other",
                    arguments.estimate.string(), arguments.truth.string()));
  }
  if (arguments.focal_px) stereo->focal_px = *arguments.focal_px;
  if (arguments.baseline_m) stereo->baseline_m = *arguments.baseline_m;
  return stereo;
}

/// Prints the errors.
int finish(const EvaluateArguments& arguments, const std::string& table, const std::string& json) {
  std::cout << (arguments.json ? json : table);
  return 0;
}

/// Adds the options of the output, after estimate and truth.
/// @param figure the call of Python that draws what `--plot` drew in earlier versions.
void addOutput(CLI::App& command, EvaluateArguments& arguments, const char* figure) {
  command.add_flag("--json", arguments.json, "Print JSON instead of a table; the keys are below");
  const auto reject = [figure, &arguments](const std::string& file) {
    const std::string drawn =
        fmt::format(fmt::runtime(figure), arguments.estimate.string(), arguments.truth.string());
    throw CLI::ValidationError(
        "--plot", fmt::format("Python draws figures: python3 -c 'import event_fusion as ef; from "
                              "event_fusion import plot; {}.figure.savefig(\"{}\")'",
                              drawn, file));
  };
  command.add_option_function<std::string>("--plot", reject)->group("");  // not in --help
}

/// Adds an option with a list of positive numbers.
CLI::Option* addList(CLI::App& command, const std::string& name, std::vector<double>& values,
                     const std::string& help) {
  return command.add_option(name, values, help)
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(aboveZero())
      ->type_name("A,B,...");
}

void addEvaluateDepth(CLI::App& evaluate, Run& run) {
  CLI::App& command = *evaluate.add_subcommand(
      "depth",
      "Errors of depth maps: of one file, or of folders, paired by time (within 1 ms).\n"
      "Maps are float32 TIFF, PFM, NPY (float32, float64) in metres, or 16-bit PNG with --scale; "
      "0, negative, infinite and NaN mean no depth.");
  auto arguments = argumentsOf(command, run, runEvaluateDepth);
  DepthEvaluationOptions& options = arguments->options;
  command
      .add_option(
          "EST", arguments->estimate,
          "Estimated depth map; the folder of `depth` (if GT is a file); the folder of `map`; or a "
          "folder of maps with index.txt (lines `t file`) or with their times as names")
      ->required();
  command
      .add_option("GT", arguments->truth,
                  "True depth map; a dataset folder with depth/index.txt; or a folder as above")
      ->required();
  command
      .add_option("--focal", arguments->focal_px,
                  "Focal length in pixels, for bad-pix; by default from EST's report.json or from "
                  "GT's camchain.yaml")
      ->check(aboveZero());
  command
      .add_option("--baseline", arguments->baseline_m,
                  "Baseline in metres, for bad-pix; by default from the same file")
      ->check(aboveZero());
  command
      .add_option("--max-depth", options.pairing.max_depth_m,
                  "Leave out truth beyond this depth in metres")
      ->check(aboveZero());
  command
      .add_option("--scale", options.png_scale,
                  "Of 16-bit PNG, units per metre (1000: millimetres, 256: KITTI, 5000: TUM); "
                  "below 1 metres per unit")
      ->check(aboveZero());
  command
      .add_option("--mask", options.mask,
                  "Compare only the pixels that are not black in this image")
      ->type_name("PNG");
  command
      .add_option("--tolerance-px", options.pairing.tolerance_px,
                  "Compare with the best truth within this distance in pixels")
      ->capture_default_str()
      ->check(zeroOrMore());
  addList(command, "--thresholds", options.thresholds_m,
          "Error thresholds in metres for precision (fraction of the estimates with a truth whose "
          "error is within the threshold), recall (fraction of the true pixels with such an "
          "estimate) and F1")
      ->capture_default_str();
  addOutput(command, *arguments, R"(plot.precision_recall(ef.evaluate.depth("{}", "{}")))");
  command.footer(depthEvaluationKeys());
}

void addEvaluateMap(CLI::App& evaluate, Run& run) {
  CLI::App& command = *evaluate.add_subcommand(
      "map",
      "Accuracy, completeness and outliers of a point cloud. Clouds are PCD (ascii, binary, "
      "compressed) or PLY (ascii, binary)");
  auto arguments = argumentsOf(command, run, runEvaluateMap);
  command.add_option("EST", arguments->estimate, "The map, or the folder of `map`")->required();
  command
      .add_option("GT", arguments->truth,
                  "The true surfaces as points, or a dataset folder with gt_cloud.ply")
      ->required();
  command
      .add_option("--to-find", arguments->options.to_find,
                  "The true points for completeness, if not all of GT: gt_edges.ply of a simulated "
                  "dataset has the surfaces that fired events")
      ->type_name("FILE");
  command.add_flag("--align", arguments->options.align,
                   "Align the map with the truth first (ICP: rotation and translation, no scale), "
                   "for a truth in another frame, near the map's");
  addList(command, "--distances", arguments->options.distances_m,
          "Distances in metres for completeness and outliers")
      ->capture_default_str();
  addOutput(command, *arguments, R"(plot.precision_recall(ef.evaluate.map("{}", "{}")))");
  command.footer(cloudEvaluationKeys());
}

void addEvaluateTrajectory(CLI::App& evaluate, Run& run) {
  CLI::App& command = *evaluate.add_subcommand(
      "trajectory",
      "Absolute and relative errors of poses, as evo and rpg_trajectory_evaluation define them. "
      "Trajectories are files that `map --poses` reads");
  auto arguments = argumentsOf(command, run, runEvaluateTrajectory);
  command
      .add_option(
          "EST", arguments->estimate,
          "The estimate, or the folder of `map` (its trajectory.txt: the keyframes' poses, as the "
          "recording has them or as refined)")
      ->required();
  command
      .add_option("GT", arguments->truth,
                  "The truth, or a dataset folder (its poses.txt or groundtruth.txt)")
      ->required();
  command
      .add_option(
          "--max-diff", arguments->options.max_difference_s,
          "Maximum time in seconds between the two poses of a pair; each pose of the shorter "
          "file is paired with the nearest of the other")
      ->capture_default_str()
      ->check(zeroOrMore());
  command
      .add_option("--align", arguments->alignment,
                  "For absolute errors: se3 (least-squares rotation and translation, no scale), "
                  "origin (the first poses coincide) or none")
      ->check(oneOf({"se3", "origin", "none"}))
      ->capture_default_str();
  addTimeUnit(command, "--pose-time-unit", arguments->options.estimate_time_unit,
              "Unit of EST's times, where the file names none");
  addTimeUnit(command, "--truth-time-unit", arguments->options.truth_time_unit,
              "Unit of GT's times, where the file names none");
  addList(command, "--lengths", arguments->lengths_m,
          "Relative errors over sub-trajectories of these lengths in metres; without --lengths, "
          "--deltas and --frames: over 10 to 50 % of the true length, 1 second and 1 frame");
  addList(command, "--deltas", arguments->deltas_s, "Relative errors over these times in seconds");
  addList(command, "--frames", arguments->frames, "Relative errors over these numbers of pairs");
  addOutput(command, *arguments,
            R"py(plot.trajectory(ef.read_poses("{}"), ef.read_poses("{}")))py");
  command.footer(trajectoryEvaluationKeys());
}

}  // namespace

int runEvaluateDepth(const EvaluateDepthArguments& arguments) {
  const std::optional<StereoBaseline> stereo = stereoBaseline(arguments);
  DepthEvaluationOptions options = arguments.options;
  if (stereo) options.focal_baseline = stereo->focal_px * stereo->baseline_m;
  const DepthEvaluation evaluation = evaluateDepth(arguments.estimate, arguments.truth, options);
  return finish(arguments, evaluationTable(evaluation, stereo), evaluationJson(evaluation, stereo));
}

int runEvaluateMap(const EvaluateMapArguments& arguments) {
  const CloudEvaluation evaluation =
      evaluateCloud(arguments.estimate, arguments.truth, arguments.options);
  return finish(arguments, evaluationTable(evaluation), evaluationJson(evaluation));
}

int runEvaluateTrajectory(const EvaluateTrajectoryArguments& arguments) {
  using Unit = RelativeSpacing::Unit;
  TrajectoryEvaluationOptions options = arguments.options;
  options.alignment = valueIn(kTrajectoryAlignments, arguments.alignment);
  for (const auto& [unit, amounts] : {std::pair{Unit::kFrames, &arguments.frames},
                                      {Unit::kSeconds, &arguments.deltas_s},
                                      {Unit::kMetres, &arguments.lengths_m}}) {
    for (const double amount : *amounts) options.spacings.push_back({unit, amount});
  }
  const TrajectoryEvaluation evaluation =
      evaluateTrajectory(arguments.estimate, arguments.truth, options);
  return finish(arguments, evaluationTable(evaluation), evaluationJson(evaluation));
}

void addEvaluate(CLI::App& app, Run& run) {
  CLI::App& evaluate = *app.add_subcommand("evaluate", "Compare results with the truth");
  evaluate.require_subcommand(1);
  for (const auto add : {addEvaluateDepth, addEvaluateMap, addEvaluateTrajectory})
    add(evaluate, run);
}

}  // namespace efm
