// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/sweep/space_sweep.h"

#include <tbb/global_control.h>

#include <algorithm>
#include <cassert>
#include <string>
#include <utility>

#include "mapping/base/option_check.h"
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
  // The host of this process limits the number of threads, also a requested one.
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

SweepResult sweepSpace(std::vector<CameraRays> cameras, const DsiGrid& grid,
                       const SpaceSweepOptions& options, const SweepRequest& request) {
  options.validate();
  return options.kernelOrFastest() == VotingKernel::kPlain
             ? sweepPlanes(cameras, grid, options, request)
             : sweepTiles(std::move(cameras), grid, options, request);
}

}  // namespace efm
