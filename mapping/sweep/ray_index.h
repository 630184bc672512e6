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

  /// Groups of planes in which rays do not move far, from the nearest plane to the farthest.
  const std::vector<PlaneRange>& groups() const { return groups_; }

  /// Input (camera, slot) has the index camera * slots + slot, with the slots of all groups of
  /// events.
  std::size_t inputs() const { return inputs_.size(); }
  /// Replaces `rays` by those of an input that the tile may see in a group: rays in front of their
  /// cameras on all planes of the group. Thread-safe.
  void gather(std::size_t group, std::size_t input, const TileCells& tile, TileRays& rays) const;
  /// Adds the other rays that are in front of their cameras on a plane of the group, in place of
  /// those of another plane. Thread-safe.
  void gatherOn(int plane, std::size_t group, std::size_t input, const TileCells& tile,
                TileRays& rays) const;
  /// From the plane where moving rays have their pixels to a plane, 1/m.
  double fromPixels(int plane) const {
    return 1 / planes_.depth(plane) - RayBins::pixelPlane(planes_);
  }

  /// Frees the rays; the counts stay.
  void release() { inputs_ = {}; }
  /// Per camera: the counts if no vote is cast.
  const std::vector<VoteCounts>& notCast() const { return not_cast_; }

 private:
  /// Bins and where they are on some planes.
  struct Source {
    std::size_t bins = 0;
    RayBins::Footprint footprint;
  };
  /// The bins that a group of planes needs.
  struct GroupSources {
    std::vector<Source> in_group;               // in front of their cameras on all planes
    std::vector<std::vector<Source>> on_plane;  // the others, by plane of the group; or empty
  };
  struct Input {
    std::vector<RayBins> bins;
    std::vector<GroupSources> groups;
  };

  std::vector<PlaneRange> dividePlanes(double shift) const;
  GroupSources sourcesOf(const std::vector<RayBins>& bins, const PlaneRange& group) const;

  const kernels::TileFunctions& functions_;
  DepthPlanes planes_;
  std::vector<Input> inputs_;
  std::vector<PlaneRange> groups_;
  std::vector<VoteCounts> not_cast_;
};

}  // namespace efm
