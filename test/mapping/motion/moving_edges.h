// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "mapping/events/event.h"
#include "mapping/events/window.h"
#include "mapping/geometry/rig.h"
#include "mapping/geometry/trajectory.h"

namespace efm::test {

/// Cameras side by side that move to the right past upright edges at several depths. Each edge
/// fires events of one polarity. Depths are exact.
struct MovingEdges {
  static constexpr std::int64_t kStart_ns = 1'700'000'000'000'000'000;
  static constexpr std::int64_t kDuration_ns = 200'000'000;
  static constexpr Window kWindow{kStart_ns, kStart_ns + kDuration_ns,
                                  kStart_ns + kDuration_ns / 2};
  static constexpr int kWidth = 120;
  static constexpr int kHeight = 90;
  static constexpr double kFocal_px = 90;
  static constexpr double kSpeed_m_s = 1.5;
  static constexpr double kBase_m = 0.1;

  struct Edge {
    double x_m = 0;
    double z_m = 0;
    int first_row = 0;  ///< The same in all images: rows do not change.
    int last_row = 0;
    bool polarity = false;
  };

  Rig rig;
  Trajectory trajectory;
  std::vector<Edge> edges;
  std::vector<std::vector<Event>> events;  // per camera

  explicit MovingEdges(int cameras) {
    for (int i = 0; i < 9; ++i) {
      const double z_m = 1 + 0.25 * ((i * 5) % 9);
      edges.push_back({z_m * (i - 4) * 0.12, z_m, 4 + 3 * (i % 4), 85 - 4 * (i % 3), i % 2 == 0});
    }
    for (std::int64_t t_ns = 0; t_ns <= kDuration_ns; t_ns += 5'000'000) {
      trajectory.add({kStart_ns + t_ns, {Eigen::Quaterniond::Identity(), {x_m(t_ns), 0, 0}}});
    }
    for (int c = 0; c < cameras; ++c) {
      rig.cameras.push_back(
          {{kWidth, kHeight, kFocal_px, kFocal_px, 59.5, 44.5, DistortionModel::kNone, {}},
           {Eigen::Quaterniond::Identity(), {kBase_m * c, 0, 0}},
           0});
      events.push_back(eventsOf(kBase_m * c));
    }
  }

  std::vector<int> cameras() const {
    std::vector<int> all;
    for (std::size_t c = 0; c < events.size(); ++c) all.push_back(static_cast<int>(c));
    return all;
  }
  std::vector<EventSpan> spans() const { return {events.begin(), events.end()}; }

  /// Returns the distance (px) from a pixel of camera 0 at the reference time to the nearest edge
  /// at depth `z_m`. The inverse depth of the edge may differ by `tolerance` (1/m).
  double offEdge(double x_px, double y_px, double z_m, double tolerance) const {
    double nearest = INFINITY;
    for (const Edge& edge : edges) {
      if (std::abs(1 / edge.z_m - 1 / z_m) > tolerance) continue;
      if (y_px < edge.first_row - 1 || y_px > edge.last_row + 1) continue;
      nearest = std::min(nearest, std::abs(columnOf(edge, x_m(kDuration_ns / 2)) - x_px));
    }
    return nearest;
  }

 private:
  static double x_m(std::int64_t since_ns) {
    return kSpeed_m_s * 1e-9 * static_cast<double>(since_ns);
  }
  static double columnOf(const Edge& edge, double camera_x_m) {
    return kFocal_px * (edge.x_m + 0.15 - camera_x_m) / edge.z_m + 59.5;
  }

  /// Returns the events of a camera. All rows of an edge fire when the edge enters another column.
  std::vector<Event> eventsOf(double offset_m) const {
    std::vector<Event> fired;
    for (const Edge& edge : edges) {
      long before = std::lround(columnOf(edge, offset_m));
      for (std::int64_t t_ns = 0; t_ns < kDuration_ns; t_ns += 50'000) {
        const long column = std::lround(columnOf(edge, x_m(t_ns) + offset_m));
        if (column == before) continue;
        // The edge enters the next column halfway between the centres of the two columns.
        before = column;
        if (column < 0 || column >= kWidth) continue;
        for (int row = edge.first_row; row <= edge.last_row; ++row) {
          fired.push_back({kStart_ns + t_ns, static_cast<std::uint16_t>(column),
                           static_cast<std::uint16_t>(row), edge.polarity});
        }
      }
    }
    std::stable_sort(fired.begin(), fired.end(),
                     [](const Event& a, const Event& b) { return a.t_ns < b.t_ns; });
    return fired;
  }
};

}  // namespace efm::test
