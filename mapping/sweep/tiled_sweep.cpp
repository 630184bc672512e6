// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/sweep/tiled_sweep.h"

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/partitioner.h>
#include <tbb/task_arena.h>

#include <opencv2/core.hpp>
#include <utility>

#include "mapping/sweep/plane_group.h"
#include "mapping/sweep/ray_index.h"
#include "mapping/sweep/tile_accumulator.h"
#include "mapping/sweep/tile_peaks.h"
#include "mapping/sweep/tile_rays.h"
#include "mapping/sweep/view_tiles.h"

namespace efm {
namespace {

/// What one thread needs, kept from tile to tile.
struct Workplace {
  TileVoter voter;
  std::vector<TileRays> rays;        // by camera and slot
  std::vector<std::uint64_t> votes;  // by camera
  TileFinds fused;
  std::vector<TileFinds> cameras;  // where they are asked for
};

/// The whole DSI, where somebody wants to see it.
class WholePlanes {
 public:
  WholePlanes(DsiSink* sink, const ReferenceView& view, int planes) : sink_(sink) {
    planes_.resize(sink == nullptr ? 0 : static_cast<std::size_t>(planes));
    for (cv::Mat1f& plane : planes_) plane.create(view.height, view.width);
  }

  /// Several threads may give different tiles at once.
  void take(int plane, const cv::Rect& tile, const PlaneValues& values) {
    if (sink_ != nullptr) writeTo(planes_[static_cast<std::size_t>(plane)](tile), values);
  }
  void give() {
    for (std::size_t plane = 0; plane < planes_.size(); ++plane) {
      sink_->takePlane(static_cast<int>(plane), planes_[plane][0]);
    }
  }

 private:
  DsiSink* sink_;
  std::vector<cv::Mat1f> planes_;
};

class TiledSweep {
 public:
  TiledSweep(std::vector<CameraRays> cameras, const ReferenceView& view, const DepthPlanes& planes,
             const SpaceSweepOptions& options, const SweepRequest& request)
      : view_(view),
        planes_(planes.size()),
        options_(options),
        request_(request),
        kernel_(options.kernelOrFastest()),
        cameras_(static_cast<int>(cameras.size())),
        inputs_(fusionInputs(cameras, request.groups)),
        tiles_(tilesOf(view, TileVoter::kTilePixels)),
        rays_(std::move(cameras), view, planes),
        whole_planes_(request.sink, view, planes_),
        fused_(view, tiles_.size()) {
    for (std::size_t c = 0; c < seenAlone(); ++c) alone_.emplace_back(view, tiles_.size());
  }

  /// On the threads of the task arena that it is called in.
  SweepResult run() {
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, tiles_.size()),
        [&](const tbb::blocked_range<std::size_t>& range) {
          Workplace& workplace = workplaces_.local();
          for (std::size_t t = range.begin(); t < range.end(); ++t) sweepTile(t, workplace);
        },
        tbb::simple_partitioner());
    rays_.release();
    whole_planes_.give();
    return result();
  }

 private:
  /// The number of cameras whose own DSIs are asked for.
  std::size_t seenAlone() const {
    return request_.camera_peaks ? static_cast<std::size_t>(cameras_) : 0;
  }

  Workplace newWorkplace() const {
    const TileFinds finds(planes_, request_.ray_window,
                          TileVoter::kTilePixels * TileVoter::kTilePixels);
    return {TileVoter(kernel_), std::vector<TileRays>(rays_.inputs()),
            std::vector<std::uint64_t>(static_cast<std::size_t>(cameras_)), finds,
            std::vector<TileFinds>(seenAlone(), finds)};
  }

  /// All planes on one tile.
  void sweepTile(std::size_t t, Workplace& workplace) {
    const cv::Rect& tile = tiles_[t];
    workplace.voter.moveTo(tile, view_);
    workplace.fused.moveTo(tile, kernel_);
    for (TileFinds& camera : workplace.cameras) camera.moveTo(tile, kernel_);
    PlaneFusion fusion(
        options_.fusion, inputs_, static_cast<std::size_t>(tile.area()),
        request_.camera_peaks ? PlaneFusion::Keep::kCameras : PlaneFusion::Keep::kFusedOnly,
        kernel_);
    for (std::size_t group = 0; group < rays_.groups().size(); ++group) {
      for (std::size_t i = 0; i < rays_.inputs(); ++i) {
        rays_.gather(group, i, workplace.voter, workplace.rays[i]);
      }
      const PlaneGroup& planes = rays_.groups()[group];
      for (int plane = planes.begin; plane < planes.end; ++plane) {
        sweepPlane(plane, tile, fusion, workplace);
      }
    }
    workplace.fused.writeTo(fused_.peaks, fused_.rays[t]);
    for (std::size_t c = 0; c < alone_.size(); ++c) {
      workplace.cameras[c].writeTo(alone_[c].peaks, alone_[c].rays[t]);
    }
  }

  void sweepPlane(int plane, const cv::Rect& tile, PlaneFusion& fusion, Workplace& workplace) {
    const PlaneValues& fused = fusion.fuse([&](int camera, int slot, TileDensity& density) {
      workplace.votes[static_cast<std::size_t>(camera)] += workplace.voter.vote(
          workplace.rays[rays_.inputOf(camera, slot)], rays_.fromHome(plane), density);
    });
    workplace.fused.take(plane, fused);
    for (std::size_t c = 0; c < workplace.cameras.size(); ++c) {
      workplace.cameras[c].take(plane, fusion.ofCamera(static_cast<int>(c)));
    }
    whole_planes_.take(plane, tile, fused);
  }

  SweepResult result() {
    SweepResult result{fused_.whole(planes_, request_.ray_window > 0), {}, rays_.notCast()};
    for (Found& camera : alone_)
      result.cameras.push_back(camera.whole(planes_, request_.ray_window > 0));
    for (const Workplace& workplace : workplaces_) {
      for (std::size_t c = 0; c < workplace.votes.size(); ++c) {
        result.votes[c].cast += workplace.votes[c];
        result.votes[c].outside_view -= workplace.votes[c];
      }
    }
    return result;
  }

  ReferenceView view_;
  int planes_;
  SpaceSweepOptions options_;
  SweepRequest request_;
  VotingKernel kernel_;
  int cameras_;
  FusionInputs inputs_;
  std::vector<cv::Rect> tiles_;
  BinnedRays rays_;
  WholePlanes whole_planes_;
  Found fused_;
  std::vector<Found> alone_;  // by camera, where asked for
  tbb::enumerable_thread_specific<Workplace> workplaces_{[this] { return newWorkplace(); }};
};

}  // namespace

SweepResult sweepTiles(std::vector<CameraRays> cameras, const ReferenceView& view,
                       const DepthPlanes& planes, const SpaceSweepOptions& options,
                       const SweepRequest& request) {
  tbb::task_arena arena(options.threadsOrCores());
  return arena.execute(
      [&] { return TiledSweep(std::move(cameras), view, planes, options, request).run(); });
}

}  // namespace efm
