// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/sweep/plane_choice.h"

#include <gmock/gmock.h>

#include <vector>

namespace efm {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

std::vector<int> planesOf(const PlaneSet& set) {
  std::vector<int> planes;
  for (std::size_t plane = 0; plane < set.size(); ++plane) {
    if (set[plane]) planes.push_back(static_cast<int>(plane));
  }
  return planes;
}

TEST(CoarseStep, IsAPeakWideAndAtMostThreePlanes) {
  struct Row {
    int width, planes;
    double range_px;
    int step;
  };
  for (const Row& row : {Row{360, 101, 60, 3},  // 0.6 px between planes, peaks of 1.9 px
                         {360, 101, 90, 2},
                         {360, 101, 100, 1},
                         {1280, 101, 100, 3},  // larger views have wider peaks
                         {160, 101, 70, 1},
                         {360, 25, 0, 3},  // no parallax
                         {360, 1, 0, 3}}) {
    const ReferenceView view{row.width, 100, 1, 1, 0, 0};
    const DepthPlanes planes({1, 10, row.planes, PlaneSpacing::kInverse});
    EXPECT_EQ(coarseStep(planes, view, row.range_px), row.step)
        << row.width << " " << row.planes << " " << row.range_px;
  }
}

TEST(CoarsePlanes, AreEveryNthAndTheLast) {
  EXPECT_THAT(planesOf(coarsePlanes(8, 3)), ElementsAre(0, 3, 6, 7));
  EXPECT_THAT(planesOf(coarsePlanes(7, 3)), ElementsAre(0, 3, 6));
  EXPECT_THAT(planesOf(coarsePlanes(3, 1)), ElementsAre(0, 1, 2));
  EXPECT_THAT(planesOf(coarsePlanes(1, 3)), ElementsAre(0));
}

class PlanesAtEdges : public ::testing::Test {
 protected:
  static constexpr int kPlanes = 14;  // coarse: 0, 3, 6, 9, 12, 13
  static inline const cv::Size kTile{20, 10};

  struct Edge {
    int plane;
    int column;
    float contrast;
  };
  /// Returns the planes between the coarse planes beside vertical edges on coarse planes.
  static std::vector<int> of(const std::vector<Edge>& edges, float everywhere) {
    const PlaneSet coarse = coarsePlanes(kPlanes, 3);
    RunningPeaks peaks(static_cast<std::size_t>(kTile.area()), fastestKernel(), false);
    for (const int plane : planesOf(coarse)) {
      PlaneValues values(static_cast<std::size_t>(kTile.area()), everywhere);
      for (const Edge& edge : edges) {
        if (edge.plane != plane) continue;
        for (int y = 0; y < kTile.height; ++y) {
          values[static_cast<std::size_t>(y * kTile.width + edge.column)] += edge.contrast;
        }
      }
      peaks.add(plane, values.data());
    }
    return planesOf(planesAtEdges(coarse, peaks, kTile, 5));
  }
};

TEST_F(PlanesAtEdges, LieOnBothSidesOfAnEdgeThatIsMoreThanAHundredthOfAll) {
  EXPECT_THAT(of({{6, 5, 10}}, 1), ElementsAre(4, 5, 7, 8));
  EXPECT_THAT(of({{0, 5, 10}}, 0), ElementsAre(1, 2));
  EXPECT_THAT(of({{13, 5, 10}}, 0), IsEmpty());  // no plane lies between 12 and 13
  EXPECT_THAT(of({{6, 5, 10}, {12, 15, 1}}, 1), ElementsAre(4, 5, 7, 8, 10, 11));
  EXPECT_THAT(of({{6, 5, 10}, {12, 15, 0.05F}}, 1), ElementsAre(4, 5, 7, 8));
}

TEST_F(PlanesAtEdges, AreNoneWithoutAnEdge) {
  EXPECT_THAT(of({}, 0), IsEmpty());
  EXPECT_THAT(of({}, 3), IsEmpty());
}

}  // namespace
}  // namespace efm
