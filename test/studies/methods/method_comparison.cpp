// SPDX-License-Identifier: BSD-3-Clause
#include "test/studies/methods/method_comparison.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <stdexcept>
#include <utility>

#include "mapping/depth/robust_maximum.h"
#include "tracking_stub/rendering/depth_rendering.h"

namespace efm::studies {
namespace {

std::vector<EventSpan> eventsOf(const Recording& recording, const Window& window) {
  std::vector<EventSpan> spans;
  for (std::size_t c = 0; c < recording.events.size(); ++c) {
    spans.push_back(recording.eventsOf(c, window));
  }
  return spans;
}

std::vector<KeyframeDepthMap> mapOnce(const Recording& recording,
                                      const std::vector<Window>& windows, const Method& method) {
  KeyframeMapper mapper(recording.simulation.rig, method.cameras, method.options);
  std::vector<KeyframeDepthMap> keyframes;
  for (const Window& window : windows) {
    auto keyframe = mapper.map(window, eventsOf(recording, window), recording.trajectory);
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

void append(std::vector<DepthPair>& all, const std::vector<DepthPair>& some) {
  all.insert(all.end(), some.begin(), some.end());
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
  for (const KeyframeDepthMap& keyframe : keyframes) maximum.take(keyframe.max_confidence);
  Method again = method;
  again.options.sequence_maximum = maximum.value();
  return mapOnce(recording, windows, again);
}

cv::Mat1f truthOf(const Recording& recording, const KeyframeDepthMap& keyframe,
                  int reference_camera) {
  const Simulation& simulation = recording.simulation;
  const auto camera = static_cast<std::size_t>(reference_camera);
  return renderDepth(simulation.scene,
                     simulation.motion->poseAt(keyframe.window.t_ref_ns) *
                         simulation.rig.cameras.at(camera).T_rig_cam,
                     keyframe.view);
}

DepthPairingOptions studyPairing() {
  DepthPairingOptions pairing;
  pairing.tolerance_px = 1;
  return pairing;
}

void scoreMethods(const Recording& recording, const ComparisonOptions& options,
                  std::vector<MethodResult>& results) {
  struct Pairs {
    std::vector<DepthPair> own, common, equal;
  };
  std::vector<Pairs> pairs(results.size());
  for (std::size_t w = 0; w < results.front().keyframes.size(); ++w) {
    const cv::Mat1f truth =
        truthOf(recording, results.front().keyframes[w], options.reference_camera);
    cv::Mat1b common(truth.size(), 255);
    int fewest = std::numeric_limits<int>::max();
    for (const MethodResult& result : results) {
      const cv::Mat1b chosen = result.keyframes.at(w).map.depth > 0;
      common &= chosen;
      fewest = std::min(fewest, cv::countNonZero(chosen));
    }
    for (std::size_t m = 0; m < results.size(); ++m) {
      const DepthMap& map = results[m].keyframes[w].map;
      const cv::Mat1b equal = mostOutstanding(map, map.depth > 0, fewest);
      append(pairs[m].own, pairDepths(map.depth, truth, options.pairing));
      append(pairs[m].common, pairDepths(only(map.depth, common), truth, options.pairing));
      append(pairs[m].equal, pairDepths(only(map.depth, equal), truth, options.pairing));
    }
  }
  for (std::size_t m = 0; m < results.size(); ++m) {
    results[m].own = depthErrors(pairs[m].own, options.focal_baseline);
    results[m].common = depthErrors(pairs[m].common, options.focal_baseline);
    results[m].equal = depthErrors(pairs[m].equal, options.focal_baseline);
  }
}

std::vector<MethodResult> compareMethods(const Recording& recording,
                                         const std::vector<Window>& windows,
                                         const std::vector<Method>& methods,
                                         const ComparisonOptions& options) {
  std::vector<MethodResult> results;
  for (const Method& method : methods) {
    results.push_back({method.name, mapWindows(recording, windows, method), {}, {}, {}});
  }
  scoreMethods(recording, options, results);
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
