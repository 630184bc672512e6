// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "plugin/evaluation/cloud_evaluation.h"
#include "plugin/evaluation/depth_evaluation.h"
#include "plugin/evaluation/trajectory_evaluation.h"

namespace efm {

struct EvaluationOutput {
  bool json = false;
  std::filesystem::path plot;  ///< Empty: no plot.
};

struct EvaluateDepthArguments {
  std::filesystem::path estimate;
  std::filesystem::path truth;
  std::optional<double> focal_px;
  std::optional<double> baseline_m;
  DepthEvaluationOptions options;
  EvaluationOutput output;
};

struct EvaluateMapArguments {
  std::filesystem::path estimate;
  std::filesystem::path truth;
  CloudEvaluationOptions options;
  EvaluationOutput output;
};

struct EvaluateTrajectoryArguments {
  std::filesystem::path estimate;
  std::filesystem::path truth;
  std::string alignment = "se3";  ///< se3, origin or none.
  std::vector<double> lengths_m;
  std::vector<double> deltas_s;
  std::vector<double> frames;
  TrajectoryEvaluationOptions options;
  EvaluationOutput output;
};

/// `event-fusion evaluate …`: prints the errors of results and draws them if asked for.
/// @return the process's exit status.
/// @throws std::exception if something cannot be compared or written.
int runEvaluateDepth(const EvaluateDepthArguments& arguments);
int runEvaluateMap(const EvaluateMapArguments& arguments);
int runEvaluateTrajectory(const EvaluateTrajectoryArguments& arguments);

}  // namespace efm
