// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/sweep/space_sweep.h"

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/partitioner.h>
#include <opencv2/core.hpp>

#include <algorithm>
#include <cassert>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <utility>

#include "mapping/base/option.h"
#include "mapping/base/text.h"
#include "mapping/base/thread_arena.h"
#include "mapping/geometry/reference_view.h"
#include "mapping/kernels/kernels.h"
#include "mapping/sweep/plane_choice.h"
#include "mapping/sweep/ray_bins.h"
#include "mapping/sweep/tiles.h"

namespace efm {
namespace {

std::string namesOfAvailableKernels() {
  std::string names;
  for (const VotingKernel kernel : availableKernels()) {
    names += (names.empty() ? "" : ", ") + std::string(nameOf(kernel));
  }
  return names;
}

}  // namespace

void SpaceSweepOptions::validate() const {
  requireFields(*this);
  fusion.validate();
  requireOption(isAvailable(kernelOrFastest()), "kernel", nameOf(kernelOrFastest()),
                "one that this build and processor have: " + namesOfAvailableKernels());
}

int SpaceSweepOptions::threadsOrCores() const {
  // The host of this process limits the number of threads, also a requested number.
  const auto allowed = static_cast<int>(
      tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
  if (threads) return std::max(1, std::min(*threads, allowed));
  for (const char* name : {"SLURM_CPUS_PER_TASK", "SLURM_CPUS_ON_NODE"}) {  // of this job
    const char* const text = std::getenv(name);
    const auto processors = parseNumber<int>(text == nullptr ? "" : text);
    if (processors && *processors > 0) return std::min(*processors, allowed);
  }
  return std::max(1, allowed);
}

VotingKernel SpaceSweepOptions::kernelOrFastest() const { return kernel.value_or(fastestKernel()); }

FusionInputs fusionInputs(const std::vector<CameraRays>& cameras, int groups) {
  const auto slots = static_cast<int>(cameras.front().size());
  assert(groups >= 1 && slots % groups == 0);
  return {static_cast<int>(cameras.size()), slots / groups, groups};
}

SweepResult sweepSpace(std::vector<CameraRays> cameras, const DsiGrid& grid,
                       const SpaceSweepOptions& options, const SweepRequest& request) {
  options.validate();
  return options.kernelOrFastest() == VotingKernel::kPlain
             ? sweepPlanes(cameras, grid, options, request)
             : sweepTiles(std::move(cameras), grid, options, request);
}

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

/// The buffers of one thread, which sweeps one plane at a time.
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

  ThreadArena arena(threads);
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

namespace {

/// Returns the first pixel of each part of a side, and the end of the side.
std::vector<int> cut(int side, int max_pixels) {
  const int parts = (side + max_pixels - 1) / max_pixels;
  std::vector<int> cuts;
  for (int i = 0; i <= parts; ++i) {
    cuts.push_back(static_cast<int>(std::int64_t{side} * i / parts));
  }
  return cuts;
}

/// The buffers of one thread, reused from tile to tile.
struct Scratch {
  std::vector<TileRays> rays;  // by input
  TileFusion fusion;
  TilePeaks fused;
  TileVolume not_added;  // a plane that the peaks do not get
  std::vector<TilePeaks> cameras;  // empty if not requested
  std::vector<std::uint64_t>
      interpolated;  // by camera: VoteCounts::interpolated, in units of weight
};

/// The whole DSI for a sink.
class WholePlanes {
 public:
  WholePlanes(DsiSink* sink, const DsiGrid& grid) : sink_(sink) {
    planes_.resize(sink == nullptr ? 0 : static_cast<std::size_t>(grid.planes.size()));
    for (cv::Mat1f& plane : planes_) plane.create(grid.view.height, grid.view.width);
  }

  /// Several threads may write different tiles.
  void write(int plane, const cv::Rect& tile, const float* values) {
    if (sink_ != nullptr) writeTo(planes_[static_cast<std::size_t>(plane)](tile), values);
  }
  void deliver() {
    for (std::size_t plane = 0; plane < planes_.size(); ++plane) {
      sink_->addPlane(static_cast<int>(plane), planes_[plane][0]);
    }
  }

 private:
  DsiSink* sink_;
  std::vector<cv::Mat1f> planes_;
};

class TiledSweep {
 public:
  TiledSweep(std::vector<CameraRays> cameras, const DsiGrid& grid, const SpaceSweepOptions& options,
             const SweepRequest& request)
      : grid_(grid),
        options_(options),
        request_(request),
        kernel_(options.kernelOrFastest()),
        inputs_(fusionInputs(cameras, request.groups)),
        tiles_(tilesOf(grid.view, TileCells::kMaxPixels)),
        rays_(std::move(cameras), grid, kernel_),
        whole_planes_(request.sink, grid),
        fused_(grid, request.column_window, tiles_.size()) {
    for (int c = 0; request.camera_peaks && c < inputs_.cameras; ++c) {
      cameras_.emplace_back(grid, request.column_window, tiles_.size());
    }
  }

  /// Sweeps all tiles on the threads of the caller's task arena.
  SweepResult run() {
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, tiles_.size()),
        [&](const tbb::blocked_range<std::size_t>& range) {
          Scratch& scratch = scratches_.local();
          for (std::size_t t = range.begin(); t < range.end(); ++t) sweepTile(t, scratch);
        },
        tbb::simple_partitioner());
    rays_.release();
    whole_planes_.deliver();
    return result();
  }

 private:
  Scratch newScratch() const {
    constexpr std::size_t kPixels = TileCells::kMaxPixels * TileCells::kMaxPixels;
    TilePeaks peaks(grid_.planes.size(), request_.column_window, kPixels);
    const auto keep =
        request_.camera_peaks ? PlaneFusion::Keep::kCameras : PlaneFusion::Keep::kFusedOnly;
    std::vector<TilePeaks> cameras(cameras_.size(), peaks);
    return {std::vector<TileRays>(rays_.inputs()),
            TileFusion(options_.fusion, inputs_, keep, kernel_), std::move(peaks),
            TileVolume(1, kPixels), std::move(cameras),
            std::vector<std::uint64_t>(static_cast<std::size_t>(inputs_.cameras))};
  }

  /// Sweeps one tile: all planes, or the coarse planes and those between them at edges.
  void sweepTile(std::size_t t, Scratch& scratch) {
    const TileCells tile(tiles_[t], grid_.view);
    scratch.fusion.moveTo(tile);
    scratch.fused.moveTo(tile.tile, kernel_);
    for (TilePeaks& camera : scratch.cameras) camera.moveTo(tile.tile, kernel_);
    if (request_.column_window == 0 || request_.coarse_step == 1) {
      sweepOnTile(coarsePlanes(grid_.planes.size(), 1), true, tile, scratch);
    } else {
      sweepCoarseToFine(tile, scratch);
    }
    scratch.fused.writeTo(fused_, t);
    for (std::size_t c = 0; c < cameras_.size(); ++c) scratch.cameras[c].writeTo(cameras_[c], t);
  }

  void sweepCoarseToFine(const TileCells& tile, Scratch& scratch) {
    const PlaneSet coarse = coarsePlanes(grid_.planes.size(), request_.coarse_step);
    const std::vector<std::uint64_t> before = scratch.fusion.units();
    sweepOnTile(coarse, true, tile, scratch);
    const std::vector<std::uint64_t> after = scratch.fusion.units();
    PlaneSet added =
        planesAtEdges(coarse, scratch.fused.peaks(), tile.tile.size(), request_.column_window);
    sweepOnTile(added, true, tile, scratch);
    for (std::size_t plane = 0; plane < added.size(); ++plane) {
      if (coarse[plane]) added[plane] = true;
    }
    scratch.fused.interpolate(added);
    added.flip();
    if (request_.sink != nullptr || !cameras_.empty()) {
      return sweepOnTile(added, false, tile, scratch);
    }
    const auto left_out = static_cast<std::uint64_t>(std::count(added.begin(), added.end(), true));
    const auto swept = static_cast<std::uint64_t>(std::count(coarse.begin(), coarse.end(), true));
    for (std::size_t c = 0; c < after.size(); ++c) {
      scratch.interpolated[c] += left_out * (after[c] - before[c]) / swept;
    }
  }

  /// Sweeps some planes on a tile. @param adds true: also to the peaks of the fused DSI.
  void sweepOnTile(const PlaneSet& set, bool adds, const TileCells& tile, Scratch& scratch) {
    for (std::size_t group = 0; group < rays_.groups().size(); ++group) {
      const PlaneRange& planes = rays_.groups()[group];
      if (std::find(set.begin() + planes.begin, set.begin() + planes.end, true) ==
          set.begin() + planes.end) {
        continue;
      }
      for (std::size_t input = 0; input < rays_.inputs(); ++input) {
        rays_.gather(group, input, tile, scratch.rays[input]);
      }
      for (int plane = planes.begin; plane < planes.end; ++plane) {
        if (!set[static_cast<std::size_t>(plane)]) continue;
        for (std::size_t input = 0; input < rays_.inputs(); ++input) {
          rays_.gatherOn(plane, group, input, tile, scratch.rays[input]);
        }
        sweepPlane(plane, adds, tile.tile, scratch);
      }
    }
  }

  void sweepPlane(int plane, bool adds, const cv::Rect& tile, Scratch& scratch) {
    float* fused = adds ? scratch.fused.plane(plane) : scratch.not_added.plane(0);
    scratch.fusion.fuse(scratch.rays, rays_.fromPixels(plane), fused);
    if (adds) scratch.fused.add(plane);
    for (std::size_t c = 0; c < scratch.cameras.size(); ++c) {
      scratch.cameras[c].add(plane, scratch.fusion.ofCamera(static_cast<int>(c)));
    }
    whole_planes_.write(plane, tile, fused);
  }

  SweepResult result() {
    SweepResult result{fused_.sweptDsi(), {}, rays_.notCast()};
    for (ViewPeaks& camera : cameras_) result.cameras.push_back(camera.sweptDsi());
    for (std::size_t c = 0; c < result.votes.size(); ++c) {
      std::uint64_t units = 0;
      std::uint64_t interpolated = 0;
      for (const Scratch& scratch : scratches_) {
        units += scratch.fusion.units()[c];
        interpolated += scratch.interpolated[c];
      }
      VoteCounts& votes = result.votes[c];
      votes.cast += units >> kernels::kWeightBits;
      votes.interpolated +=
          std::min(interpolated >> kernels::kWeightBits, votes.outside_view - votes.cast);
      votes.outside_view -= votes.cast + votes.interpolated;
    }
    return result;
  }

  DsiGrid grid_;
  SpaceSweepOptions options_;
  SweepRequest request_;
  VotingKernel kernel_;
  FusionInputs inputs_;
  std::vector<cv::Rect> tiles_;
  RayIndex rays_;
  WholePlanes whole_planes_;
  ViewPeaks fused_;
  std::vector<ViewPeaks> cameras_;  // empty if not requested
  tbb::enumerable_thread_specific<Scratch> scratches_{[this] { return newScratch(); }};
};

}  // namespace

std::vector<cv::Rect> tilesOf(const ReferenceView& view, int max_pixels) {
  const std::vector<int> columns = cut(view.width, max_pixels);
  const std::vector<int> rows = cut(view.height, max_pixels);
  std::vector<cv::Rect> tiles;
  for (std::size_t r = 0; r + 1 < rows.size(); ++r) {
    for (std::size_t c = 0; c + 1 < columns.size(); ++c) {
      tiles.emplace_back(cv::Point(columns[c], rows[r]), cv::Point(columns[c + 1], rows[r + 1]));
    }
  }
  return tiles;
}

SweepResult sweepTiles(std::vector<CameraRays> cameras, const DsiGrid& grid,
                       const SpaceSweepOptions& options, const SweepRequest& request) {
  assert(request.coarse_step >= 1);
  ThreadArena arena(options.threadsOrCores());
  return arena.execute(
      [&] { return TiledSweep(std::move(cameras), grid, options, request).run(); });
}

}  // namespace efm
