// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/sweep/plane_sweep.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cstdint>

#include "mapping/geometry/plane_transfer.h"
#include "mapping/kernels/bilinear_vote.h"
#include "mapping/sweep/tile_peaks.h"

namespace efm {
namespace {

/// Votes one camera's rays on one plane; `votes` is cleared first.
VoteCounts votePlane(const RayBundle& rays, const ReferenceView& view, double depth_m,
                     PlaneValues& votes) {
  std::fill(votes.begin(), votes.end(), 0.0F);
  const kernels::VotePlane plane{votes.data(), view.width, view.height};
  VoteCounts counts;
  for (const RayPacket& packet : rays.packets) {
    const std::uint64_t size = packet.end - packet.begin;
    const PlaneTransfer transfer = transferToPlane(packet, view, depth_m);
    if (!transfer.in_front) {
      counts.behind_camera += size;
      continue;
    }
    const std::uint64_t cast = kernels::voteBilinear(
        {rays.x_inf.data(), rays.y_inf.data()},
        {packet.begin, packet.end, static_cast<float>(transfer.scale),
         static_cast<float>(transfer.offset_x), static_cast<float>(transfer.offset_y)},
        plane);
    counts.cast += cast;
    counts.outside_view += size - cast;
  }
  return counts;
}

/// One plane at a time, on one thread.
struct PlaneScratch {
  PlaneFusion fusion;
  std::vector<VoteCounts> votes;  // per camera, of all planes so far
};

void sweepPlane(const std::vector<CameraRays>& cameras, const ReferenceView& view, double depth_m,
                PlaneScratch& scratch) {
  PlaneFusion& fusion = scratch.fusion;
  fusion.begin();
  for (const CameraSlot& input : fusion.inputs()) {
    const auto camera = static_cast<std::size_t>(input.camera);
    scratch.votes[camera] += votePlane(cameras[camera][static_cast<std::size_t>(input.slot)], view,
                                       depth_m, fusion.next());
    fusion.add(input);
  }
}

}  // namespace

SweepResult sweepPlanes(const std::vector<CameraRays>& cameras, const DsiGrid& grid,
                        const SpaceSweepOptions& options, const SweepRequest& request) {
  const int planes = grid.planes.size();
  const int threads = std::min(options.threadsOrCores(), planes);
  const std::size_t own_peaks = request.camera_peaks ? cameras.size() : 0;
  const auto keep =
      request.camera_peaks ? PlaneFusion::Keep::kCameras : PlaneFusion::Keep::kFusedOnly;
  std::vector<PlaneScratch> scratches(
      static_cast<std::size_t>(threads),
      {PlaneFusion(options.fusion, fusionInputs(cameras, request.groups), grid.view.pixels(), keep),
       std::vector<VoteCounts>(cameras.size())});
  // The view is one tile.
  const cv::Rect tile(0, 0, grid.view.width, grid.view.height);
  std::vector<TilePeaks> peaks(1 + own_peaks,
                               TilePeaks(planes, request.column_window, grid.view.pixels()));
  for (TilePeaks& of_dsi : peaks) of_dsi.moveTo(tile, VotingKernel::kPlain);

  tbb::task_arena arena(threads);
  for (int begin = 0; begin < planes; begin += threads) {
    const int count = std::min(threads, planes - begin);
    arena.execute([&] {
      tbb::parallel_for(0, count, [&](int i) {
        sweepPlane(cameras, grid.view, grid.planes.depth(begin + i),
                   scratches[static_cast<std::size_t>(i)]);
      });
    });
    for (int i = 0; i < count; ++i) {
      const PlaneFusion& fusion = scratches[static_cast<std::size_t>(i)].fusion;
      peaks[0].add(begin + i, fusion.fused());
      for (std::size_t c = 0; c < own_peaks; ++c) {
        peaks[1 + c].add(begin + i, fusion.ofCamera(static_cast<int>(c)));
      }
      if (request.sink != nullptr) request.sink->addPlane(begin + i, fusion.fused().data());
    }
  }

  const auto swept = [&](const TilePeaks& of_dsi) {
    ViewPeaks view(grid, request.column_window, 1);
    of_dsi.writeTo(view, 0);
    return view.sweptDsi();
  };
  SweepResult result{swept(peaks[0]), {}, std::vector<VoteCounts>(cameras.size())};
  for (std::size_t c = 0; c < own_peaks; ++c) result.cameras.push_back(swept(peaks[1 + c]));
  for (const PlaneScratch& scratch : scratches) {
    for (std::size_t c = 0; c < cameras.size(); ++c) result.votes[c] += scratch.votes[c];
  }
  return result;
}

}  // namespace efm
