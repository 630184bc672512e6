// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/depth_evaluation.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <sstream>
#include <stdexcept>

#include "mapping/quoted_text.h"
#include "mapping/timestamp.h"

namespace efm {
namespace {

constexpr std::int64_t kSameTimeNs = 1'000'000;

struct TimedFile {
  std::int64_t t_ns = 0;
  std::filesystem::path file;
};

bool earlier(const TimedFile& a, const TimedFile& b) { return a.t_ns < b.t_ns; }

cv::Mat1f readDepth(const std::filesystem::path& file) {
  cv::Mat image = cv::imread(file.string(), cv::IMREAD_UNCHANGED);
  if (image.empty()) throw std::runtime_error("cannot read the depth map " + file.string());
  if (image.type() != CV_32FC1) {
    throw std::runtime_error(file.string() + ": must be a float32 image of one channel");
  }
  return image;
}

/// keyframes/<t>/depth.tiff of a map's output.
std::vector<TimedFile> estimatedMaps(const std::filesystem::path& folder) {
  const bool is_output = std::filesystem::is_directory(folder / "keyframes");
  std::vector<TimedFile> maps;
  for (const auto& entry :
       std::filesystem::directory_iterator(is_output ? folder / "keyframes" : folder)) {
    const auto t_ns = parseSeconds(entry.path().filename().string());
    const std::filesystem::path file = entry.path() / "depth.tiff";
    if (t_ns && std::filesystem::exists(file)) maps.push_back({*t_ns, file});
  }
  if (maps.empty()) {
    throw std::runtime_error("no keyframes (<t>/depth.tiff) in " + folder.string());
  }
  std::sort(maps.begin(), maps.end(), earlier);
  return maps;
}

/// The maps that depth/index.txt of a dataset folder lists.
std::vector<TimedFile> trueMaps(const std::filesystem::path& folder) {
  const bool is_dataset = std::filesystem::is_directory(folder / "depth");
  const std::filesystem::path depth = is_dataset ? folder / "depth" : folder;
  const std::filesystem::path index = depth / "index.txt";
  std::ifstream file(index);
  if (!file) throw std::runtime_error("cannot read " + index.string());
  std::vector<TimedFile> maps;
  int number = 0;
  for (std::string line; std::getline(file, line);) {
    ++number;
    std::istringstream fields(line.substr(0, line.find('#')));
    std::string time;
    std::string name;
    if (!(fields >> time)) continue;
    const auto t_ns = parseSeconds(time);
    if (!t_ns || !(fields >> name)) {
      throw std::runtime_error(index.string() + ":" + std::to_string(number) + ": " +
                               inQuotes(line) + ": expected a time in seconds and a file");
    }
    maps.push_back({*t_ns, depth / name});
  }
  if (maps.empty()) throw std::runtime_error(index.string() + " lists no depth maps");
  std::sort(maps.begin(), maps.end(), earlier);
  return maps;
}

/// The truth nearest in time, within a millisecond.
const TimedFile* truthAt(const std::vector<TimedFile>& truths, std::int64_t t_ns) {
  const auto after = std::lower_bound(truths.begin(), truths.end(), TimedFile{t_ns, {}}, earlier);
  const TimedFile* best = nullptr;
  const auto consider = [&](const TimedFile& truth) {
    const std::int64_t off_ns = std::abs(truth.t_ns - t_ns);
    if (off_ns <= kSameTimeNs && (!best || off_ns < std::abs(best->t_ns - t_ns))) best = &truth;
  };
  if (after != truths.begin()) consider(*(after - 1));
  if (after != truths.end()) consider(*after);
  return best;
}

DepthErrors meanOf(const std::vector<EvaluatedMap>& maps) {
  DepthErrors mean;
  const auto with_points = std::count_if(
      maps.begin(), maps.end(), [](const EvaluatedMap& map) { return map.errors.points > 0; });
  const double share = 1 / static_cast<double>(with_points);
  for (const EvaluatedMap& map : maps) {
    const DepthErrors& errors = map.errors;
    if (errors.points == 0) continue;
    mean.points += errors.points;
    mean.mean_abs_m += share * errors.mean_abs_m;
    mean.median_abs_m += share * errors.median_abs_m;
    mean.median_inverse += share * errors.median_inverse;
    if (errors.bad_pix_5px) {
      mean.bad_pix_5px = mean.bad_pix_5px.value_or(0) + share * *errors.bad_pix_5px;
    }
    if (errors.bad_pix_3px) {
      mean.bad_pix_3px = mean.bad_pix_3px.value_or(0) + share * *errors.bad_pix_3px;
    }
  }
  return mean;
}

std::string row(const std::string& name, const DepthErrors& errors) {
  std::array<char, 160> line{};
  if (errors.points == 0) {
    std::snprintf(line.data(), line.size(), "%-22s %9d %11s %13s %15s\n", name.c_str(), 0, "-", "-",
                  "-");
    return line.data();
  }
  std::snprintf(line.data(), line.size(), "%-22s %9llu %11.4f %13.4f %15.5f", name.c_str(),
                static_cast<unsigned long long>(errors.points), errors.mean_abs_m,
                errors.median_abs_m, errors.median_inverse);
  std::string text = line.data();
  for (const auto& share : {errors.bad_pix_5px, errors.bad_pix_3px}) {
    if (!share) continue;
    std::snprintf(line.data(), line.size(), " %11.2f", 100 * *share);
    text += line.data();
  }
  return text + "\n";
}

nlohmann::ordered_json asJson(const DepthErrors& errors) {
  if (errors.points == 0) return {{"points", 0}};
  nlohmann::ordered_json json = {{"points", errors.points},
                                 {"mean_abs_m", errors.mean_abs_m},
                                 {"median_abs_m", errors.median_abs_m},
                                 {"median_inverse", errors.median_inverse}};
  if (errors.bad_pix_5px) json["bad_pix_5px"] = *errors.bad_pix_5px;
  if (errors.bad_pix_3px) json["bad_pix_3px"] = *errors.bad_pix_3px;
  return json;
}

}  // namespace

DepthEvaluation evaluateDepth(const std::filesystem::path& estimated,
                              const std::filesystem::path& truth,
                              const DepthEvaluationOptions& options) {
  for (const std::filesystem::path& path : {estimated, truth}) {
    if (!std::filesystem::exists(path)) throw std::runtime_error("no such file: " + path.string());
  }
  // The folder of one depth map stands for its file, beside a file of truth.
  const bool one_map =
      std::filesystem::exists(estimated / "depth.tiff") && !std::filesystem::is_directory(truth);
  const std::filesystem::path estimate = one_map ? estimated / "depth.tiff" : estimated;
  const bool folders = std::filesystem::is_directory(estimate);
  if (folders != std::filesystem::is_directory(truth)) {
    throw std::runtime_error(estimate.string() + " and " + truth.string() +
                             ": must be two files or two folders");
  }

  DepthEvaluation evaluation;
  std::vector<DepthPair> all;
  const auto compare = [&](const std::string& name, const std::filesystem::path& estimate_file,
                           const std::filesystem::path& truth_file) {
    std::vector<DepthPair> pairs;
    try {
      pairs = pairDepths(readDepth(estimate_file), readDepth(truth_file), options.pairing);
    } catch (const std::invalid_argument& error) {
      throw std::runtime_error(estimate_file.string() + " and " + truth_file.string() + ": " +
                               error.what());
    }
    evaluation.maps.push_back({name, depthErrors(pairs, options.focal_baseline)});
    all.insert(all.end(), pairs.begin(), pairs.end());
  };

  if (folders) {
    const std::vector<TimedFile> truths = trueMaps(truth);
    for (const TimedFile& map : estimatedMaps(estimate)) {
      if (const TimedFile* match = truthAt(truths, map.t_ns)) {
        compare(formatSeconds(map.t_ns), map.file, match->file);
      } else {
        ++evaluation.without_truth;
      }
    }
    if (evaluation.maps.empty()) {
      throw std::runtime_error("no truth in " + truth.string() +
                               " lies within 1 ms of a keyframe of " + estimate.string());
    }
  } else {
    compare(estimate.filename().string(), estimate, truth);
  }
  if (all.empty()) {
    throw std::runtime_error("no pixel of " + estimate.string() +
                             " has a depth where the truth has one");
  }
  evaluation.mean = meanOf(evaluation.maps);
  evaluation.all = depthErrors(all, options.focal_baseline);
  return evaluation;
}

std::string evaluationTable(const DepthEvaluation& evaluation) {
  std::array<char, 160> line{};
  std::snprintf(line.data(), line.size(), "%-22s %9s %11s %13s %15s", "map", "points",
                "mean |dZ| m", "median |dZ| m", "median |d1/Z|/m");
  std::string table = line.data();
  if (evaluation.all.bad_pix_5px) table += "  bad 5px/5%  bad 3px/5%";
  table += "\n";
  for (const EvaluatedMap& map : evaluation.maps) table += row(map.name, map.errors);
  if (evaluation.maps.size() > 1) {
    table += row("mean of maps", evaluation.mean);
    table += row("all points", evaluation.all);
  }
  if (evaluation.without_truth > 0) {
    table += std::to_string(evaluation.without_truth) + " keyframes have no truth within 1 ms\n";
  }
  return table;
}

std::string evaluationJson(const DepthEvaluation& evaluation) {
  nlohmann::ordered_json json;
  json["maps"] = nlohmann::ordered_json::array();
  for (const EvaluatedMap& map : evaluation.maps) {
    nlohmann::ordered_json one = asJson(map.errors);
    one["name"] = map.name;
    json["maps"].push_back(one);
  }
  json["mean"] = asJson(evaluation.mean);
  json["all"] = asJson(evaluation.all);
  json["without_truth"] = evaluation.without_truth;
  return json.dump(2) + "\n";
}

}  // namespace efm
