// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/kernels/self_test.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <string>
#include <vector>

#include "mapping/dsi/voting_kernel.h"

namespace efm::kernels {
namespace {

TEST(SelfTest, EveryKernelOfThisProcessorPasses) {
  for (const VotingKernel kernel : availableKernels()) {
    for (const std::uint32_t seed : {1U, 2U, 3U}) {
      EXPECT_THAT(selfTest(TestedFunctions::of(kernel), seed), ::testing::IsEmpty())
          << nameOf(kernel) << ", " << seed;
    }
  }
}

const TestedFunctions& good() {
  static const TestedFunctions kGood = TestedFunctions::of(fastestKernel());
  return kGood;
}

std::size_t gather(const BinnedRay* bin, std::size_t count, const GatherRequest& request,
                   const MovingRays& rays) {
  return good().tile.gather(bin, count, request, rays);
}
FullCell* vote(const MovingRays& rays, float to_plane, const CellWindow& window, FullCell* full) {
  return good().tile.vote(rays, to_plane, window, full);
}
std::uint64_t all(std::uint64_t* cells, int width, int height, float* values) {
  return good().resolve.all(cells, width, height, values);
}
constexpr std::uint64_t kTopBit = 0x8000;

/// A function with one fault, and what the self-test says of it.
struct Fault {
  const char* name;
  void (*put)(TestedFunctions& functions);
  std::vector<std::string> said;
};

constexpr char kFull[] = "vote: the full cells";
constexpr char kSums[] = "vote: the sums of the cells";
constexpr char kCleared[] = "resolve: the cells are cleared";
constexpr char kWeights[] = "resolve: the weights of two inputs";
constexpr char kMean[] = "resolve: the mean of two inputs";
constexpr char kPeaks[] = "peaks: the largest values";
constexpr char kColumns[] = "columns and ranks: the sums";

/// The mean of two inputs with a fault, by `Steps`: a member of ResolveFunctions.
template <ResolveFunctions::AddPair ResolveFunctions::*Steps>
std::vector<Fault> faultsOfMean(const char* name) {
  return {
      {name,
       [](TestedFunctions& functions) {
         functions.resolve.*Steps = [](const CellBuffer& first, const CellBuffer& second, int width,
                                       int height, float* sum, std::uint64_t units[2]) {
           const int pixels = (good().resolve.*Steps)(first, second, width, height, sum, units);
           ++units[1];
           return pixels;
         };
       },
       {kWeights}},
      {name,
       [](TestedFunctions& functions) {
         functions.resolve.*Steps = [](const CellBuffer& first, const CellBuffer& second, int width,
                                       int height, float* sum, std::uint64_t units[2]) {
           const int pixels = (good().resolve.*Steps)(first, second, width, height, sum, units);
           sum[width * height - 1] += 1;
           return pixels;
         };
       },
       {kMean}}};
}

std::vector<Fault> faults() {
  std::vector<Fault> faults = {
      {"the last ray is not gathered",
       [](TestedFunctions& functions) {
         functions.tile.gather = [](const BinnedRay* bin, std::size_t count,
                                    const GatherRequest& request, const MovingRays& rays) {
           return gather(bin, count, request, rays) - 1;
         };
       },
       {"gather: the number of rays near a tile"}},
      {"a ray is gathered elsewhere",
       [](TestedFunctions& functions) {
         functions.tile.gather = [](const BinnedRay* bin, std::size_t count,
                                    const GatherRequest& request, const MovingRays& rays) {
           const std::size_t size = gather(bin, count, request, rays);
           rays.dy[size - 1] += 1;
           return size;
         };
       },
       {"gather: the rays near a tile"}},
      {"the last rays do not vote",
       [](TestedFunctions& functions) {
         functions.tile.vote = [](const MovingRays& rays, float to_plane, const CellWindow& window,
                                  FullCell* full) {
           const MovingRays fewer{rays.x, rays.y, rays.dx, rays.dy, rays.size - kRayPadding};
           return vote(fewer, to_plane, window, full);
         };
       },
       {kSums, "resolve: the sum of weights", "resolve: the densities"}},
      {"a full cell is listed where none is",
       [](TestedFunctions& functions) {
         functions.tile.vote = [](const MovingRays& rays, float to_plane, const CellWindow& window,
                                  FullCell* full) {
           full = vote(rays, to_plane, window, full);
           *full++ = {};
           return full;
         };
       },
       {kFull}},
      {"a full cell is elsewhere",
       [](TestedFunctions& functions) {
         functions.tile.vote = [](const MovingRays& rays, float to_plane, const CellWindow& window,
                                  FullCell* full) {
           FullCell* const end = vote(rays, to_plane, window, full);
           for (FullCell* cell = full; cell != end; ++cell) cell->index = kTileCells * kTileCells;
           return end;
         };
       },
       {kFull, kSums}},
      {"the sums of a full cell are wrong",
       [](TestedFunctions& functions) {
         functions.tile.vote = [](const MovingRays& rays, float to_plane, const CellWindow& window,
                                  FullCell* full) {
           FullCell* const end = vote(rays, to_plane, window, full);
           if (end != full) ++full->sums;
           return end;
         };
       },
       {kSums}},
      {"full cells stay in the tile",  // the sums are right
       [](TestedFunctions& functions) {
         functions.tile.vote = [](const MovingRays& rays, float to_plane, const CellWindow& window,
                                  FullCell* full) {
           FullCell* end = vote(rays, to_plane, window, full);
           if (end == full) return end;
           std::uint64_t& cell = window.tile.cells[(end - 1)->index];
           if ((cell & kTopBit) != 0 || ((end - 1)->sums & kTopBit) == 0) return end;
           cell += kTopBit;
           (end - 1)->sums -= kTopBit;
           return end;
         };
       },
       {kFull}},
      {"the sum of weights",
       [](TestedFunctions& functions) {
         functions.resolve.all = [](std::uint64_t* cells, int width, int height, float* values) {
           return all(cells, width, height, values) + 1;
         };
       },
       {"resolve: the sum of weights", kWeights}},
      {"the last cell is not cleared",
       [](TestedFunctions& functions) {
         functions.resolve.all = [](std::uint64_t* cells, int width, int height, float* values) {
           const std::uint64_t units = all(cells, width, height, values);
           cells[kTileCells * (kTileCells + 2) - 1] = 1;
           return units;
         };
       },
       {kCleared}},
      {"the last density",
       [](TestedFunctions& functions) {
         functions.resolve.all = [](std::uint64_t* cells, int width, int height, float* values) {
           const std::uint64_t units = all(cells, width, height, values);
           values[width * height - 1] += 0.02F;
           return units;
         };
       },
       {"resolve: the densities", kMean}},
      {"of equal peaks the last",
       [](TestedFunctions& functions) {
         functions.peaks.add = [](const PeakArrays& peaks, std::int32_t plane, const float* values,
                                  std::size_t n) {
           const std::vector<float> best(peaks.best, peaks.best + n);
           good().peaks.add(peaks, plane, values, n);
           if (values[n - 1] == best[n - 1]) peaks.plane[n - 1] = plane;
         };
       },
       {kPeaks}},
      {"the last plane of a column",
       [](TestedFunctions& functions) {
         functions.columns.add = [](float* sum, const std::uint8_t* roots, std::size_t planes,
                                    float unit) {
           good().columns.add(sum, roots, planes, unit);
           sum[planes - 1] += 1;
         };
       },
       {kColumns}},
      {"the weight below the last position",
       [](TestedFunctions& functions) {
         functions.ranks.add = [](float* below, const float* positions, const float* weights,
                                  std::size_t n) {
           good().ranks.add(below, positions, weights, n);
           below[n - 1] += 1;
         };
       },
       {kColumns}},
  };
  for (const std::vector<Fault>& more :
       {faultsOfMean<&ResolveFunctions::addMin>("minimum"),
        faultsOfMean<&ResolveFunctions::addHarmonic>("harmonic mean"),
        faultsOfMean<&ResolveFunctions::addGeometric>("geometric mean")}) {
    faults.insert(faults.end(), more.begin(), more.end());
  }
  return faults;
}

TEST(SelfTest, FindsEachFault) {
  if (fastestKernel() == VotingKernel::kPlain) GTEST_SKIP() << "the plain kernel has no tiles";
  for (const Fault& fault : faults()) {
    TestedFunctions functions = good();
    fault.put(functions);
    EXPECT_THAT(selfTest(functions), ::testing::UnorderedElementsAreArray(fault.said))
        << fault.name;
  }
}

}  // namespace
}  // namespace efm::kernels
