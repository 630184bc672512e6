// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/sweep/space_sweep.h"

#include <tbb/global_control.h>

#include <algorithm>
#include <cassert>
#include <string>
#include <utility>

#include "mapping/options/option_check.h"
#include "mapping/sweep/plane_sweep.h"
#include "mapping/sweep/tiled_sweep.h"

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
  constexpr int kMaxThreads = 1024;
  requireOption(!threads || (*threads >= 1 && *threads <= kMaxThreads), "threads",
                threads.value_or(0), "1 to 1024");
  requireOption(isAvailable(kernelOrFastest()), "kernel", nameOf(kernelOrFastest()),
                "one that this build and processor have: " + namesOfAvailableKernels());
}

int SpaceSweepOptions::threadsOrCores() const {
  // What the host of this process allows is the limit, also for what was asked for.
  const auto allowed = static_cast<int>(
      tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
  return std::max(1, std::min(threads.value_or(allowed), allowed));
}

VotingKernel SpaceSweepOptions::kernelOrFastest() const { return kernel.value_or(fastestKernel()); }

FusionInputs fusionInputs(const std::vector<CameraRays>& cameras, int groups) {
  const auto slots = static_cast<int>(cameras.front().size());
  assert(groups >= 1 && slots % groups == 0);
  return {static_cast<int>(cameras.size()), slots / groups, groups};
}

SpaceSweep::SpaceSweep(const SpaceSweepOptions& options) : options_(options) {
  options_.validate();
}

SweepResult SpaceSweep::run(std::vector<CameraRays> cameras, const ReferenceView& view,
                            const DepthPlanes& planes, const SweepRequest& request) const {
  return options_.kernelOrFastest() == VotingKernel::kPlain
             ? sweepPlanes(cameras, view, planes, options_, request)
             : sweepTiles(std::move(cameras), view, planes, options_, request);
}

}  // namespace efm
