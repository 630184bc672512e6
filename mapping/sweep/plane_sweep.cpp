// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/sweep/plane_sweep.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/partitioner.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <utility>

#include "mapping/kernels/bilinear_vote.h"

namespace efm {
namespace {

/// Two groups of planes per thread even out that some planes cost more than others.
constexpr int kGroupsPerThread = 2;

/// Consecutive planes that one thread sweeps.
struct SweptGroup {
  int begin = 0;
  int end = 0;
  std::optional<RunningPeaks> peaks;
  std::vector<RunningPeaks> camera_peaks;  // per camera, where asked for
  std::vector<VoteCounts> votes;           // per camera
};

/// DSIs as a whole, where values along rays are asked for: the simplest way to have them.
class Volumes {
 public:
  Volumes(const ReferenceView& view, int planes, std::size_t count, int ray_window)
      : planes_(planes), ray_window_(ray_window) {
    if (ray_window > 0) volumes_.assign(count, TileVolume(planes, view.pixels()));
  }
  /// Several threads may give different planes at once.
  void take(std::size_t volume, int plane, const PlaneValues& values) {
    if (!volumes_.empty()) volumes_[volume].take(plane, values);
  }
  SweptDsi swept(std::size_t volume, DsiPeaks peaks) const {
    if (volumes_.empty()) return {std::move(peaks), {}};
    const cv::Size size = peaks.confidence.size();
    std::vector<DsiRays::Tile> all = {
        DsiRays::pick({{0, 0}, size}, peaks.confidence, volumes_[volume], planes_, ray_window_)};
    return {std::move(peaks), DsiRays(size, planes_, std::move(all))};
  }

 private:
  int planes_;
  int ray_window_;
  std::vector<TileVolume> volumes_;
};

std::vector<SweptGroup> groupPlanes(int planes, int threads) {
  const int count = threads == 1 ? 1 : std::min(planes, threads * kGroupsPerThread);
  std::vector<SweptGroup> groups(static_cast<std::size_t>(count));
  for (int g = 0; g < count; ++g) {
    auto& group = groups[static_cast<std::size_t>(g)];
    group.begin = static_cast<int>(std::int64_t{planes} * g / count);
    group.end = static_cast<int>(std::int64_t{planes} * (g + 1) / count);
  }
  return groups;
}

kernels::RayTransfer narrow(const RayPacket& packet, const PlaneTransfer& transfer) {
  return {packet.begin, packet.end, static_cast<float>(transfer.scale),
          static_cast<float>(transfer.offset_x), static_cast<float>(transfer.offset_y)};
}

/// Votes one camera's rays on one plane; `votes` is cleared first.
VoteCounts votePlane(const RayBundle& camera, const ReferenceView& view, double depth_m,
                     PlaneValues& votes) {
  std::fill(votes.begin(), votes.end(), 0.0F);
  const kernels::VotePlane plane{votes.data(), view.width, view.height};
  VoteCounts counts;
  for (const RayPacket& packet : camera.packets) {
    const std::uint64_t rays = packet.end - packet.begin;
    const PlaneTransfer transfer = transferToPlane(packet, view, depth_m);
    if (!transfer.in_front) {
      counts.behind_camera += rays;
      continue;
    }
    const std::uint64_t cast = kernels::votePlain({camera.x_inf.data(), camera.y_inf.data()},
                                                  narrow(packet, transfer), plane);
    counts.cast += cast;
    counts.outside_view += rays - cast;
  }
  return counts;
}

}  // namespace

SweepResult sweepPlanes(const std::vector<CameraRays>& rays, const ReferenceView& view,
                        const DepthPlanes& planes, const SpaceSweepOptions& options,
                        const SweepRequest& request) {
  const std::size_t cameras = rays.size();
  const std::size_t kept_cameras = request.camera_peaks ? cameras : 0;
  std::vector<SweptGroup> groups = groupPlanes(planes.size(), options.threadsOrCores());
  Volumes volumes(view, planes.size(), 1 + kept_cameras, request.ray_window);

  const auto sweep_group = [&](SweptGroup& group) {
    RunningPeaks& peaks = group.peaks.emplace(view.pixels(), options.kernelOrFastest());
    group.camera_peaks.assign(kept_cameras, RunningPeaks(view.pixels(), options.kernelOrFastest()));
    group.votes.resize(cameras);
    PlaneFusion fusion(
        options.fusion, fusionInputs(rays, request.groups), view.pixels(),
        request.camera_peaks ? PlaneFusion::Keep::kCameras : PlaneFusion::Keep::kFusedOnly,
        options.kernelOrFastest());
    for (int plane = group.begin; plane < group.end; ++plane) {
      const PlaneValues& fused = fusion.fuse([&](int camera, int slot, PlaneValues& votes) {
        const auto c = static_cast<std::size_t>(camera);
        group.votes[c] +=
            votePlane(rays[c][static_cast<std::size_t>(slot)], view, planes.depth(plane), votes);
      });
      peaks.take(plane, fused);
      volumes.take(0, plane, fused);
      for (std::size_t c = 0; c < kept_cameras; ++c) {
        const PlaneValues& alone = fusion.ofCamera(static_cast<int>(c));
        group.camera_peaks[c].take(plane, alone);
        volumes.take(c + 1, plane, alone);
      }
      if (request.sink != nullptr) request.sink->takePlane(plane, fused.data());
    }
  };
  tbb::task_arena arena(options.threadsOrCores());
  arena.execute([&] {
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, groups.size()),
        [&](const tbb::blocked_range<std::size_t>& range) {
          for (std::size_t g = range.begin(); g < range.end(); ++g) sweep_group(groups[g]);
        },
        tbb::simple_partitioner());
  });

  SweptGroup& all = groups.front();
  for (auto group = groups.begin() + 1; group != groups.end(); ++group) {
    all.peaks->append(*group->peaks);
    for (std::size_t c = 0; c < kept_cameras; ++c) {
      all.camera_peaks[c].append(group->camera_peaks[c]);
    }
    for (std::size_t c = 0; c < cameras; ++c) all.votes[c] += group->votes[c];
  }
  SweepResult result{volumes.swept(0, all.peaks->images(view)), {}, all.votes};
  for (std::size_t c = 0; c < kept_cameras; ++c) {
    result.cameras.push_back(volumes.swept(c + 1, all.camera_peaks[c].images(view)));
  }
  return result;
}

}  // namespace efm
