// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/sweep/tile_accumulator.h"

#include <algorithm>
#include <cassert>

#include "mapping/kernels/fusion.h"

namespace efm {
namespace {

constexpr int kStride = kernels::kTileCells;

}  // namespace

TileAccumulator::TileAccumulator(VotingKernel kernel)
    : scatter_(kernels::tileFunctions(kernel)),
      resolve_(kernels::resolveFunctions(kernel)),
      // Vectors read past the last row. A ray outside the view adds zero to a cell up to a tile
      // from the first cell inside.
      cells_(static_cast<std::size_t>((kStride + 2) * kStride), 0),
      dirty_(kernels::kLines, 0) {}

void TileAccumulator::moveTo(const TileCells& tile) {
  assert(!pending_);
  tile_ = tile;
}

void TileAccumulator::vote(TileRays& rays, double from_pixels, bool marks) {
  assert(!pending_);
  pending_ = true;
  marked_ = marks;
  full_cells_ = 0;
  if (rays.size() > 0 && !tile_.in_view.empty()) {
    full_.resize(std::max(full_.size(), rays.size() / kernels::kVotesPerCell + 1));
    const cv::Point first = tile_.in_view.tl() - tile_.all.tl();
    const cv::Point corner = tile_.in_view.tl() - tile_.origin;
    const kernels::CellWindow window{buffer(),
                                     static_cast<std::uint32_t>(first.y * kStride + first.x),
                                     corner.x,
                                     corner.y,
                                     static_cast<std::uint32_t>(tile_.in_view.width),
                                     static_cast<std::uint32_t>(tile_.in_view.height)};
    const kernels::FullCell* end =
        scatter_.vote(rays.view(), static_cast<float>(from_pixels), window, full_.data());
    full_cells_ = static_cast<std::size_t>(end - full_.data());
  }
}

std::uint64_t TileAccumulator::resolve(float* density) {
  pending_ = false;
  const std::uint64_t units =
      resolve_.all(cells_.data(), tile_.tile.width, tile_.tile.height, density);
  return units + addFullCells(density);
}

/// Adds the weights of full cells. @return those of pixels in the tile, in units.
std::uint64_t TileAccumulator::addFullCells(float* density) const {
  constexpr float kUnit = 1.0F / (1 << kernels::kWeightBits);
  const cv::Rect& tile = tile_.tile;
  std::uint64_t units = 0;
  for (std::size_t i = 0; i < full_cells_; ++i) {
    const kernels::CellSums sums = kernels::unpack(full_[i].sums);
    // Of the pixel to the lower right.
    const int x = static_cast<int>(full_[i].index) % kStride;
    const int y = static_cast<int>(full_[i].index) / kStride;
    const auto add = [&](int column, int row, std::uint32_t weight) {
      if (column < 0 || row < 0 || column >= tile.width || row >= tile.height) return;
      density[row * tile.width + column] += kUnit * static_cast<float>(weight);
      units += weight;
    };
    add(x - 1, y - 1, sums.upper_left);
    add(x, y - 1, sums.upper_right);
    add(x - 1, y, sums.lower_left);
    add(x, y, sums.lower_right);
  }
  return units;
}

int TileAccumulator::addPair(FusionRule rule, TileAccumulator& first, TileAccumulator& second,
                             float* sum, std::uint64_t units[2]) {
  const cv::Rect& tile = first.tile_.tile;
  assert(first.pending_ && second.pending_ && first.marked_ == second.marked_ &&
         tile == second.tile_.tile);
  if (first.full_cells_ + second.full_cells_ == 0) {
    first.pending_ = second.pending_ = false;
    const kernels::ResolveFunctions& resolve = first.resolve_;
    const auto add_pair = rule == FusionRule::kMin        ? resolve.addMin
                          : rule == FusionRule::kHarmonic ? resolve.addHarmonic
                                                          : resolve.addGeometric;
    return add_pair(first.buffer(), second.buffer(), tile.width, tile.height, sum, units);
  }
  const auto pixels = static_cast<std::size_t>(tile.area());
  for (TileAccumulator* input : {&first, &second}) {
    input->density_.resize(pixels);
    units[input == &first ? 0 : 1] += input->resolve(input->density_.data());
  }
  stepsOf(rule).pair(first.density_.data(), second.density_.data(), pixels);
  for (std::size_t i = 0; i < pixels; ++i) sum[i] += first.density_[i];
  return tile.area();
}

}  // namespace efm
