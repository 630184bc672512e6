// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "mapping/dsi/dsi_grid.h"
#include "mapping/kernels/tile_scatter.h"
#include "mapping/rays/rays.h"
#include "mapping/sweep/tiles.h"

namespace efm {

/// Consecutive depth planes.
struct PlaneRange {
  int begin = 0;
  int end = 0;       ///< One past the last plane.
  double first = 0;  ///< Inverse depth of plane `begin`, 1/m.
  double last = 0;   ///< Inverse depth of plane `end - 1`, 1/m.

  PlaneRange() = default;
  PlaneRange(const DepthPlanes& planes, int begin_plane, int end_plane)
      : begin(begin_plane),
        end(end_plane),
        first(1 / planes.depth(begin_plane)),
        last(1 / planes.depth(end_plane - 1)) {}
};

/// Returns the planes in front of a packet's camera, along its rays; empty if all are behind it.
PlaneRange planesInFront(const RayPacket& packet, const DsiGrid& grid);

/// Rays of consecutive packets that are in front of their cameras on the same planes, and whose
/// cameras are close together. Rays are sorted into square bins by their pixel on the anchor plane
/// (Z0 of Rebecq et al., IJCV 2018, Eq. 15): a tile's rays on any plane are in a few adjacent bins.
/// Within a bin, rays are in order of time.
///
/// A ray is straight, so that its pixel is linear in inverse depth, with the camera centre C in
/// frame `ref` and u in pixels from the principal point: u(1/Z) = u_inf + (f C_x - C_z u_inf) / Z.
class RayBins {
 public:
  /// Sorts the rays of one input. Rays outside the view on all planes in front of their camera are
  /// dropped. Runs on the threads of the caller's task arena.
  static std::vector<RayBins> sort(const RayBundle& rays, const DsiGrid& grid);

  /// Returns the plane where moving rays have their pixels, 1/m: the middle of all planes.
  static double pixelPlane(const DepthPlanes& planes) {
    return 0.5 * (1 / planes.depth(0) + 1 / planes.depth(planes.size() - 1));
  }
  /// Returns whether the rays move, and are in front of their cameras on all planes of a group.
  bool covers(const PlaneRange& group) const {
    return moving_ && planes_.begin <= group.begin && planes_.end >= group.end;
  }
  bool isInFront(int plane) const { return planes_.begin <= plane && plane < planes_.end; }

  /// The pixels of the bins on some planes.
  class Footprint {
   private:
    friend class RayBins;

    /// The pixels of the bins along one axis, ordered for a binary search of the bins that overlap
    /// an interval.
    struct Side {
      std::vector<float> max_until;  // largest pixel of the bins up to this bin
      std::vector<float> min_from;   // smallest pixel of this bin and all later bins
      /// @return the first, and one past the last, of the bins that overlap an interval.
      std::pair<std::size_t, std::size_t> binsIn(float min, float max) const;
    };

    PlaneRange planes_;
    Side columns_;
    Side rows_;
  };
  /// @param planes planes in front of the rays' cameras.
  Footprint footprintOn(const PlaneRange& planes) const;
  /// Appends the rays that may fall into the tile's cells on planes of the footprint. Thread-safe.
  /// If rays are too oblique for the precision of floats, they do not move from plane to plane:
  /// they need a footprint on a single plane.
  void gather(const Footprint& footprint, const TileCells& tile,
              const kernels::TileFunctions& functions, TileRays& rays) const;

 private:
  struct Range {
    float min = std::numeric_limits<float>::infinity();
    float max = -std::numeric_limits<float>::infinity();
    void extend(float value) {
      min = std::min(min, value);
      max = std::max(max, value);
    }
  };
  /// The bins along one axis.
  struct Axis {
    Axis() = default;
    Axis(const Range& pixels, float side);

    std::size_t bins() const { return on_anchor.size(); }
    /// Returns the bin of a pixel of the anchor plane.
    std::size_t binOf(float pixel) const {
      const float bin = (pixel - begin) * bins_per_pixel;
      return static_cast<std::size_t>(std::max(0.0F, std::min(bin, last_bin)));
    }

    float begin = 0;  // start of the first bin, pixels of the anchor plane
    float bins_per_pixel = 1;
    float last_bin = 0;
    // The pixels of each bin's rays on the anchor plane, and on the plane at the other end.
    std::vector<Range> on_anchor, on_other;
  };
  /// Transfer of a packet's rays from the anchor plane to the other end: x_other = scale x +
  /// offset.
  struct Transfer {
    double scale, offset;
  };

  /// The ranges of a bundle's pixels on the plane at infinity.
  struct Directions {
    explicit Directions(const RayBundle& rays);
    Range x, y;
  };

  RayBins(const PlaneRange& planes, std::vector<RayPacket> packets, const DsiGrid& grid,
          const Directions& directions);
  Transfer toOther(const RayPacket& packet, Eigen::Index axis, double principal) const;
  Axis axisOf(Eigen::Index axis, int pixels, double principal, const Range& at_infinity,
              std::size_t rays) const;
  Footprint::Side sideOf(const Axis& axis, const PlaneRange& planes) const;
  void store(const RayBundle& bundle);

  PlaneRange planes_;  // in front of the cameras
  bool moving_ = true;
  std::vector<RayPacket> packets_;
  ReferenceView view_;
  // Inverse depths, 1/m. The anchor is the end of the planes where rays are closer together.
  double anchor_ = 0;
  double other_ = 0;      // the other end of the planes
  double to_pixels_ = 0;  // from the anchor to the plane of pixels
  Axis columns_;
  Axis rows_;
  std::vector<std::uint32_t> begin_;  // start of each bin's rays, row by row, and the last end
  std::vector<kernels::BinnedRay> rays_;
};

/// The rays of all inputs in bins: there a tile finds its rays for a group of planes. An input is
/// one slot of one camera (`CameraRays`): the rays of one group of events in one sub-interval.
class RayIndex {
 public:
  /// @param cameras consumed: each bundle is freed when its rays are in bins.
  /// @param kernel one of `availableKernels`, but not the plain one.
  RayIndex(std::vector<CameraRays> cameras, const DsiGrid& grid, VotingKernel kernel);

  /// Returns groups of planes, from near to far. Within a group, rays do not move far.
  const std::vector<PlaneRange>& groups() const { return groups_; }

  /// Returns the number of inputs. Input (camera, slot) has the index camera * slots + slot, where
  /// `slots` counts all groups.
  std::size_t inputs() const { return inputs_.size(); }
  /// Replaces `rays` by the rays of an input that the tile may see in a group of planes. They are
  /// in front of their cameras on all planes of the group. Thread-safe.
  void gather(std::size_t group, std::size_t input, const TileCells& tile, TileRays& rays) const;
  /// Adds the other rays that are in front of their cameras on a plane of the group. Rays that the
  /// last `gatherOn` added are removed first. Thread-safe.
  void gatherOn(int plane, std::size_t group, std::size_t input, const TileCells& tile,
                TileRays& rays) const;
  /// Returns the distance from the plane where moving rays have their pixels to a plane, 1/m.
  double fromPixels(int plane) const {
    return 1 / planes_.depth(plane) - RayBins::pixelPlane(planes_);
  }

  /// Frees the rays, but not the counts.
  void release() { inputs_ = {}; }
  /// Returns the counts of each camera as if no vote were cast.
  const std::vector<VoteCounts>& notCast() const { return not_cast_; }

 private:
  /// The index of bins, and their footprint on some planes.
  struct Source {
    std::size_t bins = 0;
    RayBins::Footprint footprint;
  };
  /// The bins that a group of planes needs.
  struct GroupSources {
    std::vector<Source> in_group;               // in front of their cameras on all planes
    std::vector<std::vector<Source>> on_plane;  // the other bins, by plane; or empty
  };
  struct Input {
    std::vector<RayBins> bins;
    std::vector<GroupSources> groups;
  };

  std::vector<PlaneRange> dividePlanes(double shift) const;
  GroupSources sourcesOf(const std::vector<RayBins>& bins, const PlaneRange& group) const;

  const kernels::TileFunctions& functions_;
  DepthPlanes planes_;
  std::vector<Input> inputs_;
  std::vector<PlaneRange> groups_;
  std::vector<VoteCounts> not_cast_;
};

}  // namespace efm
