// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/strip_sweep.h"

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/partitioner.h>

#include <algorithm>
#include <cassert>
#include <opencv2/core.hpp>
#include <vector>

#include "mapping/plane_fusion.h"
#include "mapping/tile_finds.h"

namespace efm {
namespace {

class StripSweep {
 public:
  StripSweep(SecondVotes& votes, const FusionInputs& inputs, const ReferenceView& view, int planes,
             const SpaceSweepOptions& options, const SweepRequest& request)
      : votes_(votes),
        inputs_(inputs),
        view_(view),
        planes_(planes),
        options_(options),
        request_(request),
        strips_((view.height - 1) / kRows + 1),
        fused_(view, static_cast<std::size_t>(strips_)) {
    const std::size_t alone = request.camera_peaks ? static_cast<std::size_t>(inputs.cameras) : 0;
    for (std::size_t c = 0; c < alone; ++c) {
      alone_.emplace_back(view, static_cast<std::size_t>(strips_));
    }
  }

  SweepResult run() {
    tbb::parallel_for(
        tbb::blocked_range<int>(0, strips_),
        [&](const tbb::blocked_range<int>& range) {
          Finds& finds = finds_.local();
          for (int strip = range.begin(); strip < range.end(); ++strip) sweep(strip, finds);
        },
        tbb::simple_partitioner());
    SweepResult result{fused_.whole(planes_, request_.ray_window > 0), {}, {}};
    for (Found& camera : alone_)
      result.cameras.push_back(camera.whole(planes_, request_.ray_window > 0));
    return result;
  }

 private:
  static constexpr int kRows = 32;

  /// Kept from strip to strip.
  struct Finds {
    TileFinds fused;
    std::vector<TileFinds> cameras;  // where they are asked for
  };

  Finds newFinds() const {
    const TileFinds finds(planes_, request_.ray_window,
                          static_cast<std::size_t>(kRows) * static_cast<std::size_t>(view_.width));
    return {finds, std::vector<TileFinds>(alone_.size(), finds)};
  }

  void sweep(int strip, Finds& finds) {
    const VotingKernel kernel = options_.kernelOrFastest();
    const cv::Range rows(strip * kRows, std::min(view_.height, (strip + 1) * kRows));
    const cv::Rect tile(0, rows.start, view_.width, rows.size());
    finds.fused.moveTo(tile, kernel);
    for (TileFinds& camera : finds.cameras) camera.moveTo(tile, kernel);
    PlaneFusion fusion(
        options_.fusion, inputs_, static_cast<std::size_t>(tile.area()),
        request_.camera_peaks ? PlaneFusion::Keep::kCameras : PlaneFusion::Keep::kFusedOnly,
        kernel);
    for (int plane = 0; plane < planes_; ++plane) {
      const PlaneValues& fused = fusion.fuse([&](int input, int slot, PlaneValues& density) {
        votes_.vote(input, slot, plane, rows, density);
      });
      finds.fused.take(plane, fused);
      for (std::size_t c = 0; c < finds.cameras.size(); ++c) {
        finds.cameras[c].take(plane, fusion.ofCamera(static_cast<int>(c)));
      }
      if (request_.tile_sink != nullptr) request_.tile_sink->takeTile(plane, tile, fused);
    }
    const auto s = static_cast<std::size_t>(strip);
    finds.fused.writeTo(fused_.peaks, fused_.rays[s]);
    for (std::size_t c = 0; c < alone_.size(); ++c) {
      finds.cameras[c].writeTo(alone_[c].peaks, alone_[c].rays[s]);
    }
  }

  SecondVotes& votes_;
  FusionInputs inputs_;
  ReferenceView view_;
  int planes_;
  SpaceSweepOptions options_;
  SweepRequest request_;
  int strips_;
  Found fused_;
  std::vector<Found> alone_;  // by camera, where asked for
  tbb::enumerable_thread_specific<Finds> finds_{[this] { return newFinds(); }};
};

}  // namespace

SweepResult sweepStrips(SecondVotes& votes, const FusionInputs& inputs, const ReferenceView& view,
                        int planes, const SpaceSweepOptions& options, const SweepRequest& request) {
  assert(votes.keepsVotes() && request.sink == nullptr);
  return StripSweep(votes, inputs, view, planes, options, request).run();
}

}  // namespace efm
