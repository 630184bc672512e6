// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "mapping/keyframes/keyframe_mapper.h"
#include "maps/metrics/depth_metrics.h"
#include "test/studies/methods/outstanding_points.h"
#include "test/studies/recordings/recording_cache.h"

namespace efm::studies {

/// The paper's settings, all of them, whatever the library's defaults are: harmonic across cameras,
/// one sub-interval, 100 planes even in inverse depth, adaptive threshold of 5x5 with C = 5, a
/// median of 5x5 and the plane's own depth; confidence is normalised by a robust maximum over the
/// sequence (Ghosh and Gallego 2022, Secs. 3 and 4.1).
KeyframeMapperOptions paperOptions(double min_depth_m, double max_depth_m);

/// One way to make depth maps: a row of a comparison.
struct Method {
  std::string name;
  KeyframeMapperOptions options;
  std::vector<int> cameras = {0, 1};
  /// A depth map of each camera alone, put together afterwards: a pixel takes the more confident.
  bool late = false;
};

/// The keyframes of all windows. Two passes where the white level is the sequence's: the first
/// finds its robust maximum.
std::vector<KeyframeDepthMap> mapWindows(const Recording& recording,
                                         const std::vector<Window>& windows, const Method& method);

/// The true z-depth in the keyframe's view, from where the rig really was.
cv::Mat1f truthOf(const Recording& recording, const KeyframeDepthMap& keyframe,
                  int reference_camera = 0);

/// A method's keyframes and their errors, over the points of all windows together.
struct MethodResult {
  std::string name;
  std::vector<KeyframeDepthMap> keyframes;
  DepthErrors own;     ///< On the pixels that this method chose.
  DepthErrors common;  ///< On the pixels that all methods chose.
  /// On as many pixels as the method with the fewest has in that window: of the method's own those
  /// that stand out most from their surroundings (confidence less its 5x5 Gaussian mean).
  DepthErrors equal;
};

/// What estimates are paired with: the truth within a pixel, because an edge pixel may fall on the
/// far background.
DepthPairingOptions studyPairing();

struct ComparisonOptions {
  int reference_camera = 0;
  DepthPairingOptions pairing = studyPairing();
  std::optional<double> focal_baseline;  ///< Which bad-pix needs.
};

/// Fills in the errors of keyframes that were made before, as many of each method, the ones of
/// equal number in the same reference view.
void scoreMethods(const Recording& recording, const ComparisonOptions& options,
                  std::vector<MethodResult>& results);

/// Maps the windows with each method, and scores them. All have the same reference view.
std::vector<MethodResult> compareMethods(const Recording& recording,
                                         const std::vector<Window>& windows,
                                         const std::vector<Method>& methods,
                                         const ComparisonOptions& options);

/// The result of the method with a name.
/// @throws std::logic_error naming it where there is none.
const MethodResult& resultOf(const std::vector<MethodResult>& results, const std::string& name);

/// The window in which a method found most points: the one to show.
std::size_t richestWindow(const MethodResult& result);

}  // namespace efm::studies
