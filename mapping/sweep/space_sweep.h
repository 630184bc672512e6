// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core/types.hpp>

#include <optional>
#include <vector>

#include "mapping/base/option.h"
#include "mapping/dsi/dsi_columns.h"
#include "mapping/dsi/dsi_grid.h"
#include "mapping/dsi/plane_fusion.h"
#include "mapping/rays/rays.h"

namespace efm {

struct SpaceSweepOptions {
  FusionOptions fusion;

  // For speed. The number of threads never changes the result. Kernels agree up to rounding where
  // all planes are swept.
  std::optional<int> threads;          ///< 1 to 1024; default: the number of cores.
  std::optional<VotingKernel> kernel;  ///< One of `availableKernels`; default: the fastest.
  /// True: with columns, tiles do not sweep the planes between coarse planes where no edge lies.
  bool coarse_to_fine = true;

  template <typename Self, typename Visit>
  static void fields(Self& self, Visit&& visit) {
    visit("threads", self.threads, Allowed::from(1, 1024, "1 to 1024"));
    visit("kernel", self.kernel);
    visit("coarse_to_fine", self.coarse_to_fine);
  }
  void validate() const;
  /// Returns the number of threads that will run, at most the number of cores.
  int threadsOrCores() const;
  VotingKernel kernelOrFastest() const;
};

/// Receives the fused DSI, plane by plane from the nearest to the farthest.
class DsiSink {
 public:
  virtual ~DsiSink() = default;
  /// @param values row-major, one float per pixel of the reference view; valid during the call.
  virtual void addPlane(int plane, const float* values) = 0;
};

struct SweepRequest {
  bool camera_peaks = false;  ///< True to find also each camera's own peaks, fused across time.
  DsiSink* sink = nullptr;    ///< Receives the whole fused DSI if not null; not owned.
  /// Number of consecutive groups of each camera's slots, a divisor of the number of slots. Each
  /// group is fused alone, and the fused groups are summed.
  int groups = 1;
  /// Side of a Gaussian window in pixels: odd, at least 3; or 0 for no columns. Pixels get a column
  /// if their confidence is above its mean in the window. Peaks then have only the confidence.
  int column_window = 0;
  /// At least 1; see `coarseStep`. Above 1, with columns: each tile sweeps these planes first, then
  /// the planes between them where its edges lie (`planesAtEdges`). The columns of the other planes
  /// are interpolated; a sink and each camera's own peaks get all planes. The plain kernel sweeps
  /// all planes.
  int coarse_step = 1;
};

/// @param groups a divisor of the number of slots (asserted).
FusionInputs fusionInputs(const std::vector<CameraRays>& cameras, int groups);

struct SweepResult {
  SweptDsi fused;
  std::vector<SweptDsi> cameras;  ///< Each camera's own DSI, if requested.
  std::vector<VoteCounts> votes;  ///< Per camera.
};

/// Sweeps the depth planes through space (Ghosh and Gallego 2022, Algorithm 2, lines 3 and 4): on
/// each plane it votes for every camera and sub-interval, fuses the votes, and updates the peak of
/// every pixel. It stores no volume. Besides the rays, memory is O(width * height) for any number
/// of planes and sub-intervals; `camera_peaks` multiplies it by the number of cameras, the plain
/// kernel by the number of threads. Columns add one byte per plane and selected pixel, a sink adds
/// four bytes per voxel. The order of planes and threads never changes the result.
/// @param cameras the rays of each camera that is fused, at least one; consumed.
SweepResult sweepSpace(std::vector<CameraRays> cameras, const DsiGrid& grid,
                       const SpaceSweepOptions& options = {}, const SweepRequest& request = {});

/// Sweeps with the plain kernel, the specification: whole planes, one per thread at a time. Memory:
/// O(threads * width * height), for any number of planes, cameras and sub-intervals.
SweepResult sweepPlanes(const std::vector<CameraRays>& cameras, const DsiGrid& grid,
                        const SpaceSweepOptions& options, const SweepRequest& request);

/// Cuts the view into rectangles of nearly the same size, at most `max_pixels` on a side: row by
/// row, without gap or overlap.
std::vector<cv::Rect> tilesOf(const ReferenceView& view, int max_pixels);

/// Sweeps with the fast kernels, tile by tile. A tile is a small rectangle of the view. Its votes
/// on one plane, their fusion and the running peaks stay in the first two levels of cache, and no
/// whole plane is stored. Planes are in groups; a tile gathers its rays once per group and pass.
/// Memory besides the rays: O(width * height), for any number of planes, cameras, sub-intervals and
/// threads.
///
/// Tiles share no data, and a tile's votes have a fixed order: the result has the same bits for any
/// number of threads.
/// @param cameras consumed: each bundle is freed when its rays are in bins.
SweepResult sweepTiles(std::vector<CameraRays> cameras, const DsiGrid& grid,
                       const SpaceSweepOptions& options, const SweepRequest& request);

}  // namespace efm
