// SPDX-License-Identifier: BSD-3-Clause
#include "test/kernels/self_test.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <memory>
#include <random>

#include "mapping/kernels/tile_scatter.h"

namespace efm::kernels {
namespace {

constexpr std::size_t kMaxRays = 4096;
constexpr int kTilePixels = kTileCells - 1;
constexpr int kViewPixels = kTileCells + 1;  // cell (x, y) begins at pixel (x, y) of this view
constexpr float kUnit = 1 << kFractionBits;

/// Random multiples of 1/4096: sums of a few of them are exact in floats.
class RandomNumbers {
 public:
  explicit RandomNumbers(std::uint32_t seed) : random_(seed) {}

  /// Draws a multiple of 1/`parts` from `from` to below `to`.
  float operator()(int from, int to, int parts) {
    const auto steps = static_cast<std::uint32_t>((to - from) * parts);
    return static_cast<float>(from) +
           static_cast<float>(random_() % steps) / static_cast<float>(parts);
  }

 private:
  std::mt19937 random_;
};

/// The memory of a tile, aligned as the kernels require.
struct TileMemory {
  alignas(64) float x[kMaxRays + kRayPadding] = {};
  alignas(64) float y[kMaxRays + kRayPadding] = {};
  alignas(64) float dx[kMaxRays + kRayPadding] = {};
  alignas(64) float dy[kMaxRays + kRayPadding] = {};
  alignas(64) std::uint64_t cells[kTileCells * (kTileCells + 2)] = {};
  alignas(64) std::uint8_t dirty[2][kLines] = {};
  alignas(64) std::uint64_t others[kTileCells * (kTileCells + 2)] = {};
  FullCell full[kMaxRays / kVotesPerCell + 1];
  float density[kTilePixels * kTilePixels + kRayPadding] = {};
  float sum[kTilePixels * kTilePixels + kSumPadding] = {};
};

/// The sums of the weights of a cell's votes in 64 bits, for each of its four pixels.
struct CellTotal {
  std::uint64_t upper_left = 0, lower_left = 0, upper_right = 0, lower_right = 0;

  void add(const CellSums& sums) {
    upper_left += sums.upper_left;
    lower_left += sums.lower_left;
    upper_right += sums.upper_right;
    lower_right += sums.lower_right;
  }
  bool operator!=(const CellTotal& other) const {
    return upper_left != other.upper_left || lower_left != other.lower_left ||
           upper_right != other.upper_right || lower_right != other.lower_right;
  }
};

using Cells = std::vector<CellTotal>;

/// Compares the functions of one kernel for a tile with plain code.
class TileTest {
 public:
  TileTest(VotingKernel kernel, std::uint32_t seed)
      : scatter_(tileFunctions(kernel)), resolve_(resolveFunctions(kernel)), random_(seed) {}

  std::vector<std::string> run() {
    gather();
    for (const float to_plane : {0.0F, 0.5F, 1.0F}) {
      vote(to_plane);
      resolve(to_plane);
      resolvePairs(to_plane);
    }
    fillCells();
    return failures_;
  }

 private:
  void require(bool holds, const char* what) {
    if (holds) return;
    if (std::find(failures_.begin(), failures_.end(), what) == failures_.end()) {
      failures_.emplace_back(what);
    }
  }

  MovingRays rays() const { return {memory_->x, memory_->y, memory_->dx, memory_->dy, size_}; }

  void gather() {
    constexpr std::size_t kRays = 3001;  // not a multiple of a vector's lanes
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
    GatherRequest request;
    request.to_first = -0.25F;
    request.to_last = 0.75F;
    request.to_pixels = 0.5F;
    request.right = request.bottom = kTileCells;
    std::vector<BinnedRay> bin(kRays + kRayPadding);
    std::vector<std::size_t> near;
    for (std::size_t i = 0; i < kRays; ++i) {
      const bool on_border = i % 3 == 0;  // often exactly on the border
      const int parts = on_border ? 2 : 4096;
      const int shift_parts = on_border ? 1 : 1024;
      bin[i] = {random_(-8, 72, parts), random_(-8, 72, parts), random_(-4, 4, shift_parts),
                random_(-4, 4, shift_parts)};
      if (i % 97 == 0) bin[i].x = kNan;
      if (i % 101 == 0) bin[i].y = std::numeric_limits<float>::infinity();
      if (comesNear(bin[i].x, bin[i].dx, request) && comesNear(bin[i].y, bin[i].dy, request)) {
        near.push_back(i);
      }
    }
    size_ = scatter_.gather(bin.data(), kRays, request, rays());
    require(size_ == near.size(), "gather: the number of rays near a tile");
    size_ = std::min(size_, near.size());
    for (std::size_t i = 0; i < size_; ++i) {
      const BinnedRay& ray = bin[near[i]];
      require(memory_->x[i] == (ray.x + request.to_pixels * ray.dx) * kUnit &&
                  memory_->y[i] == (ray.y + request.to_pixels * ray.dy) * kUnit &&
                  memory_->dx[i] == ray.dx * kUnit && memory_->dy[i] == ray.dy * kUnit,
              "gather: the rays near a tile");
    }
  }

  static bool comesNear(float start, float shift, const GatherRequest& request) {
    const float first = start + request.to_first * shift;
    const float last = start + request.to_last * shift;
    return std::max(first, last) >= 0 && std::min(first, last) < kTileCells;
  }

  /// Votes with all rays. @return the number of full cells.
  std::size_t voteAll(float to_plane, std::uint8_t* marks = nullptr) {
    for (std::size_t i = size_; i < size_ + kRayPadding; ++i) {  // left of and above every cell
      memory_->x[i] = memory_->y[i] = -1;
      memory_->dx[i] = memory_->dy[i] = 0;
    }
    const CellWindow window{{memory_->cells, marks}, 0, 0, 0, kTileCells, kTileCells};
    return static_cast<std::size_t>(scatter_.vote(rays(), to_plane, window, memory_->full) -
                                    memory_->full);
  }

  /// Computes the cells with integer arithmetic, one ray after another.
  Cells plainCells(float to_plane) const {
    Cells cells(kTileCells * kTileCells);
    for (std::size_t i = 0; i < size_; ++i) {
      const float x = memory_->x[i] + to_plane * memory_->dx[i];
      const float y = memory_->y[i] + to_plane * memory_->dy[i];
      constexpr float kEnd = kTileCells * kUnit;
      if (!(x >= 0 && x < kEnd && y >= 0 && y < kEnd)) continue;
      const auto column = static_cast<std::uint32_t>(x);
      const auto row = static_cast<std::uint32_t>(y);
      constexpr std::uint32_t kMask = (1U << kFractionBits) - 1;
      // b and the weights of the pixels on the right are rounded to the unit of weights.
      constexpr std::uint32_t kVote = 1U << kWeightBits;
      constexpr std::uint32_t kHalf = 1U << (kFractionBits - 1);
      const std::uint32_t a = column & kMask;
      const std::uint32_t b = ((row & kMask) * kVote + kHalf) >> kFractionBits;
      const std::uint32_t upper_right = ((kVote - b) * a + kHalf) >> kFractionBits;
      const std::uint32_t lower_right = (b * a + kHalf) >> kFractionBits;
      const std::size_t cell =
          std::size_t{row >> kFractionBits} * kTileCells + (column >> kFractionBits);
      cells[cell].add({kVote - b - upper_right, b - lower_right, upper_right, lower_right});
    }
    return cells;
  }

  static constexpr std::uint64_t kTopBits = 0x8000'8000'8000'8000U;

  void requireCells(const Cells& expected, std::size_t full) {
    Cells found(expected.size());
    for (std::size_t i = 0; i < found.size(); ++i) {
      found[i].add(unpack(memory_->cells[i]));
      require((memory_->cells[i] & kTopBits) == 0, "vote: the full cells");
    }
    for (std::size_t i = 0; i < full; ++i) {
      const FullCell& cell = memory_->full[i];
      require(cell.index < found.size() && (cell.sums & kTopBits) != 0, "vote: the full cells");
      if (cell.index < found.size()) found[cell.index].add(unpack(cell.sums));
    }
    for (std::size_t i = 0; i < found.size(); ++i) {
      require(!(found[i] != expected[i]), "vote: the sums of the cells");
    }
  }

  void vote(float to_plane) {
    const std::size_t full = voteAll(to_plane);
    require(full == 0, "vote: the full cells");
    requireCells(plainCells(to_plane), full);
  }

  void requireEmptyCells() {
    require(std::all_of(std::begin(memory_->cells), std::end(memory_->cells),
                        [](std::uint64_t cell) { return cell == 0; }),
            "resolve: the cells are cleared");
  }

  /// Compares with the votes of the plain kernel on a whole plane.
  void resolve(float to_plane) {
    std::vector<float> plane(kViewPixels * kViewPixels, 0.0F);
    const MovingRays from = rays();
    for (std::size_t i = 0; i < size_; ++i) {
      const float x = (from.x[i] + to_plane * from.dx[i]) / kUnit;
      const float y = (from.y[i] + to_plane * from.dy[i]) / kUnit;
      voteBilinear({&x, &y}, {0, 1, 1, 0, 0}, {plane.data(), kViewPixels, kViewPixels});
    }
    std::uint64_t inside = 0;
    const Cells cells = plainCells(to_plane);
    for (int y = 0; y < kTileCells; ++y) {
      for (int x = 0; x < kTileCells; ++x) {
        const CellTotal& cell = cells[static_cast<std::size_t>(y * kTileCells + x)];
        const bool left = x > 0;
        const bool right = x < kTilePixels;
        if (y > 0) inside += left * cell.upper_left + right * cell.upper_right;
        if (y < kTilePixels) inside += left * cell.lower_left + right * cell.lower_right;
      }
    }
    const std::uint64_t units =
        resolve_.all(memory_->cells, kTilePixels, kTilePixels, memory_->density);
    require(units == inside, "resolve: the sum of weights");
    requireEmptyCells();
    for (int y = 0; y < kTilePixels; ++y) {
      for (int x = 0; x < kTilePixels; ++x) {
        // Weights are rounded to 1/1024, and about 30 votes are around a pixel.
        const float difference = memory_->density[y * kTilePixels + x] -
                                 plane[static_cast<std::size_t>((y + 1) * kViewPixels + x + 1)];
        require(std::abs(difference) <= 1e-2F, "resolve: the densities");
      }
    }
  }

  /// Checks that two inputs at once give the same bits as each input alone and the plain mean.
  void resolvePairs(float to_plane) {
    if (to_plane > 0) size_ = std::min<std::size_t>(size_, 200);  // few votes, with marks
    const FusionFunctions& plain = fusionFunctions();
    const struct {
      ResolveFunctions::AddPair add;
      const FusionSteps& steps;
    } rules[] = {{resolve_.addMin, plain.min},
                 {resolve_.addHarmonic, plain.harmonic},
                 {resolve_.addGeometric, plain.geometric}};
    constexpr std::size_t kPixels = kTilePixels * kTilePixels;
    for (const auto& [add, steps] : rules) {
      std::vector<float> first(kPixels);
      std::vector<float> second(kPixels);
      std::uint64_t units[2] = {};
      std::uint64_t expected[2] = {};
      voteAll(0);
      expected[0] = resolve_.all(memory_->cells, kTilePixels, kTilePixels, first.data());
      voteAll(to_plane);
      expected[1] = resolve_.all(memory_->cells, kTilePixels, kTilePixels, second.data());
      steps.pair(first.data(), second.data(), kPixels);
      std::uint8_t* marks[2] = {to_plane > 0 ? memory_->dirty[0] : nullptr,
                                to_plane > 0 ? memory_->dirty[1] : nullptr};
      voteAll(0, marks[0]);
      std::copy(std::begin(memory_->cells), std::end(memory_->cells), memory_->others);
      std::fill(std::begin(memory_->cells), std::end(memory_->cells), 0);
      voteAll(to_plane, marks[1]);
      std::fill(std::begin(memory_->sum), std::end(memory_->sum), 1.0F);
      add({memory_->others, marks[0]}, {memory_->cells, marks[1]}, kTilePixels, kTilePixels,
          memory_->sum, units);
      requireEmptyCells();
      require(std::equal(units, units + 2, expected), "resolve: the weights of two inputs");
      for (std::size_t i = 0; i < kPixels; ++i) {
        require(memory_->sum[i] == 1.0F + first[i], "resolve: the mean of two inputs");
      }
    }
  }

  /// Casts many votes into few cells.
  void fillCells() {
    size_ = kMaxRays - 3;
    for (std::size_t i = 0; i < size_; ++i) {
      memory_->x[i] = random_(61, 64, 4096) * kUnit;
      memory_->y[i] = random_(61, 64, 4096) * kUnit;
      memory_->dx[i] = memory_->dy[i] = 0;
    }
    const std::size_t full = voteAll(0);
    require(full > kMaxRays / kVotesPerCell / 8, "vote: the full cells");
    requireCells(plainCells(0), full);
  }

  const TileFunctions& scatter_;
  const ResolveFunctions& resolve_;
  RandomNumbers random_;
  std::unique_ptr<TileMemory> memory_ = std::make_unique<TileMemory>();
  std::size_t size_ = 0;  // number of gathered rays
  std::vector<std::string> failures_;
};

/// Returns the peaks of some planes with many equal values.
std::vector<float> peaksOf(VotingKernel kernel, std::uint32_t seed, std::size_t pixels) {
  RandomNumbers random(seed);
  std::vector<float> best(pixels, -1.0F);
  std::vector<std::int32_t> plane(pixels, -2);
  std::vector<float> before = best;
  std::vector<float> after = best;
  std::vector<float> previous = best;
  std::vector<float> values(pixels);
  for (std::int32_t p = 0; p < 12; ++p) {
    for (float& value : values) value = random(0, 2, 4);
    peakFunctions(kernel).add(
        {best.data(), plane.data(), before.data(), after.data(), previous.data()}, p, values.data(),
        pixels);
  }
  std::vector<float> all = best;
  all.insert(all.end(), plane.begin(), plane.end());
  all.insert(all.end(), before.begin(), before.end());
  all.insert(all.end(), after.begin(), after.end());
  return all;
}

/// Returns sums of columns and ranks of positions, computed from arrays with padding.
std::vector<float> sumsOf(VotingKernel kernel, std::uint32_t seed, std::size_t n) {
  RandomNumbers random(seed);
  std::vector<std::uint8_t> column(n + kColumnPadding);
  std::vector<float> positions(n + kRankPadding);
  std::vector<float> weights(n + kRankPadding);
  for (std::size_t i = 0; i < n; ++i) {
    column[i] = static_cast<std::uint8_t>(random(0, 255, 1));
    positions[i] = random(0, 20, 1);
    weights[i] = random(0, 3, 4096);
  }
  std::vector<float> sum(n + kColumnPadding, 0.1F);
  std::vector<float> below(n + kRankPadding, 0.0F);
  columnFunctions(kernel).add(sum.data(), column.data(), n, 0.3F);
  rankFunctions(kernel).add(below.data(), positions.data(), weights.data(), n);
  sum.resize(n);
  sum.insert(sum.end(), below.begin(), below.begin() + static_cast<std::ptrdiff_t>(n));
  return sum;
}

}  // namespace

std::vector<std::string> selfTest(VotingKernel kernel, std::uint32_t seed) {
  std::vector<std::string> failures;
  if (kernel != VotingKernel::kPlain)
    failures = TileTest(kernel, seed).run();  // the plain kernel has no tiles
  const auto differs = [&](const auto& results_of) {
    for (const std::size_t n : {1U, 15U, 16U, 101U}) {
      if (results_of(kernel, seed, n) != results_of(VotingKernel::kPlain, seed, n)) return true;
    }
    return false;
  };
  if (differs(peaksOf)) failures.emplace_back("peaks: the largest values");
  if (differs(sumsOf)) failures.emplace_back("columns and ranks: the sums");
  return failures;
}

}  // namespace efm::kernels
