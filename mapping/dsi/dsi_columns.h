// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "mapping/dsi/plane_values.h"

namespace efm {

/// The fused values of all planes on one tile of the view: plane by plane, each row-major.
class TileVolume {
 public:
  TileVolume(int planes, std::size_t pixels)
      : pixels_(pixels), values_(static_cast<std::size_t>(planes) * pixels) {}

  void take(int plane, const PlaneValues& values);
  const float* plane(int plane) const {
    return values_.data() + static_cast<std::size_t>(plane) * pixels_;
  }
  float* plane(int plane) { return values_.data() + static_cast<std::size_t>(plane) * pixels_; }

 private:
  std::size_t pixels_;
  PlaneValues values_;
};

/// The fused DSI along the rays of those pixels that may become points: where the confidence stands
/// out from its surroundings, a third of a view at most in practice. The only part of the DSI that
/// is kept, two bytes per value; rounding to 1/65535 of each ray's peak moves no depth.
class DsiRays {
 public:
  /// Rays of one tile, to be put together with those of the others.
  struct Tile {
    std::vector<cv::Point> pixels;      // of the view
    std::vector<float> units;           // per pixel
    std::vector<std::uint16_t> values;  // [pixel][plane]
  };
  /// Picks the rays of a tile whose confidence is above the Gaussian mean of its surroundings.
  /// Where these are not wholly inside the tile, wherever anything voted.
  /// @param confidence of the tile's pixels. @param window side of the surroundings, odd.
  static Tile pick(const cv::Rect& tile, const cv::Mat1f& confidence, const TileVolume& volume,
                   int planes, int window);

  DsiRays() = default;
  DsiRays(cv::Size view, int planes, std::vector<Tile> tiles);
  DsiRays(DsiRays&&) = default;
  DsiRays& operator=(DsiRays&&) = default;

  int planes() const { return planes_; }
  std::size_t size() const { return rays_.size(); }
  bool has(cv::Point pixel) const { return index_(pixel) >= 0; }
  /// Of a pixel that has a ray.
  float value(cv::Point pixel, int plane) const {
    const Ray& ray = rays_[static_cast<std::size_t>(index_(pixel))];
    return ray.unit * static_cast<float>(ray.values[plane]);
  }
  /// sum[plane] += weight * value(pixel, plane) for all planes.
  void addTo(float* sum, cv::Point pixel, float weight) const;

 private:
  struct Ray {
    const std::uint16_t* values = nullptr;
    float unit = 0;
  };

  int planes_ = 0;
  std::vector<Tile> tiles_;  // own the values
  std::vector<Ray> rays_;
  cv::Mat1i index_;  // of rays_; -1 where there is none
};

}  // namespace efm
