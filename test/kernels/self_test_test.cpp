// SPDX-License-Identifier: BSD-3-Clause
#include "test/kernels/self_test.h"

#include <gmock/gmock.h>

#include <functional>

#include "mapping/dsi/dsi_grid.h"

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

/// What a fault changes in the calls of a kernel's functions.
struct Fault {
  const char* name = "";
  std::vector<std::string> said;  ///< By the self-test.
  std::function<void(MovingRays& rays)> before_vote = [](auto&) {};
  /// @param end one past the last full cell.
  std::function<void(std::uint64_t* cells, FullCell* full, FullCell*& end)> after_vote =
      [](auto*, auto*, auto*&) {};
  std::function<void(const MovingRays& rays, std::size_t& size)> after_gather = [](auto&, auto&) {};
  std::function<void(std::uint64_t* cells, float& last, std::uint64_t& units)> after_resolve =
      [](auto*, auto&, auto&) {};
  std::function<void(float& last, std::uint64_t units[2])> after_mean = [](auto&, auto*) {};
  std::function<void(float value, float best, std::int32_t plane, std::int32_t& last)> after_peak =
      [](auto, auto, auto, auto&) {};
  float to_column = 0, to_rank = 0;  ///< Added to the last number.
};

const TestedFunctions& good() {
  static const TestedFunctions kGood = TestedFunctions::of(fastestKernel());
  return kGood;
}

Fault fault;  // of the functions below

template <ResolveFunctions::AddPair ResolveFunctions::*mean>
int meanWithFault(const CellBuffer& first, const CellBuffer& second, int width, int height,
                  float* sum, std::uint64_t units[2]) {
  const int pixels = (good().resolve.*mean)(first, second, width, height, sum, units);
  fault.after_mean(sum[width * height - 1], units);
  return pixels;
}

TestedFunctions withFault() {
  TestedFunctions functions;
  functions.tile.gather = [](const BinnedRay* bin, std::size_t count, const GatherRequest& request,
                             const MovingRays& rays) {
    std::size_t size = good().tile.gather(bin, count, request, rays);
    fault.after_gather(rays, size);
    return size;
  };
  functions.tile.vote = [](const MovingRays& rays, float to_plane, const CellWindow& window,
                           FullCell* full) {
    MovingRays changed = rays;
    fault.before_vote(changed);
    FullCell* end = good().tile.vote(changed, to_plane, window, full);
    fault.after_vote(window.tile.cells, full, end);
    return end;
  };
  functions.resolve.all = [](std::uint64_t* cells, int width, int height, float* values) {
    std::uint64_t units = good().resolve.all(cells, width, height, values);
    fault.after_resolve(cells, values[width * height - 1], units);
    return units;
  };
  functions.resolve.addMin = meanWithFault<&ResolveFunctions::addMin>;
  functions.resolve.addHarmonic = meanWithFault<&ResolveFunctions::addHarmonic>;
  functions.resolve.addGeometric = meanWithFault<&ResolveFunctions::addGeometric>;
  functions.peaks.add = [](const PeakArrays& peaks, std::int32_t plane, const float* values,
                           std::size_t n) {
    const float best = peaks.best[n - 1];
    good().peaks.add(peaks, plane, values, n);
    fault.after_peak(values[n - 1], best, plane, peaks.plane[n - 1]);
  };
  functions.columns.add = [](float* sum, const std::uint8_t* roots, std::size_t n, float unit) {
    good().columns.add(sum, roots, n, unit);
    sum[n - 1] += fault.to_column;
  };
  functions.ranks.add = [](float* below, const float* positions, const float* weights,
                           std::size_t n) {
    good().ranks.add(below, positions, weights, n);
    below[n - 1] += fault.to_rank;
  };
  return functions;
}

std::vector<Fault> allFaults() {
  const char* const full_cells = "vote: the full cells";
  const char* const sums = "vote: the sums of the cells";
  const char* const weights = "resolve: the sum of weights";
  const char* const densities = "resolve: the densities";
  const char* const of_two = "resolve: the weights of two inputs";
  const char* const mean = "resolve: the mean of two inputs";
  std::vector<Fault> faults;
  const auto add = [&](const char* name, const std::vector<std::string>& said) -> Fault& {
    faults.push_back({name, said});
    return faults.back();
  };
  add("none", {});
  add("the last ray is not gathered", {"gather: the number of rays near a tile"}).after_gather =
      [](auto&, std::size_t& size) { --size; };
  add("a ray is gathered elsewhere", {"gather: the rays near a tile"}).after_gather =
      [](const MovingRays& rays, std::size_t size) { rays.dy[size - 1] += 1; };
  add("the last rays do not vote", {sums, weights, densities}).before_vote = [](MovingRays& rays) {
    rays.size -= kRayPadding;
  };
  add("a full cell is listed where none is", {full_cells}).after_vote =
      [](auto*, auto*, FullCell*& end) { *end++ = {}; };
  add("full cells are elsewhere", {full_cells, sums}).after_vote = [](auto*, FullCell* full,
                                                                      FullCell* end) {
    for (; full != end; ++full) full->index = kTileCells * kTileCells;
  };
  add("the sums of a full cell are wrong", {sums}).after_vote =
      [](auto*, FullCell* full, FullCell* end) { full->sums += full == end ? 0 : 1; };
  add("a full cell stays in the tile", {full_cells}).after_vote =
      [](std::uint64_t* cells, FullCell* full, FullCell* end) {
        constexpr std::uint64_t kTopBit = 0x8000;
        if (full == end || ((end - 1)->sums & kTopBit) == 0) return;
        cells[(end - 1)->index] += kTopBit;  // the sums are right
        (end - 1)->sums -= kTopBit;
      };
  add("one weight too many", {weights, of_two}).after_resolve =
      [](auto*, auto&, std::uint64_t& units) { ++units; };
  add("the last cell is not cleared", {"resolve: the cells are cleared"}).after_resolve =
      [](std::uint64_t* cells, auto&, auto&) { cells[kTileCells * (kTileCells + 2) - 1] = 1; };
  add("the last density", {densities, mean}).after_resolve = [](auto*, float& last, auto&) {
    last += 0.02F;
  };
  add("a weight of the second input", {of_two}).after_mean = [](auto&, std::uint64_t units[2]) {
    ++units[1];
  };
  add("the last mean", {mean}).after_mean = [](float& last, auto*) { last += 1; };
  add("of equal peaks the last", {"peaks: the largest values"}).after_peak =
      [](float value, float best, std::int32_t plane, std::int32_t& last) {
        if (value == best) last = plane;
      };
  add("a column's last plane", {"columns and ranks: the sums"}).to_column = 1;
  add("the last rank", {"columns and ranks: the sums"}).to_rank = 1;
  return faults;
}

TEST(SelfTest, FindsEachFault) {
  if (fastestKernel() == VotingKernel::kPlain) GTEST_SKIP() << "the plain kernel has no tiles";
  for (const Fault& each : allFaults()) {
    fault = each;
    EXPECT_THAT(selfTest(withFault()), ::testing::UnorderedElementsAreArray(fault.said))
        << fault.name;
  }
}

}  // namespace
}  // namespace efm::kernels
