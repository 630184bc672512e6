// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/dsi/dsi_columns.h"

#include <algorithm>
#include <cassert>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "mapping/dsi/voting_kernel.h"
#include "mapping/kernels/columns.h"

namespace efm {
namespace {

constexpr float kMaxUnits = std::numeric_limits<std::uint16_t>::max();

/// The pixels of a tile that stand out from their surroundings.
std::vector<cv::Point> standingOut(const cv::Mat1f& confidence, int window) {
  // Isolated: other threads may be writing the pixels around the tile.
  cv::Mat1f surroundings;
  cv::GaussianBlur(confidence, surroundings, {window, window}, 0, 0,
                   cv::BORDER_REPLICATE | cv::BORDER_ISOLATED);
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

void TileVolume::setPlane(int plane, const PlaneValues& values) {
  assert(values.size() <= pixels_);
  std::copy(values.begin(), values.end(),
            values_.data() + static_cast<std::size_t>(plane) * pixels_);
}

DsiColumns::Tile DsiColumns::select(const cv::Rect& tile, const cv::Mat1f& confidence,
                                    const TileVolume& volume, int planes, int window) {
  Tile columns;
  std::vector<std::size_t> indices;  // of pixels in the tile's planes
  std::vector<float> to_units;
  for (const cv::Point& pixel : standingOut(confidence, window)) {
    columns.pixels.push_back(pixel + tile.tl());
    columns.units.push_back(confidence(pixel) / kMaxUnits);
    to_units.push_back(kMaxUnits / confidence(pixel));
    indices.push_back(static_cast<std::size_t>(pixel.y * confidence.cols + pixel.x));
  }
  const auto length = static_cast<std::size_t>(planes);
  columns.values.resize(indices.size() * length + kernels::kColumnPadding);
  // So many planes at a time that a column's values fill a cache line.
  constexpr int kPlanes = 32;
  for (int begin = 0; begin < planes; begin += kPlanes) {
    const int end = std::min(begin + kPlanes, planes);
    std::uint16_t* column = columns.values.data();
    for (std::size_t i = 0; i < indices.size(); ++i, column += length) {
      for (int plane = begin; plane < end; ++plane) {
        const float value = volume.plane(plane)[indices[i]] * to_units[i] + 0.5F;
        column[plane] = static_cast<std::uint16_t>(static_cast<int>(std::min(value, kMaxUnits)));
      }
    }
  }
  return columns;
}

DsiColumns::DsiColumns(cv::Size view, int planes, std::vector<Tile> tiles)
    : planes_(planes),
      tiles_(std::move(tiles)),
      index_(view, -1),
      functions_(&kernels::columnFunctions(fastestKernel())) {
  for (const Tile& tile : tiles_) {
    const std::uint16_t* values = tile.values.data();
    for (std::size_t i = 0; i < tile.pixels.size(); ++i, values += planes_) {
      index_(tile.pixels[i]) = static_cast<int>(columns_.size());
      columns_.push_back({values, tile.units[i]});
    }
  }
}

void DsiColumns::addTo(float* sum, cv::Point pixel, float weight) const {
  const Column& column = columns_[static_cast<std::size_t>(index_(pixel))];
  functions_->add(sum, column.values, static_cast<std::size_t>(planes_), weight * column.unit);
}

}  // namespace efm
