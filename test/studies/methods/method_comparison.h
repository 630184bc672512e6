// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "mapping/keyframes/keyframe_mapper.h"
#include "maps/metrics/depth_metrics.h"
#include "test/studies/methods/outstanding_points.h"
#include "test/studies/recordings/recording_cache.h"

namespace efm::studies {

// Methods that several studies compare.
inline constexpr const char* kOneCamera = "one camera (EMVS)";
inline constexpr const char* kAlg1 = "H_c∘A_t (Alg. 1)";

/// All settings of the paper, independent of the library's defaults: harmonic mean across cameras,
/// one sub-interval, 100 planes even in inverse depth, adaptive threshold of 5x5 with C = 5, a
/// median of 5x5 and the plane's own depth. Confidence is normalised by a robust maximum over the
/// sequence (Ghosh and Gallego 2022, Secs. 3 and 4.1).
KeyframeMapperOptions paperOptions(double min_depth_m, double max_depth_m);

/// A way to make depth maps: a row of a comparison.
struct Method {
  std::string name;
  KeyframeMapperOptions options;
  std::vector<int> cameras = {0, 1};
  /// Each camera has its own depth map. A pixel of the merged map is the more confident one.
  bool late = false;
};

/// The first camera alone, with the paper's settings.
Method oneCamera(double min_depth_m, double max_depth_m, const std::string& name = kOneCamera);
/// The paper's method, then: with depth between planes, split fusion, aggregation, and both.
std::vector<Method> betterDepthMethods(const Method& paper);

/// The keyframes of all windows. With the white level of the sequence there are two passes: the
/// first finds its robust maximum.
std::vector<KeyframeDepthMap> mapWindows(const Recording& recording,
                                         const std::vector<Window>& windows, const Method& method);

/// The true z-depth in the keyframe's view, from the true pose of the first camera.
cv::Mat1f truthOf(const Recording& recording, const KeyframeDepthMap& keyframe);

/// A method's keyframes and their errors, over the points of all windows together.
struct MethodResult {
  std::string name;
  std::vector<KeyframeDepthMap> keyframes;
  DepthErrors own;     ///< At the method's own pixels.
  DepthErrors common;  ///< At the pixels of all methods.
  /// At equal numbers: the min number of all methods in a window. A method's points with the
  /// highest local contrast count (confidence minus its 5x5 Gaussian mean).
  DepthErrors equal;
};

/// The default pairing of estimates: with the best truth within a pixel, because an edge pixel may
/// be on the far background.
DepthPairingOptions studyPairing();

/// Appends the pairs of a depth map and its truth.
void appendPairs(const cv::Mat1f& depth_m, const cv::Mat1f& truth_m, std::vector<DepthPair>& pairs,
                 const DepthPairingOptions& pairing = studyPairing());

/// Maps the windows with a method. Without errors.
MethodResult mapMethod(const Recording& recording, const std::vector<Window>& windows,
                       const Method& method, const std::string& name);

/// Computes the errors of keyframes. All results have the same windows.
/// @param recordings of each result. Their views may have different sizes: then the common pixels
/// are those in the cells (pixels of the first result) with a point in every result.
void scoreMethods(const std::vector<const Recording*>& recordings,
                  std::vector<MethodResult>& results,
                  const DepthPairingOptions& pairing = studyPairing());
/// The same for results of one recording and one reference view.
void scoreMethods(const Recording& recording, std::vector<MethodResult>& results,
                  const DepthPairingOptions& pairing = studyPairing());

/// Maps the windows with each method and computes the errors.
std::vector<MethodResult> compareMethods(const Recording& recording,
                                         const std::vector<Window>& windows,
                                         const std::vector<Method>& methods,
                                         const DepthPairingOptions& pairing = studyPairing());

/// @throws std::logic_error where no result has this name.
const MethodResult& resultOf(const std::vector<MethodResult>& results, const std::string& name);

/// The window with the most points of a method, for pictures.
std::size_t richestWindow(const MethodResult& result);

}  // namespace efm::studies
