// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/sweep/tile_accumulator.h"

#include <algorithm>
#include <cassert>

namespace efm {
namespace {

constexpr int kStride = kernels::kTileCells;
/// Up to so many rays per pixel it pays to look for empty cells.
constexpr double kMostSparse = 1;

int roundDown(int value, int unit) { return value / unit * unit; }

}  // namespace

TileVoter::TileVoter(VotingKernel kernel)
    : functions_(kernels::tileFunctions(kernel)), votes_{TileVotes(kernel), TileVotes(kernel)} {}

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

const kernels::FullCell* TileVoter::cast(TileRays& rays, double to_plane, TileVotes& votes) {
  full_.resize(std::max(full_.size(), rays.size() / kernels::kVotesPerCell + 1));
  if (rays.size() == 0 || inside_.empty()) return full_.data();
  const cv::Point corner = inside_.tl() - origin();
  return functions_.vote(
      rays.view(), static_cast<float>(to_plane),
      {votes.cells(), first_inside_, corner.x, corner.y, static_cast<std::uint32_t>(inside_.width),
       static_cast<std::uint32_t>(inside_.height)},
      full_.data());
}

std::uint64_t TileVoter::vote(TileRays& rays, double to_plane, float* density) {
  TileDensity all{density};
  return vote(rays, to_plane, all);
}

std::uint64_t TileVoter::vote(TileRays& rays, double to_plane, TileDensity& density) {
  TileVotes& votes = votes_[votes_[0].waiting() ? 1 : 0];
  assert(!votes.waiting());
  const kernels::FullCell* full_end = cast(rays, to_plane, votes);
  const bool sparse = static_cast<double>(rays.size()) <= kMostSparse * tile_.area();
  if (density.may_wait && sparse && full_end == full_.data()) {
    density.waiting = &votes;
    return votes.find(tile_.size());
  }
  const std::uint64_t folded = votes.foldAll(tile_.size(), density.values);
  return folded + addFullCells(full_end, density.values);
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
    const std::uint32_t place = cell->index;
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
