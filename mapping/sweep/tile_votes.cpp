// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/sweep/tile_votes.h"

#include <cassert>

namespace efm {

TileVotes::TileVotes(VotingKernel kernel)
    : functions_(&kernels::foldFunctions(kernel)),
      // Vectors read past the last row; what adds nothing may do so up to a tile from the first
      // cell inside the view.
      cells_(static_cast<std::size_t>((kernels::kTileCells + 2) * kernels::kTileCells), 0),
      marks_(kernels::kMarks + kernels::kRayPadding, 0) {}

std::uint64_t TileVotes::foldAll(const cv::Size& tile, float* density) {
  return functions_->all(cells(), tile.width, tile.height, density);
}

std::uint64_t TileVotes::find(const cv::Size& tile) {
  waiting_ = true;
  pixels_.width = tile.width;
  pixels_.height = tile.height;
  return functions_->find(cells(), pixels_, lines_);
}

kernels::PixelBlocks TileVotes::blocksOf(const kernels::TilePixels& pixels) const {
  kernels::PixelBlocks blocks;
  functions_->listBlocks(pixels, blocks);
  return blocks;
}

void TileVotes::foldSome(const kernels::PixelBlocks& blocks, float* density) {
  assert(waiting_);
  waiting_ = false;
  functions_->some(cells_.data(), blocks, density);
  functions_->clear(cells(), lines_);
}

}  // namespace efm
