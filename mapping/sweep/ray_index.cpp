// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/sweep/ray_index.h"

#include <algorithm>
#include <utility>

namespace efm {
namespace {

/// The largest shift of a ray within a group of planes. With a larger one, a tile gathers more rays
/// that are outside it on some planes; with a smaller one, it gathers more often.
constexpr double kMaxGroupShift_px = 10;
/// A limit where rays hardly move.
constexpr int kMaxGroupPlanes = 20;

/// Votes on planes behind the camera.
std::uint64_t countBehind(const RayBundle& rays, const DsiGrid& grid) {
  const auto in_front = [&](const RayPacket& packet, int plane) {
    return transferToPlane(packet, grid.view, grid.planes.depth(plane)).in_front;
  };
  std::uint64_t behind = 0;
  for (const RayPacket& packet : rays.packets) {
    // With both outermost planes in front of the camera, all between them are.
    if (in_front(packet, 0) && in_front(packet, grid.planes.size() - 1)) continue;
    for (int plane = 0; plane < grid.planes.size(); ++plane) {
      if (!in_front(packet, plane)) behind += packet.end - packet.begin;
    }
  }
  return behind;
}

}  // namespace

RayIndex::RayIndex(std::vector<CameraRays> cameras, const DsiGrid& grid, VotingKernel kernel)
    : functions_(kernels::tileFunctions(kernel)), planes_(grid.planes) {
  for (CameraRays& camera : cameras) {
    VoteCounts& votes = not_cast_.emplace_back();
    for (RayBundle& slot : camera) {
      const RayBundle rays = std::move(slot);
      const std::uint64_t behind = countBehind(rays, grid);
      votes.behind_camera += behind;
      votes.outside_view += rays.size() * static_cast<std::uint64_t>(planes_.size()) - behind;
      bins_.push_back(RayBins::sort(rays, grid));
    }
  }
  groups_ = dividePlanes();
  for (const PlaneRange& group : groups_) {
    auto& footprints = footprints_.emplace_back();
    for (const auto& input : bins_) {
      auto& of_input = footprints.emplace_back();
      for (const RayBins& bins : input) of_input.push_back(bins.footprintIn(group));
    }
  }
}

std::vector<PlaneRange> RayIndex::dividePlanes() const {
  double max_shift = 0;
  bool on_all_planes = true;
  for (const auto& input : bins_) {
    for (const RayBins& bins : input) {
      on_all_planes = on_all_planes && bins.onAllPlanes();
      if (bins.onAllPlanes()) max_shift = std::max(max_shift, bins.maxShift());
    }
  }
  std::vector<PlaneRange> groups;
  for (int begin = 0; begin < planes_.size(); begin = groups.back().end) {
    const double first = 1 / planes_.depth(begin);
    int end = begin + 1;
    while (on_all_planes && end < planes_.size() && end - begin < kMaxGroupPlanes &&
           (first - 1 / planes_.depth(end)) * max_shift <= kMaxGroupShift_px) {
      ++end;
    }
    groups.push_back({begin, end, planes_.depth(begin), planes_.depth(end - 1)});
  }
  return groups;
}

void RayIndex::gather(std::size_t group, std::size_t input, const TileCells& tile,
                      TileRays& rays) const {
  rays.clear();
  for (std::size_t i = 0; i < bins_[input].size(); ++i) {
    bins_[input][i].gather(footprints_[group][input][i], tile, functions_, rays);
  }
  rays.pad();
}

double RayIndex::fromAnchor(int plane) const {
  return 1 / planes_.depth(plane) - RayBins::middleAnchor(planes_);
}

}  // namespace efm
