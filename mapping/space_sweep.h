// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <string_view>
#include <vector>

#include "mapping/back_projection.h"
#include "mapping/depth_planes.h"
#include "mapping/fusion_rule.h"
#include "mapping/reference_view.h"
#include "mapping/vote_counts.h"

namespace efm {

/// Which voting kernel runs.
enum class VotingKernel { kPlain };

std::string_view nameOf(VotingKernel kernel);
/// @throws std::invalid_argument naming the value and what is known.
VotingKernel votingKernelFromName(std::string_view name);

struct SpaceSweepOptions {
  FusionRule across_cameras = FusionRule::kHarmonic;

  // Performance only: the result is the same, bit for bit.
  std::optional<int> threads;          ///< 1 to 1024; as many as there are cores where not given.
  std::optional<VotingKernel> kernel;  ///< The fastest that the processor has where not given.

  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
  /// The number of threads that will run: never more than there are cores.
  int threadsOrCores() const;
  VotingKernel kernelOrFastest() const;
};

/// Receives every fused plane of the DSI. Called from several threads at once, each plane once, in
/// any order.
class DsiSink {
 public:
  virtual ~DsiSink() = default;
  /// @param values row-major, one float per pixel of the reference view; gone after the call.
  virtual void takePlane(int plane, const float* values) = 0;
};

/// The peak of the fused DSI along every ray of the reference view: four images of its size.
struct DsiPeaks {
  cv::Mat1f confidence;  ///< The largest fused value; 0 where nothing voted.
  cv::Mat1i plane;       ///< Its plane; of equals the nearest.
  cv::Mat1f before;      ///< The value one plane nearer; -1 at the nearest plane.
  cv::Mat1f after;       ///< The value one plane farther; -1 at the farthest plane.
};

struct SweepResult {
  DsiPeaks peaks;
  std::vector<VoteCounts> votes;  ///< Per camera.
};

/// Sweeps the planes through space: for each, votes every camera into an accumulator of one plane,
/// fuses them, and keeps the best value along each ray so far. No volume is held: memory is
/// O(threads * (cameras + few) * width * height), whatever the number of planes. The order of
/// planes and threads never changes the result.
class SpaceSweep {
 public:
  /// @throws std::invalid_argument where the options are not valid.
  explicit SpaceSweep(const SpaceSweepOptions& options = {});

  /// @param cameras one bundle of rays per camera that takes part.
  /// @param sink receives the whole DSI where given.
  SweepResult run(const std::vector<RayBundle>& cameras, const ReferenceView& view,
                  const DepthPlanes& planes, DsiSink* sink = nullptr) const;

 private:
  SpaceSweepOptions options_;
};

}  // namespace efm
