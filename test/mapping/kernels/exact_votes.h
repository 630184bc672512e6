// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "mapping/dsi/vote_counts.h"
#include "mapping/geometry/depth_planes.h"
#include "mapping/geometry/reference_view.h"
#include "mapping/rays/back_projection.h"

namespace efm::test {

/// The votes of rays in double precision, and bounds for the errors of floats.
struct ExactVotes {
  std::vector<double> dsi;  ///< [plane][row][column]
  VoteCounts counts;
  /// Votes so near the border of the view that rounding decides whether they are cast.
  std::uint64_t at_border = 0;
  /// How far rounded floats may move all votes together, summed over x and y, pixels.
  double float_shift_px = 0;
};

/// @param unit_px coordinates are also rounded to this: 1/4096 px in the fast kernels.
inline ExactVotes voteExactly(const RayBundle& rays, const ReferenceView& view,
                              const DepthPlanes& planes, double unit_px = 1.0 / 4096) {
  // One of a product, one of a sum, and as many on the plane where rays are binned.
  constexpr double kRoundings = 4.0 / (1 << 24);
  ExactVotes votes;
  votes.dsi.resize(static_cast<std::size_t>(planes.size()) * view.pixels());
  for (const RayPacket& packet : rays.packets) {
    for (int plane = 0; plane < planes.size(); ++plane) {
      const PlaneTransfer to = transferToPlane(packet, view, planes.depth(plane));
      if (!to.in_front) {
        votes.counts.behind_camera += packet.end - packet.begin;
        continue;
      }
      double* density = votes.dsi.data() + static_cast<std::size_t>(plane) * view.pixels();
      for (std::size_t i = packet.begin; i < packet.end; ++i) {
        const double from_x = to.scale * double{rays.x_inf[i]};
        const double from_y = to.scale * double{rays.y_inf[i]};
        const double x = from_x + to.offset_x;
        const double y = from_y + to.offset_y;
        const double shift_x = kRoundings * std::max(std::abs(from_x), std::abs(to.offset_x));
        const double shift_y = kRoundings * std::max(std::abs(from_y), std::abs(to.offset_y));
        // How far outside, or inside where negative.
        const double out = std::max({-x, x - (view.width - 1), -y, y - (view.height - 1)});
        if (std::abs(out) <= unit_px + std::max(shift_x, shift_y)) ++votes.at_border;
        if (!(x >= 0 && x < view.width - 1 && y >= 0 && y < view.height - 1)) {
          ++votes.counts.outside_view;
          continue;
        }
        ++votes.counts.cast;
        votes.float_shift_px += shift_x + shift_y;
        const auto column = static_cast<std::size_t>(x);
        const auto row = static_cast<std::size_t>(y);
        const double a = x - static_cast<double>(column);
        const double b = y - static_cast<double>(row);
        double* upper = density + row * static_cast<std::size_t>(view.width) + column;
        double* lower = upper + view.width;
        upper[0] += (1 - a) * (1 - b);
        upper[1] += a * (1 - b);
        lower[0] += (1 - a) * b;
        lower[1] += a * b;
      }
    }
  }
  return votes;
}

}  // namespace efm::test
