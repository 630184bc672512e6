// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <opencv2/core/types.hpp>
#include <optional>
#include <vector>

#include "mapping/dsi/plane_fusion.h"
#include "mapping/dsi/swept_dsi.h"
#include "mapping/dsi/vote_counts.h"
#include "mapping/dsi/voting_kernel.h"
#include "mapping/geometry/depth_planes.h"
#include "mapping/geometry/reference_view.h"
#include "mapping/rays/back_projection.h"

namespace efm {

struct SpaceSweepOptions {
  FusionOptions fusion;

  // Performance only. The number of threads never changes the result; kernels agree up to rounding.
  std::optional<int> threads;          ///< 1 to 1024; as many as there are cores where not given.
  std::optional<VotingKernel> kernel;  ///< An available one; the fastest of them where not given.

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

/// One camera's rays by slot of the time axis: one bundle without temporal fusion. All cameras have
/// equally many.
using CameraRays = std::vector<RayBundle>;

struct SweepRequest {
  bool camera_peaks = false;  ///< Also the peaks of each camera alone, fused across time.
  DsiSink* sink = nullptr;    ///< Receives the whole fused DSI where given; not owned.
  /// Each camera's slots are of so many groups, one after the other: each is fused by itself, and
  /// the fused groups are summed. Divides the number of slots.
  int groups = 1;
  /// Also keeps the fused values along the rays whose confidence stands out from a Gaussian window
  /// of so many pixels: odd, at least 3. 0: none are kept.
  int ray_window = 0;
};

/// @param groups divides the number of slots (asserted).
FusionInputs fusionInputs(const std::vector<CameraRays>& cameras, int groups);

struct SweepResult {
  SweptDsi fused;
  std::vector<SweptDsi> cameras;  ///< Each alone, where asked for.
  std::vector<VoteCounts> votes;  ///< Per camera.
};

/// Sweeps the planes through space: on each, votes every camera and sub-interval, folds the votes
/// into the running means of the two axes, and keeps the best value along each ray so far. No
/// volume is held: memory beside the rays is O(width * height), whatever the number of planes,
/// cameras and sub-intervals (with `camera_peaks`, times the cameras; with the plain kernel, times
/// the threads). Where values along rays or whole planes are asked for, they come on top: two bytes
/// per plane of a pixel that stands out, four of any pixel. The order of planes and threads never
/// changes the result.
class SpaceSweep {
 public:
  /// @throws std::invalid_argument where the options are not valid.
  explicit SpaceSweep(const SpaceSweepOptions& options = {});

  /// @param cameras the rays of each camera that takes part; at least one.
  SweepResult run(std::vector<CameraRays> cameras, const ReferenceView& view,
                  const DepthPlanes& planes, const SweepRequest& request = {}) const;

 private:
  SpaceSweepOptions options_;
};

}  // namespace efm
