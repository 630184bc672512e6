// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/sweep/ray_bins.h"

#include <tbb/parallel_for_each.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <tuple>
#include <utility>

namespace efm {
namespace {

/// Side of a bin, and the distance that packets of one `RayBins` may be apart. Smaller bins are
/// more, larger bins have more rays that a tile does not see.
constexpr double kBin_px = 16;
/// Of a bin on average. Fewer rays do not fill vectors.
constexpr double kRaysPerBin = 8;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// The planes in front of a packet's camera; empty where all are behind it.
PlaneRange planesInFront(const RayPacket& packet, const DsiGrid& grid) {
  const int count = grid.planes.size();
  const auto in_front = [&](int plane) {
    return transferToPlane(packet, grid.view, grid.planes.depth(plane)).in_front;
  };
  // Forward rays leave their camera for the farther planes, backward rays for the nearer ones.
  int begin = 0;
  int end = count;
  while (begin < end) {
    const int middle = (begin + end) / 2;
    in_front(middle) == packet.forward ? end = middle : begin = middle + 1;
  }
  const int from = packet.forward ? begin : 0;
  const int until = packet.forward ? count : begin;
  return from < until ? PlaneRange(grid.planes, from, until) : PlaneRange();
}

/// A packet's transfer to one end of the planes.
Eigen::Array3d transferAt(const RayPacket& packet, const ReferenceView& view,
                          double inverse_depth) {
  const PlaneTransfer to = transferToPlane(packet, view, 1 / inverse_depth);
  return {to.scale, to.offset_x + (to.scale - 1) * view.cx, to.offset_y + (to.scale - 1) * view.cy};
}

/// How far apart packets move the same ray, over the planes. Rays lie up to half a view from the
/// principal point.
class Spread {
 public:
  explicit Spread(const ReferenceView& view) : view_(view) {}

  void add(const RayPacket& packet, const PlaneRange& planes) {
    for (std::size_t i = 0; i < 2; ++i) {
      const Eigen::Array3d transfer =
          transferAt(packet, view_, i == 0 ? planes.first : planes.last);
      min_[i] = min_[i].min(transfer);
      max_[i] = max_[i].max(transfer);
    }
  }
  double pixels() const {
    double spread = 0;
    for (std::size_t i = 0; i < 2; ++i) {
      const Eigen::Array3d width = max_[i] - min_[i];
      spread = std::max({spread, width[1] + 0.5 * width[0] * view_.width,
                         width[2] + 0.5 * width[0] * view_.height});
    }
    return spread;
  }

 private:
  ReferenceView view_;
  Eigen::Array3d min_[2] = {Eigen::Array3d::Constant(kInfinity), min_[0]};
  Eigen::Array3d max_[2] = {Eigen::Array3d::Constant(-kInfinity), max_[0]};
};

}  // namespace

RayBins::Axis::Axis(const Range& pixels, float side) : begin(pixels.min), bins_per_pixel(1 / side) {
  constexpr Range kEmpty{std::numeric_limits<float>::infinity(),
                         -std::numeric_limits<float>::infinity()};
  on_anchor.assign(static_cast<std::size_t>((pixels.max - pixels.min) / side) + 1, kEmpty);
  on_other = on_anchor;
  last_bin = static_cast<float>(bins() - 1);
}

std::vector<RayBins> RayBins::sort(const RayBundle& rays, const DsiGrid& grid) {
  using Planes = std::tuple<bool, int, int>;
  std::map<Planes, std::vector<RayPacket>> in_front;  // of the same planes
  for (const RayPacket& packet : rays.packets) {
    const PlaneRange planes = planesInFront(packet, grid);
    if (packet.begin == packet.end || planes.begin == planes.end) continue;
    in_front[{packet.forward, planes.begin, planes.end}].push_back(packet);
  }
  const double min_rays =
      kRaysPerBin * static_cast<double>(grid.view.pixels()) / (kBin_px * kBin_px);
  std::vector<RayBins> all;
  for (const auto& [key, packets] : in_front) {
    const auto& [forward, begin, end] = key;
    const PlaneRange planes(grid.planes, begin, end);
    for (auto packet = packets.begin(); packet != packets.end();) {
      const auto first = packet;
      Spread spread(grid.view);
      std::size_t count = 0;
      do {
        spread.add(*packet, planes);
        count += packet->end - packet->begin;
        ++packet;
      } while (packet != packets.end() &&
               (static_cast<double>(count) < min_rays || spread.pixels() <= kBin_px));
      all.push_back(RayBins(planes, forward, {first, packet}, grid.view));
    }
  }
  tbb::parallel_for_each(all, [&rays](RayBins& bins) { bins.store(rays); });
  return all;
}

RayBins::RayBins(const PlaneRange& planes, bool forward, std::vector<RayPacket> packets,
                 const ReferenceView& view)
    : planes_(planes), forward_(forward), packets_(std::move(packets)), view_(view) {
  double scale_first = 0;
  double scale_last = 0;
  std::size_t count = 0;
  for (const RayPacket& packet : packets_) {
    scale_first += std::abs(transferAt(packet, view, planes.first)[0]);
    scale_last += std::abs(transferAt(packet, view, planes.last)[0]);
    count += packet.end - packet.begin;
  }
  anchor_ = scale_first <= scale_last ? planes.first : planes.last;
  other_ = scale_first <= scale_last ? planes.last : planes.first;
  const Range x = pixelsOnAnchor(1, view.width, view.cx);
  const Range y = pixelsOnAnchor(2, view.height, view.cy);
  const double area = double{x.max - x.min} * double{y.max - y.min};
  const auto side = static_cast<float>(
      std::max(kBin_px, std::sqrt(area * kRaysPerBin / static_cast<double>(count))));
  columns_ = Axis(x, side);
  rows_ = Axis(y, side);
}

/// The pixels on the anchor plane of rays that are inside the view there or at the other end.
RayBins::Range RayBins::pixelsOnAnchor(Eigen::Index axis, int pixels, double principal) const {
  Range range{0, static_cast<float>(pixels)};
  for (const RayPacket& packet : packets_) {
    const Eigen::Array3d anchor = transferAt(packet, view_, anchor_);
    const Eigen::Array3d other = transferAt(packet, view_, other_);
    for (const double pixel : {0.0, 1.0 * pixels}) {
      const double u_inf = (pixel - principal - other[axis]) / other[0];
      range.extend(static_cast<float>(principal + anchor[0] * u_inf + anchor[axis]));
    }
  }
  return range;
}

/// Visits the rays that cross the view, packet by packet: visit(ray, column, row, x, y), with the
/// bin and the pixel at the other end of the planes.
template <typename Visit>
void RayBins::forEachRay(const RayBundle& bundle, const Visit& visit) const {
  struct Transfer {
    Transfer(const RayPacket& packet, const ReferenceView& view, double inverse_depth) {
      const PlaneTransfer to = transferToPlane(packet, view, 1 / inverse_depth);
      scale = static_cast<float>(to.scale);
      x = static_cast<float>(to.offset_x);
      y = static_cast<float>(to.offset_y);
    }
    float scale, x, y;
  };
  const auto crosses = [](float a, float b, int pixels) {
    constexpr float kRounding_px = 0.01F;
    return std::isfinite(a) && std::isfinite(b) && std::max(a, b) >= -kRounding_px &&
           std::min(a, b) <= static_cast<float>(pixels - 1) + kRounding_px;
  };
  for (const RayPacket& packet : packets_) {
    const Transfer anchor(packet, view_, anchor_);
    const Transfer other(packet, view_, other_);
    const Eigen::Vector3d& center = packet.center_ref;
    const auto c = static_cast<float>(center.z());
    const auto a = static_cast<float>(view_.fx * center.x() + view_.cx * center.z());
    const auto b = static_cast<float>(view_.fy * center.y() + view_.cy * center.z());
    for (std::size_t i = packet.begin; i < packet.end; ++i) {
      const float x_inf = bundle.x_inf[i];
      const float y_inf = bundle.y_inf[i];
      const float x = anchor.scale * x_inf + anchor.x;
      const float y = anchor.scale * y_inf + anchor.y;
      const float x_other = other.scale * x_inf + other.x;
      const float y_other = other.scale * y_inf + other.y;
      if (!crosses(x, x_other, view_.width) || !crosses(y, y_other, view_.height)) continue;
      visit(kernels::BinnedRay{x, y, a - c * x_inf, b - c * y_inf}, columns_.binOf(x),
            rows_.binOf(y), x_other, y_other);
    }
  }
}

void RayBins::store(const RayBundle& bundle) {
  const auto bin_at = [this](int column, int row) {
    return static_cast<std::size_t>(row * columns_.bins() + column);
  };
  begin_.assign(bin_at(0, rows_.bins()) + 1, 0);
  forEachRay(bundle, [&](const kernels::BinnedRay& ray, int column, int row, float x, float y) {
    ++begin_[bin_at(column, row) + 1];
    columns_.on_anchor[static_cast<std::size_t>(column)].extend(ray.x);
    columns_.on_other[static_cast<std::size_t>(column)].extend(x);
    rows_.on_anchor[static_cast<std::size_t>(row)].extend(ray.y);
    rows_.on_other[static_cast<std::size_t>(row)].extend(y);
  });
  std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
  std::vector<std::uint32_t> next(begin_.begin(), begin_.end() - 1);
  rays_.resize(begin_.back() + kernels::kRayPadding);
  forEachRay(bundle, [&](const kernels::BinnedRay& ray, int column, int row, float, float) {
    rays_[next[bin_at(column, row)]++] = ray;
  });
  packets_ = {};
}

RayBins::Footprint RayBins::footprintOn(const PlaneRange& planes) const {
  Footprint footprint;
  footprint.planes_ = planes;
  footprint.columns_ = sideOf(columns_, planes);
  footprint.rows_ = sideOf(rows_, planes);
  return footprint;
}

/// Rays run straight: between two planes, a bin's pixels are at most the mean of those on the two.
RayBins::Footprint::Side RayBins::sideOf(const Axis& axis, const PlaneRange& planes) const {
  const auto pixelsAt = [&](std::size_t bin, double inverse_depth) {
    const Range& anchor = axis.on_anchor[bin];
    const Range& other = axis.on_other[bin];
    if (anchor.min > anchor.max || other_ == anchor_) return anchor;
    const auto t = static_cast<float>((inverse_depth - anchor_) / (other_ - anchor_));
    return Range{anchor.min + t * (other.min - anchor.min),
                 anchor.max + t * (other.max - anchor.max)};
  };
  Footprint::Side side;
  for (std::size_t bin = 0; bin < axis.on_anchor.size(); ++bin) {
    const Range first = pixelsAt(bin, planes.first);
    const Range last = pixelsAt(bin, planes.last);
    side.min_from.push_back(std::min(first.min, last.min));
    side.max_until.push_back(std::max(first.max, last.max));
  }
  for (std::size_t bin = 1; bin < side.max_until.size(); ++bin) {
    side.max_until[bin] = std::max(side.max_until[bin], side.max_until[bin - 1]);
    const std::size_t back = side.min_from.size() - 1 - bin;
    side.min_from[back] = std::min(side.min_from[back], side.min_from[back + 1]);
  }
  return side;
}

std::pair<std::size_t, std::size_t> RayBins::Footprint::Side::binsIn(float min, float max) const {
  const auto begin = std::lower_bound(max_until.begin(), max_until.end(), min) - max_until.begin();
  const auto end = std::upper_bound(min_from.begin(), min_from.end(), max) - min_from.begin();
  return {static_cast<std::size_t>(begin), static_cast<std::size_t>(std::max(begin, end))};
}

void RayBins::gather(const Footprint& footprint, const TileCells& tile,
                     const kernels::TileFunctions& functions, bool moving, TileRays& rays) const {
  constexpr double kRounding_px = 0.01;
  const cv::Rect& cells = tile.in_view;
  const auto narrow = [](double value) { return static_cast<float>(value); };
  kernels::GatherRequest request;
  request.to_first = narrow(footprint.planes_.first - anchor_);
  request.to_last = narrow(footprint.planes_.last - anchor_);
  request.moving = moving ? 1.0F : 0.0F;
  request.left = narrow(cells.x - kRounding_px);
  request.right = narrow(cells.x + cells.width + kRounding_px);
  request.top = narrow(cells.y - kRounding_px);
  request.bottom = narrow(cells.y + cells.height + kRounding_px);
  request.origin_x = narrow(tile.origin.x);
  request.origin_y = narrow(tile.origin.y);
  const auto [first_column, end_column] = footprint.columns_.binsIn(request.left, request.right);
  const auto [first_row, end_row] = footprint.rows_.binsIn(request.top, request.bottom);
  for (std::size_t row = first_row; row < end_row; ++row) {
    const std::size_t bin = row * columns_.on_anchor.size();
    const std::uint32_t begin = begin_[bin + first_column];
    const std::size_t count = begin_[bin + end_column] - begin;
    if (count == 0) continue;
    rays.reserve(count);
    rays.resize(functions.gather(rays_.data() + begin, count, request, rays.view()));
  }
}

}  // namespace efm
