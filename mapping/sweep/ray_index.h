// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "mapping/dsi/dsi_grid.h"
#include "mapping/dsi/vote_counts.h"
#include "mapping/dsi/voting_kernel.h"
#include "mapping/rays/back_projection.h"
#include "mapping/sweep/ray_bins.h"
#include "mapping/sweep/tile_rays.h"

namespace efm {

/// The rays of all inputs in bins, where a tile finds its rays for a group of planes. An input is
/// one slot of one camera (`CameraRays`): the rays of one group of events in one sub-interval.
class RayIndex {
 public:
  /// @param cameras consumed: each bundle is freed when it lies in bins.
  /// @param kernel one of `availableKernels`, but not the plain one.
  RayIndex(std::vector<CameraRays> cameras, const DsiGrid& grid, VotingKernel kernel);

  /// Groups of planes in which no ray moves far, from the nearest plane to the farthest. Each has
  /// one plane where some rays are not on all planes.
  const std::vector<PlaneRange>& groups() const { return groups_; }

  /// Input (camera, slot) has the index camera * slots + slot, with the slots of all groups of
  /// events.
  std::size_t inputs() const { return bins_.size(); }
  /// Replaces `rays` by those of an input that the tile may see in a group. Thread-safe.
  void gather(std::size_t group, std::size_t input, const TileCells& tile, TileRays& rays) const;
  /// From the anchor plane of gathered rays to a plane, 1/m.
  double fromAnchor(int plane) const;

  /// Frees the rays; the counts stay.
  void release() {
    bins_ = {};
    footprints_ = {};
  }
  /// Per camera: the counts if no vote is cast.
  const std::vector<VoteCounts>& notCast() const { return not_cast_; }

 private:
  std::vector<PlaneRange> dividePlanes() const;

  const kernels::TileFunctions& functions_;
  DepthPlanes planes_;
  std::vector<std::vector<RayBins>> bins_;  // by input
  std::vector<PlaneRange> groups_;
  std::vector<std::vector<std::vector<RayBins::Footprint>>> footprints_;  // of bins_, by group
  std::vector<VoteCounts> not_cast_;
};

}  // namespace efm
