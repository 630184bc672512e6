// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/tiled_sweep.h"

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/partitioner.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <opencv2/core.hpp>
#include <utility>

#include "mapping/binned_rays.h"
#include "mapping/plane_group.h"
#include "mapping/tile_rays.h"
#include "mapping/tile_voter.h"
#include "mapping/view_tiles.h"

namespace efm {
namespace {

/// What one thread needs, kept from tile to tile.
struct Workplace {
  TileVoter voter;
  std::vector<TileRays> rays;        // by camera and slot
  std::vector<std::uint64_t> votes;  // by camera
};

/// The planes of a group as a whole, where somebody wants to see them.
class GroupPlanes {
 public:
  GroupPlanes(DsiSink* sink, const ReferenceView& view) : sink_(sink), view_(view) {}

  void begin(const PlaneGroup& group) {
    first_ = group.begin;
    const int count = sink_ == nullptr ? 0 : group.end - group.begin;
    planes_.resize(static_cast<std::size_t>(count));
    for (cv::Mat1f& plane : planes_) plane.create(view_.height, view_.width);
  }
  void take(int plane, const cv::Rect& tile, const PlaneValues& values) {
    if (sink_ == nullptr) return;
    writeTo(planes_[static_cast<std::size_t>(plane - first_)](tile), values);
  }
  void end() {
    for (std::size_t i = 0; i < planes_.size(); ++i) {
      sink_->takePlane(first_ + static_cast<int>(i), planes_[i][0]);
    }
  }

 private:
  DsiSink* sink_;
  ReferenceView view_;
  int first_ = 0;
  std::vector<cv::Mat1f> planes_;
};

class TiledSweep {
 public:
  TiledSweep(std::vector<CameraRays> cameras, const ReferenceView& view, const DepthPlanes& planes,
             const SpaceSweepOptions& options, const SweepRequest& request)
      : view_(view),
        options_(options),
        request_(request),
        kernel_(options.kernelOrFastest()),
        cameras_(static_cast<int>(cameras.size())),
        inputs_(fusionInputs(cameras, request.groups)),
        tiles_(tilesOf(view, TileVoter::kTilePixels)),
        rays_(std::move(cameras), view, planes),
        whole_planes_(request.sink, view) {
    for (const cv::Rect& tile : tiles_) {
      const RunningPeaks none(static_cast<std::size_t>(tile.area()), kernel_);
      peaks_.push_back(none);
      if (request.camera_peaks) camera_peaks_.emplace_back(cameras_, none);
    }
  }

  /// On the threads of the task arena that it is called in.
  SweepResult run() {
    for (const PlaneGroup& group : rays_.groupPlanes()) {
      rays_.moveTo(group);
      whole_planes_.begin(group);
      tbb::parallel_for(
          tbb::blocked_range<std::size_t>(0, tiles_.size()),
          [&](const tbb::blocked_range<std::size_t>& range) {
            Workplace& workplace = workplaces_.local();
            for (std::size_t t = range.begin(); t < range.end(); ++t) {
              sweepTile(t, group, workplace);
            }
          },
          tbb::simple_partitioner());
      whole_planes_.end();
    }
    rays_.release();  // before there are images
    return result();
  }

 private:
  Workplace newWorkplace() const {
    return {TileVoter(kernels::tileFunctions(kernel_)), std::vector<TileRays>(rays_.inputs()),
            std::vector<std::uint64_t>(static_cast<std::size_t>(cameras_))};
  }

  /// All planes of a group on one tile.
  void sweepTile(std::size_t t, const PlaneGroup& group, Workplace& workplace) {
    const cv::Rect& tile = tiles_[t];
    workplace.voter.moveTo(tile, view_);
    for (std::size_t i = 0; i < rays_.inputs(); ++i) {
      rays_.gather(i, workplace.voter, workplace.rays[i]);
    }
    PlaneFusion fusion(
        options_.fusion, inputs_, static_cast<std::size_t>(tile.area()),
        request_.camera_peaks ? PlaneFusion::Keep::kCameras : PlaneFusion::Keep::kFusedOnly,
        kernel_);
    for (int plane = group.begin; plane < group.end; ++plane) {
      const PlaneValues& fused = fusion.fuse([&](int camera, int slot, PlaneValues& density) {
        workplace.votes[static_cast<std::size_t>(camera)] += workplace.voter.vote(
            workplace.rays[rays_.inputOf(camera, slot)], rays_.fromHome(plane), density.data());
      });
      peaks_[t].take(plane, fused);
      if (request_.camera_peaks) {
        for (int c = 0; c < cameras_; ++c) {
          camera_peaks_[t][static_cast<std::size_t>(c)].take(plane, fusion.ofCamera(c));
        }
      }
      whole_planes_.take(plane, tile, fused);
    }
  }

  SweepResult result() {
    SweepResult result{unwrittenPeaks(view_), {}, rays_.notCast()};
    if (request_.camera_peaks) {
      for (int c = 0; c < cameras_; ++c) result.camera_peaks.push_back(unwrittenPeaks(view_));
    }
    for (std::size_t t = 0; t < tiles_.size(); ++t) {
      peaks_[t].writeTo(result.peaks, tiles_[t]);
      for (std::size_t c = 0; c < result.camera_peaks.size(); ++c) {
        camera_peaks_[t][c].writeTo(result.camera_peaks[c], tiles_[t]);
      }
    }
    for (const Workplace& workplace : workplaces_) {
      for (std::size_t c = 0; c < workplace.votes.size(); ++c) {
        result.votes[c].cast += workplace.votes[c];
        result.votes[c].outside_view -= workplace.votes[c];
      }
    }
    return result;
  }

  ReferenceView view_;
  SpaceSweepOptions options_;
  SweepRequest request_;
  VotingKernel kernel_;
  int cameras_;
  FusionInputs inputs_;
  std::vector<cv::Rect> tiles_;
  BinnedRays rays_;
  GroupPlanes whole_planes_;
  std::vector<RunningPeaks> peaks_;                      // by tile
  std::vector<std::vector<RunningPeaks>> camera_peaks_;  // by tile and camera
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
