// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/dsi/dsi_columns.h"

#include <algorithm>
#include <cassert>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <utility>

namespace efm {
namespace {

constexpr float kFull = std::numeric_limits<std::uint16_t>::max();

/// Pixels of a tile, as their places and as indices into its planes.
struct TilePixels {
  std::vector<cv::Point> places;
  std::vector<std::size_t> indices;
};

TilePixels standingOut(const cv::Mat1f& confidence, int window) {
  // Isolated: what lies around the tile may be being written.
  cv::Mat1f surroundings;
  cv::GaussianBlur(confidence, surroundings, {window, window}, 0, 0,
                   cv::BORDER_REPLICATE | cv::BORDER_ISOLATED);
  const int reach = window / 2;
  const cv::Rect inner(reach, reach, confidence.cols - 2 * reach, confidence.rows - 2 * reach);
  TilePixels pixels;
  for (int y = 0; y < confidence.rows; ++y) {
    for (int x = 0; x < confidence.cols; ++x) {
      const float value = confidence(y, x);
      if (!(value > 0)) continue;
      if (inner.contains({x, y}) && value <= surroundings(y, x)) continue;
      pixels.places.emplace_back(x, y);
      pixels.indices.push_back(static_cast<std::size_t>(y * confidence.cols + x));
    }
  }
  return pixels;
}

}  // namespace

void TileVolume::take(int plane, const PlaneValues& values) {
  assert(values.size() <= pixels_);
  std::copy(values.begin(), values.end(), this->plane(plane));
}

DsiRays::Tile DsiRays::pick(const cv::Rect& tile, const cv::Mat1f& confidence,
                            const TileVolume& volume, int planes, int window) {
  const TilePixels chosen = standingOut(confidence, window);
  Tile rays;
  std::vector<float> to_units;
  for (const cv::Point& place : chosen.places) {
    rays.pixels.push_back(place + tile.tl());
    rays.units.push_back(confidence(place) / kFull);
    to_units.push_back(kFull / confidence(place));
  }
  const auto length = static_cast<std::size_t>(planes);
  rays.values.resize(chosen.indices.size() * length);
  for (int plane = 0; plane < planes; ++plane) {
    const float* values = volume.plane(plane);
    std::uint16_t* ray = rays.values.data() + plane;
    for (std::size_t i = 0; i < chosen.indices.size(); ++i, ray += length) {
      const float value = values[chosen.indices[i]] * to_units[i] + 0.5F;
      *ray = static_cast<std::uint16_t>(static_cast<int>(std::min(value, kFull)));
    }
  }
  return rays;
}

DsiRays::DsiRays(cv::Size view, int planes, std::vector<Tile> tiles)
    : planes_(planes), tiles_(std::move(tiles)), index_(view, -1) {
  for (const Tile& tile : tiles_) {
    const std::uint16_t* values = tile.values.data();
    for (std::size_t i = 0; i < tile.pixels.size(); ++i, values += planes_) {
      index_(tile.pixels[i]) = static_cast<int>(rays_.size());
      rays_.push_back({values, tile.units[i]});
    }
  }
}

void DsiRays::addTo(float* sum, cv::Point pixel, float weight) const {
  const Ray& ray = rays_[static_cast<std::size_t>(index_(pixel))];
  const float unit = weight * ray.unit;
  for (int plane = 0; plane < planes_; ++plane) {
    sum[plane] += unit * static_cast<float>(ray.values[plane]);
  }
}

}  // namespace efm
