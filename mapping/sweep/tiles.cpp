// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/sweep/tiles.h"

#include <algorithm>
#include <cassert>

#include "mapping/kernels/kernels.h"

namespace efm {
namespace {

int roundDown(int value, int unit) { return value / unit * unit; }

}  // namespace

TileCells::TileCells(const cv::Rect& tile_pixels, const ReferenceView& view) : tile(tile_pixels) {
  assert(tile.width <= kMaxPixels && tile.height <= kMaxPixels);
  // A pixel has cells on its left and above it; the view has no cells beyond its last pixels.
  all = {tile.x - 1, tile.y - 1, tile.width + 1, tile.height + 1};
  in_view = all & cv::Rect(0, 0, view.width - 1, view.height - 1);
  if (in_view.empty()) in_view = {};
  origin = {roundDown(in_view.x, kernels::kSharedOrigin),
            roundDown(in_view.y, kernels::kSharedOrigin)};
}

void TileRays::reserve(std::size_t more) {
  const std::size_t needed = size_ + more + kernels::kRayPadding;
  if (x_.size() >= needed) return;
  for (PlaneValues* values : {&x_, &y_, &dx_, &dy_}) values->resize(needed + needed / 2);
}

void TileRays::pad() {
  reserve(0);
  for (std::size_t i = size_; i < size_ + kernels::kRayPadding; ++i) {
    x_[i] = y_[i] = -1;  // left of and above every cell
    dx_[i] = dy_[i] = 0;
  }
}

namespace {

constexpr int kStride = kernels::kTileCells;

}  // namespace

TileAccumulator::TileAccumulator(VotingKernel kernel)
    : scatter_(kernels::tileFunctions(kernel)),
      resolve_(kernels::resolveFunctions(kernel)),
      // Vectors read past the last row. A ray outside the view adds zero to a cell at most one tile
      // after the first cell inside.
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

/// Adds the weights of full cells. @return the weights of pixels in the tile, in units.
std::uint64_t TileAccumulator::addFullCells(float* density) const {
  constexpr float kUnit = 1.0F / (1 << kernels::kWeightBits);
  const cv::Rect& tile = tile_.tile;
  std::uint64_t units = 0;
  for (std::size_t i = 0; i < full_cells_; ++i) {
    const kernels::CellSums sums = kernels::unpack(full_[i].sums);
    // Position in the tile of the cell's lower right pixel.
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

namespace {

/// Marks of lines are faster if few lines have votes: if one of two inputs has at most this number
/// of rays per pixel, and if at most this fraction of pixels is not skipped.
constexpr double kMaxMarkedRays = 1;
constexpr double kMaxMarkedPixels = 0.5;

}  // namespace

TileFusion::TileFusion(const FusionOptions& options, const FusionInputs& inputs,
                       PlaneFusion::Keep keep, VotingKernel kernel)
    : options_(options),
      inputs_(inputs),
      keep_(keep),
      pairs_(keep == PlaneFusion::Keep::kFusedOnly && inputs.cameras == 2 &&
             (isAndLike(options.across_cameras) || options.across_cameras == FusionRule::kPairs) &&
             (inputs.slots_per_group == 1 || (options.across_time == FusionRule::kArithmetic &&
                                              options.order == FusionOrder::kCamerasThenTime))),
      accumulators_{TileAccumulator(kernel), TileAccumulator(kernel)},
      units_(static_cast<std::size_t>(inputs.cameras)) {
  if (options_.across_cameras == FusionRule::kPairs && inputs.cameras <= 2) {
    options_.across_cameras = FusionRule::kHarmonic;  // the same bits
  }
}

void TileFusion::moveTo(const TileCells& tile) {
  for (TileAccumulator& accumulator : accumulators_) accumulator.moveTo(tile);
  pixels_ = static_cast<std::size_t>(tile.tile.area());
  if (!pairs_) {
    planes_.emplace(options_, inputs_, pixels_, keep_);
    return;
  }
  skips_.assign(static_cast<std::size_t>(inputs_.slots_per_group * inputs_.groups), true);
  group_sum_.resize(pixels_ + kernels::kSumPadding);
}

void TileFusion::fuse(std::vector<TileRays>& rays, double from_pixels, float* fused) {
  if (pairs_) return fusePairs(rays, from_pixels, fused);
  planes_->begin();
  for (const CameraSlot& input : planes_->inputs()) {
    TileAccumulator& accumulator = accumulators_[0];
    accumulator.vote(rays[static_cast<std::size_t>(
                         input.camera * inputs_.slots_per_group * inputs_.groups + input.slot)],
                     from_pixels);
    units_[static_cast<std::size_t>(input.camera)] += accumulator.resolve(planes_->next().data());
    planes_->add(input);
  }
  std::copy_n(planes_->fused().begin(), pixels_, fused);
}

void TileFusion::fusePairs(std::vector<TileRays>& rays, double from_pixels, float* fused) {
  std::fill_n(fused, pixels_, 0.0F);
  const auto slots_per_group = static_cast<std::size_t>(inputs_.slots_per_group);
  const std::size_t slots = rays.size() / 2;
  for (std::size_t begin = 0; begin < slots; begin += slots_per_group) {
    float* sum = slots_per_group == 1 ? fused : group_sum_.data();
    if (slots_per_group > 1) std::fill_n(sum, pixels_, 0.0F);
    for (std::size_t slot = begin; slot < begin + slots_per_group; ++slot) {
      TileRays& first = rays[slot];
      TileRays& second = rays[slots + slot];
      const auto fewer = static_cast<double>(std::min(first.size(), second.size()));
      const auto pixels = static_cast<double>(pixels_);
      const bool marks = skips_[slot] && fewer <= kMaxMarkedRays * pixels;
      accumulators_[0].vote(first, from_pixels, marks);
      accumulators_[1].vote(second, from_pixels, marks);
      const int resolved = TileAccumulator::addPair(options_.across_cameras, accumulators_[0],
                                                    accumulators_[1], sum, units_.data());
      if (marks) skips_[slot] = resolved <= kMaxMarkedPixels * pixels;
    }
    if (slots_per_group == 1) continue;
    const auto count = static_cast<float>(slots_per_group);
    for (std::size_t i = 0; i < pixels_; ++i) fused[i] += sum[i] / count;
  }
}

}  // namespace efm
