// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include <cmath>
#include <cstddef>
#include <functional>
#include <utility>
#include <vector>

#include "mapping/dsi/dsi_columns.h"
#include "mapping/geometry/reference_view.h"
#include "mapping/sweep/space_sweep.h"
#include "test/oracle/naive_mapper.h"

namespace efm::test {

/// Stores the whole DSI.
class WholeDsi : public DsiSink {
 public:
  WholeDsi(const DepthPlanes& planes, const ReferenceView& view)
      : planes_(planes.size()), pixels_(view.pixels()) {}

  void addPlane(int plane, const float* plane_values) override {
    EXPECT_EQ(static_cast<std::size_t>(plane) * pixels_, values.size()) << "planes in their order";
    values.insert(values.end(), plane_values, plane_values + pixels_);
  }
  bool isComplete() const { return values.size() == static_cast<std::size_t>(planes_) * pixels_; }

 private:
  int planes_;
  std::size_t pixels_;

 public:
  std::vector<float> values;
};

/// Returns the sum of absolute differences from the oracle's DSI / the sum of the oracle's DSI.
inline double errorOverMass(const std::vector<float>& values, const oracle::Dsi& exact) {
  EXPECT_EQ(values.size(), exact.values.size());
  double mass = 0;
  double error = 0;
  for (std::size_t i = 0; i < exact.values.size(); ++i) {
    mass += exact.values[i];
    error += std::abs(static_cast<double>(values[i]) - exact.values[i]);
  }
  EXPECT_GT(mass, 0);
  return error / mass;
}

/// A DSI that a test writes down: [plane][row][column].
struct ChosenDsi {
  cv::Size size;
  int planes = 0;
  std::vector<float> values;

  ChosenDsi(const cv::Size& view, int plane_count)
      : size(view),
        planes(plane_count),
        values(static_cast<std::size_t>(view.area() * plane_count)) {}

  float& at(const cv::Point& pixel, int plane) {
    return values[static_cast<std::size_t>((plane * size.height + pixel.y) * size.width + pixel.x)];
  }
  float at(const cv::Point& pixel, int plane) const {
    return values[static_cast<std::size_t>((plane * size.height + pixel.y) * size.width + pixel.x)];
  }
  /// Writes the column of a pixel.
  void setColumn(const cv::Point& pixel, const std::function<double(int plane)>& value) {
    for (int plane = 0; plane < planes; ++plane) {
      at(pixel, plane) = static_cast<float>(value(plane));
    }
  }

  /// Returns the peaks, found pixel by pixel, and the columns of all pixels with a value.
  SweptDsi swept() const {
    constexpr int kWindowBeyondAllTiles = 1001;
    DsiPeaks peaks{cv::Mat1f::zeros(size), cv::Mat1i::zeros(size), cv::Mat1f(size, -1.0F),
                   cv::Mat1f(size, -1.0F)};
    TileVolume volume(planes, static_cast<std::size_t>(size.area()));
    for (int plane = 0; plane < planes; ++plane) {
      PlaneValues of_plane;
      for (int y = 0; y < size.height; ++y) {
        for (int x = 0; x < size.width; ++x) {
          const cv::Point pixel(x, y);
          of_plane.push_back(at(pixel, plane));
          if (at(pixel, plane) > at(pixel, peaks.plane(pixel))) peaks.plane(pixel) = plane;
        }
      }
      volume.setPlane(plane, of_plane);
    }
    for (int y = 0; y < size.height; ++y) {
      for (int x = 0; x < size.width; ++x) {
        const cv::Point pixel(x, y);
        const int plane = peaks.plane(pixel);
        peaks.confidence(pixel) = at(pixel, plane);
        if (plane > 0) peaks.before(pixel) = at(pixel, plane - 1);
        if (plane < planes - 1) peaks.after(pixel) = at(pixel, plane + 1);
      }
    }
    std::vector<DsiColumns::Tile> all = {DsiColumns::select({{0, 0}, size}, peaks.confidence,
                                                            volume, planes, kWindowBeyondAllTiles)};
    return {std::move(peaks), DsiColumns(size, planes, std::move(all))};
  }

  /// Returns the values rounded as in the columns.
  ChosenDsi rounded() const {
    const DsiColumns columns = swept().columns;
    ChosenDsi copy(size, planes);
    for (int y = 0; y < size.height; ++y) {
      for (int x = 0; x < size.width; ++x) {
        if (!columns.has({x, y})) continue;
        copy.setColumn({x, y}, [&](int plane) { return columns.value({x, y}, plane); });
      }
    }
    return copy;
  }
};

}  // namespace efm::test
