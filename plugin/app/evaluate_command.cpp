// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/app/evaluate_command.h"

#include <iostream>
#include <stdexcept>

#include "plugin/evaluation/cloud_evaluation_plot.h"
#include "plugin/evaluation/depth_evaluation_plot.h"
#include "plugin/evaluation/depth_evaluation_text.h"
#include "plugin/evaluation/stereo_baseline.h"
#include "plugin/evaluation/trajectory_evaluation_plot.h"
#include "plugin/pictures/picture_file.h"

namespace efm {
namespace {

/// What is given, and what the folders say of the rest.
std::optional<StereoBaseline> stereoBaseline(const EvaluateDepthArguments& arguments) {
  if (arguments.focal_px && arguments.baseline_m) {
    return StereoBaseline{*arguments.focal_px, *arguments.baseline_m, "as given"};
  }
  std::optional<StereoBaseline> stereo = findStereoBaseline(arguments.estimate, arguments.truth);
  if (!stereo && (arguments.focal_px || arguments.baseline_m)) {
    throw std::invalid_argument("bad-pix needs both --focal and --baseline: neither " +
                                arguments.estimate.string() + " nor " + arguments.truth.string() +
                                " says the other");
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

}  // namespace

int runEvaluateDepth(const EvaluateDepthArguments& arguments) {
  const std::optional<StereoBaseline> stereo = stereoBaseline(arguments);
  DepthEvaluationOptions options = arguments.options;
  if (stereo) options.focal_baseline = stereo->focalBaseline();
  const DepthEvaluation evaluation = evaluateDepth(arguments.estimate, arguments.truth, options);
  if (!arguments.output.plot.empty()) {
    writePicture(arguments.output.plot, evaluationPlot(evaluation, options));
  }
  std::cout << (arguments.output.json ? evaluationJson(evaluation, stereo)
                                      : evaluationTable(evaluation, stereo));
  return 0;
}

int runEvaluateMap(const EvaluateMapArguments& arguments) {
  const CloudEvaluation evaluation =
      evaluateCloud(arguments.estimate, arguments.truth, arguments.options);
  if (!arguments.output.plot.empty())
    writePicture(arguments.output.plot, evaluationPlot(evaluation));
  std::cout << (arguments.output.json ? evaluationJson(evaluation) : evaluationTable(evaluation));
  return 0;
}

int runEvaluateTrajectory(const EvaluateTrajectoryArguments& arguments) {
  using Unit = RelativeSpacing::Unit;
  TrajectoryEvaluationOptions options = arguments.options;
  options.alignment = alignmentOf(arguments.alignment);
  for (const double frames : arguments.frames) options.spacings.push_back({Unit::kFrames, frames});
  for (const double delta_s : arguments.deltas_s) {
    options.spacings.push_back({Unit::kSeconds, delta_s});
  }
  for (const double length_m : arguments.lengths_m) {
    options.spacings.push_back({Unit::kMetres, length_m});
  }
  const TrajectoryEvaluation evaluation =
      evaluateTrajectory(arguments.estimate, arguments.truth, options);
  if (!arguments.output.plot.empty())
    writePicture(arguments.output.plot, evaluationPlot(evaluation));
  std::cout << (arguments.output.json ? evaluationJson(evaluation) : evaluationTable(evaluation));
  return 0;
}

}  // namespace efm
