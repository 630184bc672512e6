// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/app/evaluate_command.h"

#include <fmt/format.h>

#include <iostream>
#include <stdexcept>
#include <utility>

#include "plugin/app/output_checks.h"
#include "plugin/evaluation/cloud_evaluation.h"
#include "plugin/evaluation/depth_evaluation.h"
#include "plugin/evaluation/trajectory_evaluation.h"
#include "plugin/results/pictures/picture.h"

namespace efm {
namespace {

/// The given focal length and baseline; a missing one comes from the folders.
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

TrajectoryAlignment alignmentOf(const std::string& name) {
  if (name == "se3") return TrajectoryAlignment::kSe3;
  if (name == "origin") return TrajectoryAlignment::kOrigin;
  if (name == "none") return TrajectoryAlignment::kNone;
  throw std::invalid_argument("--align " + name + ": expected se3, origin or none");
}

/// @param inputs files, or folders whose files are read.
void refusePlotOver(const EvaluationOutput& output,
                    const std::vector<std::filesystem::path>& inputs) {
  if (output.plot.empty()) return;
  refuseToReplace(output.plot, inputs);
  refuseFileIn(inputs, output.plot);
}

/// Writes the plot, if asked for, and prints the errors.
template <typename Plot>
int finish(const EvaluationOutput& output, const std::string& table, const std::string& json,
           Plot plot) {
  if (!output.plot.empty()) writePicture(output.plot, plot());
  std::cout << (output.json ? json : table);
  return 0;
}

}  // namespace

int runEvaluateDepth(const EvaluateDepthArguments& arguments) {
  refusePlotOver(arguments.output, {arguments.estimate, arguments.truth, arguments.options.mask});
  const std::optional<StereoBaseline> stereo = stereoBaseline(arguments);
  DepthEvaluationOptions options = arguments.options;
  if (stereo) options.focal_baseline = stereo->focalBaseline();
  const DepthEvaluation evaluation = evaluateDepth(arguments.estimate, arguments.truth, options);
  return finish(arguments.output, evaluationTable(evaluation, stereo),
                evaluationJson(evaluation, stereo),
                [&] { return evaluationPlot(evaluation, options); });
}

int runEvaluateMap(const EvaluateMapArguments& arguments) {
  refusePlotOver(arguments.output,
                 {arguments.estimate, arguments.truth, arguments.options.to_find});
  const CloudEvaluation evaluation =
      evaluateCloud(arguments.estimate, arguments.truth, arguments.options);
  return finish(arguments.output, evaluationTable(evaluation), evaluationJson(evaluation),
                [&] { return evaluationPlot(evaluation); });
}

int runEvaluateTrajectory(const EvaluateTrajectoryArguments& arguments) {
  refusePlotOver(arguments.output, {arguments.estimate, arguments.truth});
  using Unit = RelativeSpacing::Unit;
  TrajectoryEvaluationOptions options = arguments.options;
  options.alignment = alignmentOf(arguments.alignment);
  for (const auto& [unit, amounts] : {std::pair{Unit::kFrames, &arguments.frames},
                                      {Unit::kSeconds, &arguments.deltas_s},
                                      {Unit::kMetres, &arguments.lengths_m}}) {
    for (const double amount : *amounts) options.spacings.push_back({unit, amount});
  }
  const TrajectoryEvaluation evaluation =
      evaluateTrajectory(arguments.estimate, arguments.truth, options);
  return finish(arguments.output, evaluationTable(evaluation), evaluationJson(evaluation),
                [&] { return evaluationPlot(evaluation); });
}

}  // namespace efm
