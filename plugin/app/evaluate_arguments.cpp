// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/app/evaluate_arguments.h"

#include <CLI/CLI.hpp>
#include <string>

#include "plugin/app/evaluate_command.h"
#include "plugin/evaluation/depth_evaluation_text.h"

namespace efm {
namespace {

void addOutput(CLI::App& command, EvaluationOutput& output, const std::string& plotted) {
  command.add_flag("--json", output.json, "Print JSON instead of a table; its keys are below");
  command.add_option("--plot", output.plot, "Also draw " + plotted)->type_name("FILE.png");
}

/// A list of lengths or times, separated by commas.
CLI::Option* addList(CLI::App& command, const std::string& name, std::vector<double>& values,
                     const std::string& help) {
  return command.add_option(name, values, help)
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(CLI::PositiveNumber)
      ->type_name("A,B,...");
}

void addDepth(CLI::App& evaluate, Run& run) {
  CLI::App& command = *evaluate.add_subcommand(
      "depth",
      "Errors of depth maps: one file against another, or folders paired by time (within 1 ms) and "
      "taken together.\n"
      "Maps are float32 TIFF, PFM, NPY (float32, float64) in metres, or 16-bit PNG with --scale; "
      "0, "
      "negative, infinite and NaN mean no depth.");
  auto arguments = onCommand(command, run, runEvaluateDepth);
  DepthEvaluationOptions& options = arguments->options;
  command
      .add_option(
          "EST", arguments->estimate,
          "Depth map; what `depth` wrote (against a file); what `map` wrote; or a folder of "
          "maps with index.txt (`t file` a line) or their time as name")
      ->required();
  command
      .add_option("GT", arguments->truth,
                  "True depth map; a dataset folder with depth/index.txt; or a folder as above")
      ->required();
  command
      .add_option("--focal", arguments->focal_px,
                  "Focal length in pixels, for bad-pix; by default what EST's report.json or the "
                  "camchain.yaml beside GT says")
      ->check(CLI::PositiveNumber);
  command
      .add_option("--baseline", arguments->baseline_m,
                  "Baseline in metres, for bad-pix; by default as --focal")
      ->check(CLI::PositiveNumber);
  command.add_option("--max-depth", options.pairing.max_depth_m,
                     "Leave out truth beyond this depth in metres");
  command.add_option("--scale", options.png_scale,
                     "Of 16-bit PNG: units per metre (1000: millimetres, 256: KITTI, 5000: TUM); "
                     "below 1, metres per unit");
  command
      .add_option("--mask", options.mask,
                  "Compare only pixels, of estimate and truth, where this image is not black")
      ->type_name("PNG");
  command
      .add_option("--tolerance-px", options.pairing.tolerance_px,
                  "Compare with the best truth within so many pixels")
      ->capture_default_str();
  addList(command, "--thresholds", options.thresholds_m,
          "Errors in metres for precision (share of estimates beside a truth that are at most so "
          "far off), recall (share of true pixels with such an estimate) and F1")
      ->capture_default_str();
  addOutput(command, arguments->output,
            "estimate, truth and error side by side, and precision, recall and F1");
  command.footer(depthEvaluationKeys());
}

void addMap(CLI::App& evaluate, Run& run) {
  CLI::App& command = *evaluate.add_subcommand(
      "map",
      "Accuracy, completeness and outliers of a point cloud. Clouds are PCD (ascii, binary, "
      "compressed) or PLY (ascii, binary)");
  auto arguments = onCommand(command, run, runEvaluateMap);
  command.add_option("EST", arguments->estimate, "The map, or the folder that `map` wrote")
      ->required();
  command
      .add_option("GT", arguments->truth,
                  "The true surfaces as points, or a dataset folder with gt_cloud.ply")
      ->required();
  command
      .add_option("--to-find", arguments->options.to_find,
                  "The true points that completeness asks for, where that is not all of GT: "
                  "gt_edges.ply of a simulated dataset is what fired events")
      ->type_name("FILE");
  addList(command, "--distances", arguments->options.distances_m,
          "Distances in metres for completeness and outliers")
      ->capture_default_str();
  addOutput(command, arguments->output, "accuracy, completeness and F1 over the distance");
  command.footer(cloudEvaluationKeys());
}

void addTrajectory(CLI::App& evaluate, Run& run) {
  CLI::App& command = *evaluate.add_subcommand(
      "trajectory",
      "Absolute and relative errors of poses, as evo and rpg_trajectory_evaluation define them. "
      "Trajectories are TUM files: t tx ty tz qx qy qz qw");
  auto arguments = onCommand(command, run, runEvaluateTrajectory);
  command
      .add_option(
          "EST", arguments->estimate,
          "The estimate, or the folder that `map` wrote (its trajectory.txt: the keyframes' poses)")
      ->required();
  command
      .add_option("GT", arguments->truth,
                  "The truth, or a dataset folder (its poses.txt or groundtruth.txt)")
      ->required();
  command
      .add_option("--max-diff", arguments->options.max_difference_s,
                  "Pair poses up to so many seconds apart, each of the shorter file with the "
                  "nearest of the other")
      ->capture_default_str()
      ->check(CLI::NonNegativeNumber);
  command
      .add_option("--align", arguments->alignment,
                  "For absolute errors: se3 (rotation and translation of least squares, no scale), "
                  "origin (the first poses coincide) or none")
      ->check(CLI::IsMember({"se3", "origin", "none"}))
      ->capture_default_str();
  addList(
      command, "--lengths", arguments->lengths_m,
      "Relative errors over sub-trajectories of these lengths in metres; by default, where none "
      "of these three is given, 10 to 50 % of the true length, 1 second and 1 frame");
  addList(command, "--deltas", arguments->deltas_s, "Relative errors over these times in seconds");
  addList(command, "--frames", arguments->frames, "Relative errors over so many pairs of poses");
  addOutput(command, arguments->output, "both trajectories, and the errors over time");
  command.footer(trajectoryEvaluationKeys());
}

}  // namespace

void addEvaluate(CLI::App& app, Run& run) {
  CLI::App& evaluate = *app.add_subcommand("evaluate", "Hold results against the truth");
  evaluate.require_subcommand(1);
  for (const auto add : {addDepth, addMap, addTrajectory}) add(evaluate, run);
}

}  // namespace efm
