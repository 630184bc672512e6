// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/tile_voter.h"

#include <algorithm>
#include <cassert>

namespace efm {
namespace {

constexpr int kStride = kernels::kTileCells;

int roundDown(int value, int unit) { return value / unit * unit; }

}  // namespace

TileVoter::TileVoter(const kernels::TileFunctions& functions)
    : functions_(functions),
      // Vectors read past the last row; what adds nothing may do so up to a tile from the first
      // cell inside the view.
      cells_(static_cast<std::size_t>((kStride + 2) * kStride), 0) {}

void TileVoter::moveTo(const cv::Rect& tile, const ReferenceView& view) {
  assert(tile.width <= kTilePixels && tile.height <= kTilePixels);
  tile_ = tile;
  // A pixel has cells on its left and above it; the view has none beyond its last pixels.
  const cv::Rect all(tile.x - 1, tile.y - 1, tile.width + 1, tile.height + 1);
  inside_ = all & cv::Rect(0, 0, view.width - 1, view.height - 1);
  if (inside_.empty()) inside_ = {};
  first_inside_ =
      inside_.empty()
          ? 0
          : static_cast<std::uint32_t>((inside_.y - all.y) * kStride + inside_.x - all.x);
}

cv::Point TileVoter::origin() const {
  return {roundDown(inside_.x, kernels::kSharedOrigin),
          roundDown(inside_.y, kernels::kSharedOrigin)};
}

std::uint64_t TileVoter::vote(TileRays& rays, double to_plane, float* density) {
  if (rays.size() == 0 || inside_.empty()) {
    std::fill_n(density, tile_.area(), 0.0F);
    return 0;
  }
  full_.resize(std::max(full_.size(), rays.size() / kernels::kVotesPerCell + 1));
  const cv::Point corner = inside_.tl() - origin();
  const kernels::FullCell* full_end = functions_.vote(
      rays.view(), static_cast<float>(to_plane),
      {cells_.data() + first_inside_, corner.x, corner.y, static_cast<std::uint32_t>(inside_.width),
       static_cast<std::uint32_t>(inside_.height)},
      full_.data());
  const std::uint64_t votes = functions_.fold(cells_.data(), tile_.width, tile_.height, density);
  return votes + addFullCells(full_end, density);
}

/// The four weights of a full cell's votes, from their sums of 1, a, b and ab.
std::uint64_t TileVoter::addFullCells(const kernels::FullCell* end, float* density) const {
  constexpr float kFraction = 1.0F / (1 << kernels::kFractionBits);
  constexpr float kProduct = 1.0F / (1 << kernels::kProductBits);
  std::uint64_t votes = 0;
  for (const kernels::FullCell* cell = full_.data(); cell != end; ++cell) {
    const kernels::CellSums sums = kernels::unpack(cell->sums);
    const float a = kFraction * static_cast<float>(sums.a);
    const float b = kFraction * static_cast<float>(sums.b);
    const float ab = kProduct * static_cast<float>(sums.ab);
    const auto number = static_cast<float>(sums.votes);
    const std::uint32_t place = first_inside_ + cell->index;
    // Of the pixel to the lower right.
    const int x = static_cast<int>(place) % kStride;
    const int y = static_cast<int>(place) / kStride;
    const auto add = [&](int column, int row, float weight) {
      if (column < 0 || row < 0 || column >= tile_.width || row >= tile_.height) return;
      density[row * tile_.width + column] += std::max(weight, 0.0F);
    };
    add(x - 1, y - 1, number - a - b + ab);
    add(x, y - 1, a - ab);
    add(x - 1, y, b - ab);
    add(x, y, ab);
    if (x >= 1 && y >= 1) votes += sums.votes;
  }
  return votes;
}

}  // namespace efm
