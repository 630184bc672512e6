// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/sweep/ray_bins.h"

#include <cmath>

namespace efm {
namespace {

/// The cost of gathering a ray for a group of planes, in votes. It includes the rays around the
/// tile that are tested but not used.
constexpr double kGatheringVotes = 2.5;

/// Returns the number of votes on planes behind the camera.
std::uint64_t countBehind(const RayBundle& rays, const DsiGrid& grid) {
  std::uint64_t behind = 0;
  for (const RayPacket& packet : rays.packets) {
    const PlaneRange in_front = planesInFront(packet, grid);
    const int planes = grid.planes.size() - (in_front.end - in_front.begin);
    behind += static_cast<std::uint64_t>(planes) * (packet.end - packet.begin);
  }
  return behind;
}

/// The mean shift of rays, in pixels per 1/m of inverse depth. For each packet, it is the
/// shift of a ray halfway between the principal point and the border of the view.
class MeanShift {
 public:
  explicit MeanShift(const DsiGrid& grid) : view_(grid.view) {
    const double range = 1 / grid.planes.depth(0) - 1 / grid.planes.depth(grid.planes.size() - 1);
    // The limit is the size of the view: a fast ray crosses the view only once.
    max_shift_ = std::max(view_.width, view_.height) / std::max(range, 1e-12);
  }

  void add(const RayBundle& rays) {
    for (const RayPacket& packet : rays.packets) {
      const Eigen::Vector3d center = packet.center_ref.cwiseAbs();
      const double shift = std::max(view_.fx * center.x() + 0.25 * view_.width * center.z(),
                                    view_.fy * center.y() + 0.25 * view_.height * center.z());
      const auto count = static_cast<double>(packet.end - packet.begin);
      sum_ += count * std::min(shift, max_shift_);
      count_ += count;
    }
  }
  double mean() const { return count_ > 0 ? sum_ / count_ : 0; }

 private:
  ReferenceView view_;
  double max_shift_ = 0;
  double sum_ = 0;
  double count_ = 0;
};

}  // namespace

RayIndex::RayIndex(std::vector<CameraRays> cameras, const DsiGrid& grid, VotingKernel kernel)
    : functions_(kernels::tileFunctions(kernel)), planes_(grid.planes) {
  MeanShift shift(grid);
  for (CameraRays& camera : cameras) {
    VoteCounts& votes = not_cast_.emplace_back();
    for (RayBundle& slot : camera) {
      const RayBundle rays = std::move(slot);
      const std::uint64_t behind = countBehind(rays, grid);
      votes.behind_camera += behind;
      votes.outside_view += rays.size() * static_cast<std::uint64_t>(planes_.size()) - behind;
      shift.add(rays);
      inputs_.push_back({RayBins::sort(rays, grid), {}});
    }
  }
  groups_ = dividePlanes(shift.mean());
  for (Input& input : inputs_) {
    for (const PlaneRange& group : groups_) input.groups.push_back(sourcesOf(input.bins, group));
  }
}

/// Rays that move within a group are gathered by more tiles, and vote outside these tiles on some
/// planes. A vote costs 1 + n s / t + kGatheringVotes / n if rays move by s pixels per plane, a
/// group has n planes and a tile has t pixels per side. The cost is lowest if
/// n s = sqrt(kGatheringVotes t s).
std::vector<PlaneRange> RayIndex::dividePlanes(double shift) const {
  const double range = 1 / planes_.depth(0) - 1 / planes_.depth(planes_.size() - 1);
  const double per_plane_px = shift * range / std::max(1, planes_.size() - 1);
  const double group_px = std::sqrt(kGatheringVotes * TileCells::kMaxPixels * per_plane_px);
  std::vector<PlaneRange> groups;
  for (int begin = 0; begin < planes_.size(); begin = groups.back().end) {
    const double first = 1 / planes_.depth(begin);
    int end = begin + 1;
    while (end < planes_.size() && (first - 1 / planes_.depth(end)) * shift <= group_px) ++end;
    groups.emplace_back(planes_, begin, end);
  }
  return groups;
}

RayIndex::GroupSources RayIndex::sourcesOf(const std::vector<RayBins>& bins,
                                           const PlaneRange& group) const {
  GroupSources sources;
  for (std::size_t i = 0; i < bins.size(); ++i) {
    if (bins[i].covers(group)) {
      sources.in_group.push_back({i, bins[i].footprintOn(group)});
      continue;
    }
    for (int plane = group.begin; plane < group.end; ++plane) {
      if (!bins[i].isInFront(plane)) continue;
      sources.on_plane.resize(static_cast<std::size_t>(group.end - group.begin));
      sources.on_plane[static_cast<std::size_t>(plane - group.begin)].push_back(
          {i, bins[i].footprintOn({planes_, plane, plane + 1})});
    }
  }
  return sources;
}

void RayIndex::gather(std::size_t group, std::size_t input, const TileCells& tile,
                      TileRays& rays) const {
  rays.clear();
  const Input& of = inputs_[input];
  for (const Source& source : of.groups[group].in_group) {
    of.bins[source.bins].gather(source.footprint, tile, functions_, rays);
  }
  rays.keep();
  rays.pad();
}

void RayIndex::gatherOn(int plane, std::size_t group, std::size_t input, const TileCells& tile,
                        TileRays& rays) const {
  const Input& of = inputs_[input];
  const auto& on_plane = of.groups[group].on_plane;
  if (on_plane.empty()) return;
  rays.clearToKept();
  for (const Source& source : on_plane[static_cast<std::size_t>(plane - groups_[group].begin)]) {
    of.bins[source.bins].gather(source.footprint, tile, functions_, rays);
  }
  rays.pad();
}

}  // namespace efm
