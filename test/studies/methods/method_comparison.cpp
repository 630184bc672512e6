// SPDX-License-Identifier: BSD-3-Clause
#include "test/studies/methods/method_comparison.h"

#include <algorithm>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <stdexcept>
#include <utility>

#include "mapping/depth/peak_fit.h"
#include "tracking_stub/rendering/frame_renderer.h"

namespace efm::studies {
namespace {

std::vector<KeyframeDepthMap> mapOnce(const Recording& recording,
                                      const std::vector<Window>& windows, const Method& method) {
  KeyframeMapper mapper(recording.simulation.rig, method.cameras, method.options);
  std::vector<KeyframeDepthMap> keyframes;
  for (const Window& window : windows) {
    auto keyframe = mapper.map(window, recording.eventsOf(window), recording.trajectory);
    if (!keyframe) throw std::logic_error(method.name + ": a window has no pose");
    keyframes.push_back(std::move(*keyframe));
  }
  return keyframes;
}

std::vector<KeyframeDepthMap> mapLate(const Recording& recording,
                                      const std::vector<Window>& windows, const Method& method) {
  std::vector<KeyframeDepthMap> merged;
  for (const int camera : method.cameras) {
    Method alone = method;
    alone.late = false;
    alone.cameras = {camera};
    std::vector<KeyframeDepthMap> maps = mapWindows(recording, windows, alone);
    if (merged.empty()) {
      merged = std::move(maps);
      continue;
    }
    for (std::size_t i = 0; i < maps.size(); ++i) {
      const DepthMap& other = maps[i].map;
      DepthMap& map = merged[i].map;
      const cv::Mat1b better =
          (other.depth > 0) & ((map.depth == 0) | (other.confidence > map.confidence));
      other.depth.copyTo(map.depth, better);
      other.variance.copyTo(map.variance, better);
      map.confidence = cv::max(map.confidence, other.confidence);
    }
  }
  return merged;
}

/// The cells of a coarser image that contain a point.
cv::Mat1b cellsOf(const cv::Mat1f& depth_m, cv::Size cells) {
  cv::Mat1b occupied(cells, 0);
  for (int y = 0; y < depth_m.rows; ++y) {
    for (int x = 0; x < depth_m.cols; ++x) {
      if (depth_m(y, x) > 0) {
        occupied(y * cells.height / depth_m.rows, x * cells.width / depth_m.cols) = 255;
      }
    }
  }
  return occupied;
}

/// Focal length in pixels times baseline in metres of the first two cameras, for bad-pix.
std::optional<double> focalBaselineOf(const Rig& rig) {
  if (rig.cameras.size() < 2) return std::nullopt;
  const Rigid3 T_cam0_cam1 = rig.cameras[0].T_rig_cam.inverse() * rig.cameras[1].T_rig_cam;
  return rig.cameras[0].model.fx * T_cam0_cam1.translation.norm();
}

}  // namespace

KeyframeMapperOptions paperOptions(double min_depth_m, double max_depth_m) {
  KeyframeMapperOptions options;
  options.planes = {min_depth_m, max_depth_m, 100, PlaneSpacing::kInverse};
  options.reference_camera = 0;
  options.view = {};
  options.subintervals = {1, SubintervalSplit::kDuration, SubintervalShuffle::kNone, 1};
  options.split = SplitFusionOptions::none();
  options.exclude_silent = false;
  options.sweep.fusion = {FusionRule::kHarmonic, FusionRule::kArithmetic,
                          FusionOrder::kCamerasThenTime};
  options.extraction.extraction = ExtractionMethod::kPaper;
  options.extraction.threshold_kernel = 5;
  options.extraction.threshold_c = 5;
  options.extraction.max_confidence = {WhiteLevel::kSequence, 0};
  options.extraction.median_size = 5;
  options.extraction.dilate = false;
  options.extraction.subplane = false;
  return options;
}

std::vector<KeyframeDepthMap> mapWindows(const Recording& recording,
                                         const std::vector<Window>& windows, const Method& method) {
  if (method.late) return mapLate(recording, windows, method);
  std::vector<KeyframeDepthMap> keyframes = mapOnce(recording, windows, method);
  if (method.options.extraction.max_confidence.level != WhiteLevel::kSequence) return keyframes;
  RobustMaximum maximum;
  for (const KeyframeDepthMap& keyframe : keyframes) maximum.add(keyframe.max_confidence);
  Method again = method;
  again.options.sequence_maximum = maximum.value();
  return mapOnce(recording, windows, again);
}

Method oneCamera(double min_depth_m, double max_depth_m, const std::string& name) {
  return {name, paperOptions(min_depth_m, max_depth_m), {0}};
}

std::vector<Method> betterDepthMethods(const Method& paper) {
  Method subplane = paper;
  subplane.name = "between planes";
  subplane.options.extraction.subplane = true;
  Method split = subplane;
  split.name = "split fusion";
  split.options.split = SplitFusionOptions();
  Method aggregated = paper;
  aggregated.name = "aggregation";
  aggregated.options.extraction = DepthExtractionOptions();
  Method both = aggregated;
  both.name = "split fusion and aggregation (default)";
  both.options.split = SplitFusionOptions();
  both.options.sweep.fusion = FusionOptions();
  return {paper, subplane, split, aggregated, both};
}

cv::Mat1f truthOf(const Recording& recording, const KeyframeDepthMap& keyframe) {
  const Simulation& simulation = recording.simulation;
  return renderDepth(simulation.scene,
                     simulation.motion->poseAt(keyframe.window.t_ref_ns) *
                         simulation.rig.cameras.front().T_rig_cam,
                     keyframe.view);
}

DepthPairingOptions studyPairing() {
  DepthPairingOptions pairing;
  pairing.tolerance_px = 1;
  return pairing;
}

void appendPairs(const cv::Mat1f& depth_m, const cv::Mat1f& truth_m, std::vector<DepthPair>& pairs,
                 const DepthPairingOptions& pairing) {
  const std::vector<DepthPair> some = pairDepths({depth_m, truth_m}, pairing);
  pairs.insert(pairs.end(), some.begin(), some.end());
}

MethodResult mapMethod(const Recording& recording, const std::vector<Window>& windows,
                       const Method& method, const std::string& name) {
  return {name, mapWindows(recording, windows, method), {}, {}, {}};
}

void scoreMethods(const std::vector<const Recording*>& recordings,
                  std::vector<MethodResult>& results, const DepthPairingOptions& pairing) {
  struct Pairs {
    std::vector<DepthPair> own, common, equal;
  };
  std::vector<Pairs> pairs(results.size());
  for (std::size_t w = 0; w < results.front().keyframes.size(); ++w) {
    const cv::Size cells = results.front().keyframes[w].map.depth.size();
    cv::Mat1b common_cells(cells, 255);
    int fewest = std::numeric_limits<int>::max();
    for (const MethodResult& result : results) {
      const cv::Mat1f& depth_m = result.keyframes.at(w).map.depth;
      common_cells &= cellsOf(depth_m, cells);
      fewest = std::min(fewest, cv::countNonZero(depth_m > 0));
    }
    cv::Mat1f truth;
    for (std::size_t m = 0; m < results.size(); ++m) {
      const KeyframeDepthMap& keyframe = results[m].keyframes[w];
      const cv::Mat1f& depth_m = keyframe.map.depth;
      if (m == 0 || recordings[m] != recordings[m - 1]) truth = truthOf(*recordings[m], keyframe);
      cv::Mat1b common;
      cv::resize(common_cells, common, depth_m.size(), 0, 0, cv::INTER_NEAREST);
      appendPairs(depth_m, truth, pairs[m].own, pairing);
      appendPairs(only(depth_m, common), truth, pairs[m].common, pairing);
      appendPairs(only(depth_m, mostOutstanding(keyframe.map, depth_m > 0, fewest)), truth,
                  pairs[m].equal, pairing);
    }
  }
  for (std::size_t m = 0; m < results.size(); ++m) {
    const std::optional<double> focal_baseline = focalBaselineOf(recordings[m]->simulation.rig);
    results[m].own = depthErrors(pairs[m].own, focal_baseline);
    results[m].common = depthErrors(pairs[m].common, focal_baseline);
    results[m].equal = depthErrors(pairs[m].equal, focal_baseline);
  }
}

void scoreMethods(const Recording& recording, std::vector<MethodResult>& results,
                  const DepthPairingOptions& pairing) {
  scoreMethods(std::vector<const Recording*>(results.size(), &recording), results, pairing);
}

std::vector<MethodResult> compareMethods(const Recording& recording,
                                         const std::vector<Window>& windows,
                                         const std::vector<Method>& methods,
                                         const DepthPairingOptions& pairing) {
  std::vector<MethodResult> results;
  for (const Method& method : methods) {
    results.push_back(mapMethod(recording, windows, method, method.name));
  }
  scoreMethods(recording, results, pairing);
  return results;
}

const MethodResult& resultOf(const std::vector<MethodResult>& results, const std::string& name) {
  for (const MethodResult& result : results) {
    if (result.name == name) return result;
  }
  throw std::logic_error("no method is called " + name);
}

std::size_t richestWindow(const MethodResult& result) {
  std::size_t best = 0;
  int most = 0;
  for (std::size_t w = 0; w < result.keyframes.size(); ++w) {
    const int points = cv::countNonZero(result.keyframes[w].map.depth);
    if (points <= most) continue;
    most = points;
    best = w;
  }
  return best;
}

}  // namespace efm::studies
