// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/sweep/ray_index.h"

#include <algorithm>
#include <utility>

namespace efm {
namespace {

/// How far rays may move within a group of planes. Farther, and more of a tile's rays lie outside
/// it on some planes; less far, and rays are looked up more often.
constexpr double kGroupShift_px = 10;
/// Where hardly anything moves: whoever wants to see planes as a whole gets so many at a time.
constexpr int kMostPlanesInGroup = 20;

/// Events times planes on which the camera looks the other way.
std::uint64_t countBehind(const RayBundle& rays, const ReferenceView& view,
                          const DepthPlanes& planes) {
  const auto in_front = [&](const RayPacket& packet, int plane) {
    return transferToPlane(packet, view, planes.depth(plane)).in_front;
  };
  std::uint64_t behind = 0;
  for (const RayPacket& packet : rays.packets) {
    // Before the camera on both outermost planes is before it on all between them.
    if (in_front(packet, 0) && in_front(packet, planes.size() - 1)) continue;
    for (int plane = 0; plane < planes.size(); ++plane) {
      if (!in_front(packet, plane)) behind += packet.end - packet.begin;
    }
  }
  return behind;
}

}  // namespace

BinnedRays::BinnedRays(std::vector<CameraRays> cameras, const ReferenceView& view,
                       const DepthPlanes& planes)
    : planes_(planes),
      home_(RayBins::middleOf(planes)),
      slots_(static_cast<int>(cameras.front().size())) {
  for (CameraRays& camera : cameras) {
    VoteCounts& votes = not_cast_.emplace_back();
    for (RayBundle& slot : camera) {
      const RayBundle rays = std::move(slot);
      const std::uint64_t behind = countBehind(rays, view, planes);
      votes.behind_camera += behind;
      votes.outside_view += rays.size() * static_cast<std::uint64_t>(planes.size()) - behind;
      bins_.push_back(RayBins::sort(rays, view, planes));
    }
  }
  groups_ = groupPlanes();
  for (const PlaneGroup& group : groups_) {
    auto& reach = reach_.emplace_back();
    for (const auto& input : bins_) {
      auto& of_input = reach.emplace_back();
      for (const RayBins& bins : input) of_input.push_back(bins.reachIn(group));
    }
  }
}

std::vector<PlaneGroup> BinnedRays::groupPlanes() const {
  double fastest = 0;
  bool on_all_planes = true;
  for (const auto& input : bins_) {
    for (const RayBins& bins : input) {
      on_all_planes = on_all_planes && bins.onAllPlanes();
      if (bins.onAllPlanes()) fastest = std::max(fastest, bins.fastestShift());
    }
  }
  std::vector<PlaneGroup> groups;
  for (int begin = 0; begin < planes_.size(); begin = groups.back().end) {
    const double first = 1 / planes_.depth(begin);
    int end = begin + 1;
    while (on_all_planes && end < planes_.size() && end - begin < kMostPlanesInGroup &&
           (first - 1 / planes_.depth(end)) * fastest <= kGroupShift_px) {
      ++end;
    }
    groups.push_back({begin, end, planes_.depth(begin), planes_.depth(end - 1)});
  }
  return groups;
}

void BinnedRays::gather(std::size_t group, std::size_t input, const TileVoter& voter,
                        TileRays& rays) const {
  rays.clear();
  for (std::size_t i = 0; i < bins_[input].size(); ++i) {
    bins_[input][i].gather(reach_[group][input][i], voter.cells(), voter.origin(),
                           voter.functions(), rays);
  }
  rays.pad();
}

double BinnedRays::fromHome(int plane) const { return 1 / planes_.depth(plane) - home_; }

}  // namespace efm
