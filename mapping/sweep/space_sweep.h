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

  // Performance only. The number of threads never changes the result; kernels agree up to rounding.
  std::optional<int> threads;          ///< 1 to 1024; the number of cores where not given.
  std::optional<VotingKernel> kernel;  ///< An available one; the fastest of them where not given.

  template <typename Self, typename Visit>
  static void fields(Self& self, Visit&& visit) {
    visit("threads", self.threads, Allowed::from(1, 1024, "1 to 1024"));
    visit("kernel", self.kernel);
  }
  void validate() const;
  /// The number of threads that will run: never more than there are cores.
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
  bool camera_peaks = false;  ///< Find also the peaks of each camera alone, fused across time.
  DsiSink* sink = nullptr;    ///< Receives the whole fused DSI where given; not owned.
  /// The groups of each camera's slots, one after the other: each group is fused by itself, and the
  /// fused groups are summed. Divides the number of slots.
  int groups = 1;
  /// Return also the columns of the pixels whose confidence is above its mean in a Gaussian window
  /// of this side: odd, at least 3. The peaks then have the confidence alone. 0: no columns.
  int column_window = 0;
};

/// @param groups of slots that are fused separately; the number of slots is a multiple (asserted).
FusionInputs fusionInputs(const std::vector<CameraRays>& cameras, int groups);

struct SweepResult {
  SweptDsi fused;
  std::vector<SweptDsi> cameras;  ///< Each alone, where asked for.
  std::vector<VoteCounts> votes;  ///< Per camera.
};

/// Sweeps the depth planes through space (Ghosh and Gallego 2022, Algorithm 2, lines 3 and 4): on
/// each plane it votes for every camera and sub-interval, fuses the votes, and updates the peak of
/// every pixel. It stores no volume. Memory besides the rays is O(width * height), for any number
/// of planes and sub-intervals; `camera_peaks` multiply it by the cameras, the plain kernel by the
/// threads. Columns add a byte per plane of a selected pixel, a sink adds four per voxel. The
/// order of planes and threads never changes the result.
/// @param cameras the rays of each camera that is fused, at least one; consumed.
SweepResult sweepSpace(std::vector<CameraRays> cameras, const DsiGrid& grid,
                       const SpaceSweepOptions& options = {}, const SweepRequest& request = {});

/// The sweep with the plain kernel, the specification: whole planes, one per thread at a time.
/// Memory: O(threads * width * height), for any number of planes, cameras and sub-intervals.
SweepResult sweepPlanes(const std::vector<CameraRays>& cameras, const DsiGrid& grid,
                        const SpaceSweepOptions& options, const SweepRequest& request);

/// Cuts the view into rectangles of nearly the same size, at most `max_pixels` on a side: row by
/// row, without gap or overlap.
std::vector<cv::Rect> tilesOf(const ReferenceView& view, int max_pixels);

/// The sweep with the fast kernels, tile by tile. A tile is a small rectangle of the view: its
/// votes on one plane, their fusion and the running peaks stay in the first two levels of cache,
/// and no plane exists as a whole. Planes come in groups; a tile gathers its rays once per group.
/// Memory besides the rays: O(width * height), for any number of planes, cameras, sub-intervals and
/// threads.
///
/// Tiles share nothing, and a tile's votes have an order: the result has the same bits for any
/// number of threads.
/// @param cameras consumed: each bundle is freed when it is sorted into bins.
SweepResult sweepTiles(std::vector<CameraRays> cameras, const DsiGrid& grid,
                       const SpaceSweepOptions& options, const SweepRequest& request);

}  // namespace efm
