// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <opencv2/core/types.hpp>
#include <vector>

#include "mapping/geometry/depth_planes.h"
#include "mapping/geometry/reference_view.h"
#include "mapping/kernels/tile_scatter.h"
#include "mapping/rays/back_projection.h"
#include "mapping/sweep/plane_group.h"
#include "mapping/sweep/tile_rays.h"

namespace efm {

/// One camera's rays (of one slot of time), sorted into square bins by where they meet one plane,
/// their home: what a tile of the view sees in a group of planes lies in the bins around it. Time
/// order is kept within a bin.
///
/// With u counted from the principal point and C the camera centre, `transferToPlane` reads
/// u(1/Z) = (1 - C_z/Z) u_inf + f C_x / Z: from its home plane a ray shifts by
/// (f C_x - C_z u_home) / (1 - C_z/Z_home) per unit of inverse depth, likewise in y.
class RayBins {
 public:
  /// Which rays, and where their home is.
  enum class Kind {
    kAllPlanes,  ///< Before the camera on all planes; home in the middle. 8 bytes a ray,
                 ///< its place and shift good to some 1e-4 px.
    kFarPlanes,  ///< On far planes only, or fast, looking forward; home on the farthest. 12 bytes a
                 ///< ray.
    kNearPlanes,  ///< On near planes only, or fast, looking backward; home on the nearest. 12 bytes
                  ///< a ray.
  };

  /// Sorts the rays: by kind and, where the camera moves far, by stretches of time in which it does
  /// not, so that their bins have less around them to look at. Rays that are inside the view on no
  /// plane are left out. Runs on the threads of the task arena that it is called in. Runs on the
  /// threads of the arena that it is called in.
  static std::vector<RayBins> sort(const RayBundle& rays, const ReferenceView& view,
                                   const DepthPlanes& planes);

  /// Inverse depth of the home plane of the rays that are on all planes, 1/m.
  static double middleOf(const DepthPlanes& planes);

  bool onAllPlanes() const { return kind_ == Kind::kAllPlanes; }
  /// How far a ray inside the view moves at most in x or y, in pixels per unit of inverse depth.
  double fastestShift() const;

  class GroupReach;
  /// Prepares for a group of planes: one plane, where rays are not on all of them.
  GroupReach reachIn(const PlaneGroup& group) const;
  /// Appends the rays that may fall into some cells on planes of the group. Thread-safe.
  /// @param cells by their upper left pixels.
  /// @param origin what the coordinates of `found` count from.
  void gather(const GroupReach& reach, const cv::Rect& cells, cv::Point origin,
              const kernels::TileFunctions& functions, TileRays& found) const;

 private:
  /// From the least to the greatest of many numbers.
  struct Range {
    double least = 0;
    double greatest = 0;

    double middle() const { return 0.5 * (least + greatest); }
    double width() const { return greatest - least; }
    void extend(double value);
  };
  /// A ray in full, by where it meets the plane at infinity.
  struct WideRay {
    float x_inf = 0, y_inf = 0;
    std::uint32_t packet = 0;
  };
  /// The shift of a packet's rays, per unit of inverse depth: a - c u in x, b - c v in y.
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
    double step = 0;  // unit of compact rays' own shifts

    Range fromPrincipal() const;
  };

  RayBins(Kind kind, std::vector<RayPacket> packets, const ReferenceView& view,
          const DepthPlanes& planes);

  static Shift shiftFrom(const RayPacket& packet, const ReferenceView& view, double home);
  static std::vector<RayPacket>::const_iterator endOfSlowMotion(
      std::vector<RayPacket>::const_iterator packet, std::vector<RayPacket>::const_iterator end,
      const ReferenceView& view, const DepthPlanes& planes);
  Shift shiftOf(const RayPacket& packet) const;
  std::size_t binAt(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_.bins) +
           static_cast<std::size_t>(column);
  }
  void spanBins(const DepthPlanes& planes);
  template <typename Visit>
  void forEachRay(const RayBundle& rays, const Visit& visit) const;
  void count(const RayBundle& rays);
  void place(const RayBundle& rays);
  void placeCompact(const RayBundle& rays);
  void placeWide(const RayBundle& rays);
  std::vector<Range> reachAlong(const Axis& axis, const PlaneGroup& group) const;
  void gatherWide(const GroupReach& reach, std::size_t bin, const kernels::GatherRequest& request,
                  TileRays& found) const;

  Kind kind_;
  ReferenceView view_;
  double home_ = 0;  // inverse depth
  Axis columns_;
  Axis rows_;
  Range c_;                         // of the packets' shifts
  std::vector<std::size_t> begin_;  // of each bin's rays, row by row, and the end of all
  std::vector<kernels::CompactRay> compact_;
  std::vector<WideRay> wide_;
  std::vector<RayPacket> packets_;
};

/// Where the rays of each bin may be in a group of planes.
class RayBins::GroupReach {
 private:
  friend class RayBins;

  PlaneGroup group_;
  std::vector<Range> columns_;  // by bin, pixels
  std::vector<Range> rows_;
  std::vector<PlaneTransfer> transfers_;  // of packets of wide rays, to the group's one plane
};

}  // namespace efm
