// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/dsi/dsi_columns.h"

#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <utility>

namespace efm {
namespace {

constexpr float kNoValue = -1;

}  // namespace

DsiPeaks unwrittenPeaks(const ReferenceView& view, bool confidence_alone) {
  const cv::Size size(view.width, view.height);
  if (confidence_alone) return {cv::Mat1f(size), {}, {}, {}};
  return {cv::Mat1f(size), cv::Mat1i(size), cv::Mat1f(size), cv::Mat1f(size)};
}

RunningPeaks::RunningPeaks(std::size_t pixels, VotingKernel kernel, bool neighbours)
    : functions_(&kernels::peakFunctions(kernel)), best_(pixels, kNoValue), plane_(pixels, -1) {
  if (!neighbours) return;
  for (PlaneValues* values : {&before_, &after_, &previous_}) values->assign(pixels, kNoValue);
}

void RunningPeaks::add(int plane, const float* values) {
  const auto add = previous_.empty() ? functions_->addAlone : functions_->add;
  add({best_.data(), plane_.data(), before_.data(), after_.data(), previous_.data()}, plane, values,
      best_.size());
}

void RunningPeaks::writeTo(DsiPeaks& images, const cv::Rect& tile) const {
  assert(static_cast<std::size_t>(tile.area()) == best_.size());
  efm::writeTo(images.confidence(tile), best_.data());
  if (images.plane.empty()) return;
  assert(!previous_.empty());
  efm::writeTo(images.plane(tile), plane_.data());
  efm::writeTo(images.before(tile), before_.data());
  efm::writeTo(images.after(tile), after_.data());
}

namespace {

constexpr float kRootsPerPeak = 8191;

/// The bytes of values from 0 to a column's peak, in steps of 1/kRootsPerPeak of the peak.
/// Computing each root is slower.
using RootTable = std::array<std::uint8_t, static_cast<std::size_t>(kRootsPerPeak) + 1>;

RootTable makeRootTable() {
  RootTable table{};
  for (std::size_t i = 0; i < table.size(); ++i) {
    const float below = 1 - static_cast<float>(i) / kRootsPerPeak;
    table[i] = static_cast<std::uint8_t>(std::lround(kernels::kMaxRoot * std::sqrt(below)));
  }
  return table;
}

/// Returns the pixels of a tile whose confidence is above that of their surroundings.
std::vector<cv::Point> standingOut(const cv::Mat1f& confidence, int window) {
  const cv::Mat1f surroundings = surroundingsOf(confidence, window);
  const int radius = window / 2;
  const cv::Rect inner(radius, radius, confidence.cols - 2 * radius, confidence.rows - 2 * radius);
  std::vector<cv::Point> pixels;
  for (int y = 0; y < confidence.rows; ++y) {
    for (int x = 0; x < confidence.cols; ++x) {
      const float value = confidence(y, x);
      if (!(value > 0)) continue;
      if (inner.contains({x, y}) && value <= surroundings(y, x)) continue;
      pixels.emplace_back(x, y);
    }
  }
  return pixels;
}

}  // namespace

cv::Mat1f surroundingsOf(const cv::Mat1f& confidence, int window) {
  // Isolated, because other threads may be writing the pixels around the tile.
  cv::Mat1f surroundings;
  cv::GaussianBlur(confidence, surroundings, {window, window}, 0, 0,
                   cv::BORDER_REPLICATE | cv::BORDER_ISOLATED);
  return surroundings;
}

void TileVolume::setPlane(int plane, const PlaneValues& values) {
  assert(values.size() <= stride_);
  std::copy(values.begin(), values.end(), this->plane(plane));
}

void TileVolume::interpolate(const std::vector<bool>& known, std::size_t pixels) {
  std::size_t before = 0;
  for (std::size_t after = 1; after < known.size(); ++after) {
    if (!known[after]) continue;
    const float* first = plane(static_cast<int>(before));
    const float* last = plane(static_cast<int>(after));
    for (std::size_t at = before + 1; at < after; ++at) {
      const float weight = static_cast<float>(at - before) / static_cast<float>(after - before);
      float* values = plane(static_cast<int>(at));
      for (std::size_t i = 0; i < pixels; ++i) {
        values[i] = first[i] + weight * (last[i] - first[i]);
      }
    }
    before = after;
  }
}

DsiColumns::Tile DsiColumns::select(const cv::Rect& tile, const cv::Mat1f& confidence,
                                    const TileVolume& volume, int planes, int window) {
  Tile columns;
  std::vector<std::size_t> indices;  // of the pixels, in a plane of the tile
  std::vector<float> to_index;
  const std::vector<cv::Point> pixels = standingOut(confidence, window);
  columns.pixels.reserve(pixels.size());
  columns.units.reserve(pixels.size());
  for (const cv::Point& pixel : pixels) {
    columns.pixels.emplace_back(pixel + tile.tl());
    columns.units.push_back(confidence(pixel) / kernels::kColumnPeak);
    to_index.push_back(kRootsPerPeak / confidence(pixel));
    indices.push_back(static_cast<std::size_t>(pixel.y * confidence.cols + pixel.x));
  }
  static const RootTable roots = makeRootTable();
  const auto length = static_cast<std::size_t>(planes);
  columns.roots.resize(indices.size() * length + kernels::kColumnPadding);
  // Only a few planes at a time: their lines stay in the first-level cache for the next pixels.
  constexpr int kPlanes = 32;
  for (int begin = 0; begin < planes; begin += kPlanes) {
    const int end = std::min(begin + kPlanes, planes);
    std::uint8_t* column = columns.roots.data();
    for (std::size_t i = 0; i < indices.size(); ++i, column += length) {
      for (int plane = begin; plane < end; ++plane) {
        const float index = volume.plane(plane)[indices[i]] * to_index[i] + 0.5F;
        column[plane] =
            roots[static_cast<std::size_t>(static_cast<int>(std::min(kRootsPerPeak, index)))];
      }
    }
  }
  return columns;
}

DsiColumns::DsiColumns(cv::Size view, int planes, std::vector<Tile> tiles)
    : planes_(planes), index_(view, -1), functions_(&kernels::columnFunctions(fastestKernel())) {
  std::size_t count = 0;
  for (const Tile& tile : tiles) count += tile.pixels.size();
  columns_.reserve(count);
  for (Tile& tile : tiles) {
    const std::uint8_t* roots = tile.roots.data();
    for (std::size_t i = 0; i < tile.pixels.size(); ++i, roots += planes_) {
      index_(cv::Point(tile.pixels[i])) = static_cast<int>(columns_.size());
      columns_.push_back({roots, tile.units[i]});
    }
    roots_.push_back(std::move(tile.roots));  // the values keep their addresses
    tile = {};
  }
}

void DsiColumns::addTo(float* sum, cv::Point pixel, float weight) const {
  const Column& column = columns_[static_cast<std::size_t>(index_(pixel))];
  functions_->add(sum, column.roots, static_cast<std::size_t>(planes_), weight * column.unit);
}

}  // namespace efm
