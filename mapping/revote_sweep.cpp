// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/revote_sweep.h"

#include <tbb/task_arena.h>

#include <cassert>
#include <opencv2/core/types.hpp>
#include <utility>

#include "mapping/plane_sweep.h"
#include "mapping/second_votes.h"
#include "mapping/strip_sweep.h"

namespace efm {
namespace {

/// The groups of one polarity.
std::vector<CameraRays> takePolarity(std::vector<CameraRays>& inputs, const BundleOrder& order,
                                     int polarity) {
  std::vector<CameraRays> taken(inputs.size());
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    for (int group = polarity; group < order.groups; group += order.polarities) {
      for (int slot = 0; slot < order.slots; ++slot) {
        taken[i].push_back(
            std::move(inputs[i][static_cast<std::size_t>(group * order.slots + slot)]));
      }
    }
  }
  return taken;
}

}  // namespace

SweepResult sweepTwice(SplitRays rays, int polarities, const ReferenceView& view,
                       const DepthPlanes& planes, const SpaceSweepOptions& options,
                       const VoteSharing& sharing, const SweepRequest& request) {
  assert(rays.groups % polarities == 0);
  FusionInputs inputs = fusionInputs(rays.inputs, rays.groups);
  const BundleOrder order{rays.groups, inputs.slots, polarities};
  std::vector<PriorDsi> priors;
  for (int polarity = 0; polarity < polarities; ++polarity) priors.emplace_back(view, planes);
  tbb::task_arena arena(options.threadsOrCores());
  SecondVotes second(rays.inputs, order, view, planes, priors, sharing);
  std::vector<VoteCounts> votes(rays.inputs.size());
  for (int polarity = 0; polarity < polarities; ++polarity) {
    SweepRequest first;
    first.tile_sink = &priors[static_cast<std::size_t>(polarity)];
    first.groups = rays.groups / polarities;
    const SweepResult swept =
        SpaceSweep(options).run(takePolarity(rays.inputs, order, polarity), view, planes, first);
    for (std::size_t i = 0; i < votes.size(); ++i) votes[i] += swept.votes[i];
  }
  arena.execute([&] { second.weigh(); });

  inputs.groups = 1;
  SweepResult result;
  if (second.keepsVotes() && request.sink == nullptr) {
    result = arena.execute(
        [&] { return sweepStrips(second, inputs, view, planes.size(), options, request); });
  } else {
    const cv::Range rows(0, view.height);
    const auto voter = [&](int input, int slot, int plane, PlaneValues& density) {
      second.vote(input, slot, plane, rows, density);
      return VoteCounts{};
    };
    result = sweepPlanes(voter, inputs, view, planes, options, request);
  }
  result.votes = std::move(votes);
  return result;
}

}  // namespace efm
