// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/sweep/tile_accumulator.h"

#include <algorithm>
#include <cassert>

namespace efm {
namespace {

constexpr int kStride = kernels::kTileCells;
/// Up to this number of rays per pixel it pays to skip empty cells.
constexpr double kMaxSparseRays = 1;

}  // namespace

TileAccumulator::TileAccumulator(VotingKernel kernel)
    : scatter_(kernels::tileFunctions(kernel)),
      resolve_(kernels::resolveFunctions(kernel)),
      // Vectors read past the last row. A ray outside the view adds zero to a cell up to a tile
      // from the first cell inside.
      cells_(static_cast<std::size_t>((kStride + 2) * kStride), 0),
      dirty_(kernels::kDirtyFlags + kernels::kRayPadding, 0) {}

void TileAccumulator::moveTo(const TileCells& tile) {
  assert(!pending_);
  tile_ = tile;
}

void TileAccumulator::vote(TileRays& rays, double from_first) {
  assert(!pending_);
  pending_ = true;
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
        scatter_.vote(rays.view(), static_cast<float>(from_first), window, full_.data());
    full_cells_ = static_cast<std::size_t>(end - full_.data());
  }
  sparse_ =
      full_cells_ == 0 && static_cast<double>(rays.size()) <= kMaxSparseRays * tile_.tile.area();
}

std::uint64_t TileAccumulator::resolve(float* density) {
  pending_ = false;
  const std::uint64_t votes = resolve_.all(buffer(), tile_.tile.width, tile_.tile.height, density);
  return votes + addFullCells(density);
}

/// Adds the four weights of each full cell's votes, from their sums of 1, a, b and ab.
std::uint64_t TileAccumulator::addFullCells(float* density) const {
  constexpr float kFraction = 1.0F / (1 << kernels::kFractionBits);
  constexpr float kProduct = 1.0F / (1 << kernels::kProductBits);
  const cv::Rect& tile = tile_.tile;
  std::uint64_t votes = 0;
  for (std::size_t i = 0; i < full_cells_; ++i) {
    const kernels::CellSums sums = kernels::unpack(full_[i].sums);
    const float a = kFraction * static_cast<float>(sums.a);
    const float b = kFraction * static_cast<float>(sums.b);
    const float ab = kProduct * static_cast<float>(sums.ab);
    const auto number = static_cast<float>(sums.votes);
    // Of the pixel to the lower right.
    const int x = static_cast<int>(full_[i].index) % kStride;
    const int y = static_cast<int>(full_[i].index) / kStride;
    const auto add = [&](int column, int row, float weight) {
      if (column < 0 || row < 0 || column >= tile.width || row >= tile.height) return;
      density[row * tile.width + column] += std::max(weight, 0.0F);
    };
    add(x - 1, y - 1, number - a - b + ab);
    add(x, y - 1, a - ab);
    add(x - 1, y, b - ab);
    add(x, y, ab);
    if (x >= 1 && y >= 1) votes += sums.votes;
  }
  return votes;
}

std::uint64_t TileAccumulator::findOccupied() {
  assert(pending_ && sparse_);
  occupied_.width = tile_.tile.width;
  occupied_.height = tile_.tile.height;
  return resolve_.findOccupied(buffer(), occupied_, dirty_lines_);
}

kernels::PixelBlocks TileAccumulator::blocksOf(const kernels::TilePixels& pixels) const {
  kernels::PixelBlocks blocks;
  resolve_.listBlocks(pixels, blocks);
  return blocks;
}

void TileAccumulator::resolveBlocks(const kernels::PixelBlocks& blocks, float* density) {
  assert(pending_ && sparse_);
  pending_ = false;
  resolve_.blocks(cells_.data(), blocks, density);
  resolve_.clear(buffer(), dirty_lines_);
}

}  // namespace efm
