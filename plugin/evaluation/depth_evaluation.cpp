// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/evaluation/depth_evaluation.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <fstream>
#include <set>
#include <stdexcept>

#include "mapping/geometry/rig.h"
#include "mapping/geometry/timestamp.h"
#include "plugin/evaluation/depth_file.h"
#include "plugin/evaluation/depth_series.h"
#include "plugin/recordings/calibration/calibration_formats.h"

namespace efm {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kSameTimeNs = 1'000'000;

/// Compares one map after the other and collects the errors.
class Comparison {
 public:
  explicit Comparison(const DepthEvaluationOptions& options) : options_(options) {
    if (!options.mask.empty()) mask_ = readMaskFile(options.mask);
  }

  void add(const std::string& name, const fs::path& estimate, const fs::path& truth) {
    const ComparedDepths depths{readDepthFile(estimate, options_.png_scale),
                                readDepthFile(truth, options_.png_scale), mask_};
    try {
      depths.validate();
    } catch (const std::invalid_argument& error) {
      throw std::runtime_error(estimate.string() + " and " + truth.string() + ": " + error.what());
    }
    const std::vector<DepthPair> pairs = pairDepths(depths, options_.pairing);
    const PrecisionRecall detection =
        precisionRecall(depths, options_.thresholds_m, options_.pairing);
    if (evaluation_.maps.empty()) {
      evaluation_.detection = detection;
    } else {
      evaluation_.detection.add(detection);
    }
    evaluation_.maps.push_back(
        {name, depthErrors(pairs, options_.focal_baseline), estimate, truth});
    all_.insert(all_.end(), pairs.begin(), pairs.end());
  }

  /// Compares each map with the truth nearest in time.
  void addSeries(const std::vector<TimedFile>& estimates, const std::vector<TimedFile>& truths) {
    std::set<const TimedFile*> used;
    for (const TimedFile& map : estimates) {
      const TimedFile* match = nearestFile(truths, map.t_ns, kSameTimeNs);
      if (match == nullptr) {
        ++evaluation_.without_truth;
        continue;
      }
      add(formatSeconds(map.t_ns), map.file, match->file);
      used.insert(match);
    }
    evaluation_.without_estimate = truths.size() - used.size();
  }

  bool hasMaps() const { return !evaluation_.maps.empty(); }
  bool hasPoints() const { return !all_.empty(); }

  DepthEvaluation result() const {
    DepthEvaluation evaluation = evaluation_;
    std::vector<DepthErrors> errors;
    for (const EvaluatedMap& map : evaluation.maps) errors.push_back(map.errors);
    evaluation.mean = meanOfErrors(errors);
    evaluation.all = depthErrors(all_, options_.focal_baseline);
    return evaluation;
  }

 private:
  const DepthEvaluationOptions& options_;
  cv::Mat1b mask_;
  DepthEvaluation evaluation_;
  std::vector<DepthPair> all_;
};

}  // namespace

DepthEvaluation evaluateDepth(const fs::path& estimated, const fs::path& truth,
                              const DepthEvaluationOptions& options) {
  options.pairing.validate();
  for (const fs::path& path : {estimated, truth}) {
    if (!fs::exists(path)) throw std::runtime_error("no such file: " + path.string());
  }
  // Compared with a file, the folder of one depth map counts as its file.
  const bool one_map = fs::exists(estimated / "depth.tiff") && !fs::is_directory(truth);
  const fs::path estimate = one_map ? estimated / "depth.tiff" : estimated;
  const bool folders = fs::is_directory(estimate);
  if (folders && fs::exists(estimate / "depth.tiff")) {
    throw std::runtime_error(
        fmt::format("{} holds one depth map without its time: expected a file of truth beside it, "
                    "not the folder {}",
                    estimate.string(), truth.string()));
  }
  if (folders != fs::is_directory(truth)) {
    throw std::runtime_error(estimate.string() + " and " + truth.string() +
                             ": must be two files or two folders");
  }

  Comparison comparison(options);
  if (folders) {
    comparison.addSeries(depthSeries(estimate, DepthSeriesRole::kEstimate),
                         depthSeries(truth, DepthSeriesRole::kTruth));
    if (!comparison.hasMaps()) {
      throw std::runtime_error(fmt::format("no truth in {} lies within 1 ms of a depth map of {}",
                                           truth.string(), estimate.string()));
    }
  } else {
    comparison.add(estimate.filename().string(), estimate, truth);
  }
  if (!comparison.hasPoints()) {
    throw std::runtime_error(fmt::format("no pixel of {} has a depth where the truth has one{}",
                                         estimate.string(),
                                         options.mask.empty() ? "" : " and the mask is not black"));
  }
  return comparison.result();
}

namespace {

/// The file of that name in a folder or in one of `levels` folders above it.
std::optional<fs::path> fileAtOrAbove(const fs::path& path, const std::string& name, int levels) {
  fs::path folder = fs::absolute(path).lexically_normal();
  for (int level = 0; level <= levels; ++level) {
    if (fs::is_regular_file(folder / name)) return folder / name;
    folder = folder.parent_path();
  }
  return std::nullopt;
}

/// Nothing if the file is not the report of a run.
std::optional<StereoBaseline> fromReport(const fs::path& file) {
  std::ifstream stream(file);
  const auto report = nlohmann::json::parse(stream, nullptr, false);
  if (!report.is_object() || !report.contains("reference_view")) return std::nullopt;
  const auto& view = report["reference_view"];
  if (!view.is_object() || !view.contains("fx") || !view["fx"].is_number()) return std::nullopt;
  if (!report.contains("baseline_m") || !report["baseline_m"].is_number()) return std::nullopt;
  return StereoBaseline{view["fx"], report["baseline_m"], file.string()};
}

std::optional<StereoBaseline> fromCamchain(const fs::path& file) {
  const Rig rig = readCamchain(file);
  if (rig.cameras.size() < 2) return std::nullopt;
  return StereoBaseline{rig.cameras[0].model.fx, rig.cameras[1].T_rig_cam.translation.norm(),
                        file.string()};
}

bool isUsable(const StereoBaseline& stereo) { return stereo.focal_px > 0 && stereo.baseline_m > 0; }

}  // namespace

std::optional<StereoBaseline> findStereoBaseline(const fs::path& estimate, const fs::path& truth) {
  if (const auto report = fileAtOrAbove(estimate, "report.json", 3)) {
    auto stereo = fromReport(*report);
    if (stereo && isUsable(*stereo)) return stereo;
  }
  if (const auto camchain = fileAtOrAbove(truth, "camchain.yaml", 2)) {
    auto stereo = fromCamchain(*camchain);
    if (stereo && isUsable(*stereo)) return stereo;
  }
  return std::nullopt;
}

}  // namespace efm
