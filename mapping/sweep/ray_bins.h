// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "mapping/dsi/dsi_grid.h"
#include "mapping/kernels/tile_scatter.h"
#include "mapping/rays/back_projection.h"
#include "mapping/sweep/tile_rays.h"

namespace efm {

/// Consecutive depth planes.
struct PlaneRange {
  int begin = 0;
  int end = 0;               ///< One past the last.
  double first_depth_m = 0;  ///< Of plane `begin`.
  double last_depth_m = 0;   ///< Of plane `end - 1`.
};

/// Rays of one input, sorted into square bins by their pixel on one plane, the anchor plane (Z0 of
/// Rebecq et al., IJCV 2018, Eq. 15). The rays that a tile sees in a group of planes lie in the
/// bins around it. Within a bin, rays keep the order of time.
///
/// With u counted from the principal point and C the camera centre, `transferToPlane` reads
/// u(1/Z) = (1 - C_z/Z) u_inf + f C_x / Z. From the anchor plane at Z0 a ray therefore shifts by
/// (f C_x - C_z u_0) / (1 - C_z/Z0) per unit of inverse depth, likewise in y.
class RayBins {
 public:
  /// The planes that the rays are on, and the position of the anchor plane.
  enum class Kind {
    kAllPlanes,  ///< In front of the camera on all planes; anchor in the middle. 8 bytes a ray, its
                 ///< pixel and shift exact to some 1e-4 px.
    kFarPlanes,  ///< Forward rays that are on far planes only or shift far; anchor on the farthest
                 ///< plane. 12 bytes a ray.
    kNearPlanes,  ///< Backward rays that are on near planes only or shift far; anchor on the
                  ///< nearest plane. 12 bytes a ray.
  };

  /// Sorts rays into bins: apart by kind and, where the camera moves far, by intervals of time in
  /// which it does not, so that a tile's rays lie in fewer bins. Rays outside the view on all
  /// planes are left out. Runs on the threads of the task arena that it is called in.
  static std::vector<RayBins> sort(const RayBundle& rays, const DsiGrid& grid);

  /// Inverse depth of the anchor plane of rays that are on all planes, 1/m.
  static double middleAnchor(const DepthPlanes& planes);

  bool onAllPlanes() const { return kind_ == Kind::kAllPlanes; }
  /// The largest shift of a ray inside the view in x or y, in pixels per unit of inverse depth.
  double maxShift() const;

  class Footprint;
  /// Prepares for a group of planes: one plane, where rays are not on all of them.
  Footprint footprintIn(const PlaneRange& group) const;
  /// Appends the rays that may fall into the tile's cells on planes of the group. Thread-safe.
  void gather(const Footprint& footprint, const TileCells& tile,
              const kernels::TileFunctions& functions, TileRays& rays) const;

 private:
  struct Range {
    double min = 0;
    double max = 0;

    double middle() const { return 0.5 * (min + max); }
    double width() const { return max - min; }
    void extend(double value);
  };
  /// A ray by its pixel on the plane at infinity.
  struct WideRay {
    float x_inf = 0, y_inf = 0;
    std::uint32_t packet = 0;
  };
  /// The shift of a packet's rays from (u, v), per unit of inverse depth: (a - c u, b - c v).
  struct Shift {
    double a = 0, b = 0, c = 0;
  };
  /// Bins along one axis.
  struct Axis {
    double principal = 0;  // point of the view, pixels
    int pixels = 0;        // side of the view
    double begin = 0;      // corner of the first bin, pixels
    int bins = 0;
    Range at_center;  // shifts of the packets at the principal point: their a or b
    double step = 0;  // unit of compact rays' differences from the common shift

    Range fromPrincipal() const;
  };

  using PacketIterator = std::vector<RayPacket>::const_iterator;

  RayBins(Kind kind, std::vector<RayPacket> packets, const DsiGrid& grid);

  static Shift shiftFrom(const RayPacket& packet, const ReferenceView& view, double anchor);
  static PacketIterator endOfSlowMotion(PacketIterator packet, PacketIterator end,
                                        const DsiGrid& grid);
  Shift shiftOf(const RayPacket& packet) const;
  std::size_t binAt(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_.bins) +
           static_cast<std::size_t>(column);
  }
  void spanBins(const DsiGrid& grid);
  template <typename Visit>
  void forEachRay(const RayBundle& rays, const Visit& visit) const;
  void countRays(const RayBundle& rays);
  void storeCompact(const RayBundle& rays);
  void storeWide(const RayBundle& rays);
  std::vector<Range> footprintAlong(const Axis& axis, const PlaneRange& group) const;
  void gatherWide(const Footprint& footprint, std::size_t bin,
                  const kernels::GatherRequest& request, TileRays& rays) const;

  Kind kind_;
  ReferenceView view_;
  double anchor_ = 0;  // inverse depth
  Axis columns_;
  Axis rows_;
  Range c_;                         // of the packets' shifts
  std::vector<std::size_t> begin_;  // of each bin's rays, row by row, and the end of all
  std::vector<kernels::CompactRay> compact_;
  std::vector<WideRay> wide_;
  std::vector<RayPacket> packets_;
};

/// The pixels that the rays of each bin may have in a group of planes.
class RayBins::Footprint {
 private:
  friend class RayBins;

  PlaneRange group_;
  std::vector<Range> columns_;  // by bin, pixels
  std::vector<Range> rows_;
  std::vector<PlaneTransfer> transfers_;  // of packets of wide rays, to the group's one plane
};

}  // namespace efm
