// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "mapping/dsi/vote_counts.h"
#include "mapping/sweep/plane_group.h"
#include "mapping/sweep/ray_bins.h"
#include "mapping/sweep/space_sweep.h"
#include "mapping/sweep/tile_accumulator.h"
#include "mapping/sweep/tile_rays.h"

namespace efm {

/// The rays of all cameras and slots of time, in bins, and the groups of planes in which a tile
/// looks them up.
class BinnedRays {
 public:
  /// @param cameras given up piece by piece: each bundle's memory goes when it lies in bins.
  BinnedRays(std::vector<CameraRays> cameras, const ReferenceView& view, const DepthPlanes& planes);

  /// Groups in which no ray moves far, from the nearest plane to the farthest; of one plane, where
  /// there are rays that are not on all planes.
  const std::vector<PlaneGroup>& groups() const { return groups_; }

  std::size_t inputs() const { return bins_.size(); }
  std::size_t inputOf(int camera, int slot) const {
    return static_cast<std::size_t>(camera * slots_ + slot);
  }
  /// The rays of an input that the voter's tile may see in a group, by its index. Thread-safe.
  void gather(std::size_t group, std::size_t input, const TileVoter& voter, TileRays& rays) const;
  /// How far the planes of a group are from the home of gathered rays, 1/m.
  double fromHome(int plane) const;

  /// Gives the rays' memory back; the counts stay.
  void release() {
    bins_ = {};
    reach_ = {};
  }
  /// Per camera, what the votes come to if none is cast.
  const std::vector<VoteCounts>& notCast() const { return not_cast_; }

 private:
  std::vector<PlaneGroup> groupPlanes() const;

  const DepthPlanes& planes_;
  double home_;  // inverse depth of the home plane
  int slots_;
  std::vector<std::vector<RayBins>> bins_;  // by camera and slot
  std::vector<PlaneGroup> groups_;
  std::vector<std::vector<std::vector<RayBins::GroupReach>>> reach_;  // by group, beside bins_
  std::vector<VoteCounts> not_cast_;
};

}  // namespace efm
