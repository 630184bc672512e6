// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/app/evaluate_command.h"

#include <iostream>
#include <stdexcept>

#include "plugin/depth_evaluation.h"

namespace efm {

int runEvaluateDepth(const EvaluateDepthArguments& arguments) {
  DepthEvaluationOptions options;
  options.pairing = arguments.pairing;
  if (arguments.focal_px.has_value() != arguments.baseline_m.has_value()) {
    throw std::invalid_argument("bad-pix needs both --focal and --baseline");
  }
  if (arguments.focal_px) options.focal_baseline = *arguments.focal_px * *arguments.baseline_m;
  const DepthEvaluation evaluation = evaluateDepth(arguments.estimate, arguments.truth, options);
  std::cout << (arguments.json ? evaluationJson(evaluation) : evaluationTable(evaluation));
  return 0;
}

}  // namespace efm
