// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <mutex>
#include <set>
#include <vector>

#include "mapping/sweep/space_sweep.h"
#include "test/oracle/naive_mapper.h"

namespace efm::test {

/// Keeps the whole DSI.
class KeptDsi : public DsiSink {
 public:
  KeptDsi(const DepthPlanes& planes, const ReferenceView& view)
      : pixels_(view.pixels()), values(static_cast<std::size_t>(planes.size()) * pixels_, -1.0F) {}

  void takePlane(int plane, const float* plane_values) override {
    const std::lock_guard lock(mutex_);
    EXPECT_TRUE(planes_seen_.insert(plane).second) << "plane " << plane << " came twice";
    std::copy(plane_values, plane_values + pixels_,
              values.begin() + static_cast<std::ptrdiff_t>(plane * static_cast<int>(pixels_)));
  }
  std::size_t planesSeen() const { return planes_seen_.size(); }

 private:
  std::size_t pixels_;
  std::mutex mutex_;
  std::set<int> planes_seen_;

 public:
  std::vector<float> values;
};

/// What differs from the oracle's DSI, as a share of its mass.
inline double errorOverMass(const std::vector<float>& values, const oracle::Dsi& exact) {
  double mass = 0;
  double error = 0;
  for (std::size_t i = 0; i < exact.values.size(); ++i) {
    mass += exact.values[i];
    error += std::abs(static_cast<double>(values[i]) - exact.values[i]);
  }
  EXPECT_GT(mass, 0);
  return error / mass;
}

}  // namespace efm::test
