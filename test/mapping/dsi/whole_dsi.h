// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <vector>

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

/// The difference from the oracle's DSI, as a fraction of its mass.
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

}  // namespace efm::test
