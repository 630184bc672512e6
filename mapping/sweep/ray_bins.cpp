// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/sweep/ray_bins.h"

#include <tbb/parallel_for_each.h>

#include <cmath>
#include <map>
#include <numeric>
#include <tuple>

namespace efm {
namespace {

/// Side of a bin, and largest distance between packets of one `RayBins`. Smaller bins are more
/// numerous, larger bins have more rays that a tile does not see.
constexpr double kBin_px = 16;
/// Average number of rays per bin. Fewer rays do not fill a vector.
constexpr double kRaysPerBin = 8;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Returns a packet's transfer to a plane: the scale and the shift (px) of the principal point.
Eigen::Array3d transferAt(const RayPacket& packet, const ReferenceView& view,
                          double inverse_depth) {
  const PlaneTransfer to = transferToPlane(packet, view, 1 / inverse_depth);
  return {to.scale, to.offset_x + (to.scale - 1) * view.cx, to.offset_y + (to.scale - 1) * view.cy};
}

/// The largest distance between pixels that packets give to the same ray, over the planes. Rays are
/// up to half a view from the principal point.
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

PlaneRange planesInFront(const RayPacket& packet, const DsiGrid& grid) {
  const int count = grid.planes.size();
  const auto in_front = [&](int plane) {
    return transferToPlane(packet, grid.view, grid.planes.depth(plane)).in_front;
  };
  // Forward rays run from their camera to farther planes, backward rays to nearer planes.
  if (in_front(packet.forward ? 0 : count - 1)) return {grid.planes, 0, count};
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

RayBins::Axis::Axis(const Range& pixels, float side) : begin(pixels.min), bins_per_pixel(1 / side) {
  const float count = std::floor(std::max(0.0F, pixels.max - pixels.min) / side) + 1;
  last_bin = count - 1;
  on_anchor.resize(static_cast<std::size_t>(count));
  on_other.resize(static_cast<std::size_t>(count));
}

RayBins::Directions::Directions(const RayBundle& rays) {
  // The range of a sample of rays: rays beyond it are in the outermost bins.
  constexpr std::size_t kStep = 16;
  const auto rangeOf = [](const std::vector<float>& values) {
    Range range;
    for (std::size_t i = 0; i < values.size(); i += kStep)
      range.extend(values[i]);  // NaN changes nothing
    return range;
  };
  x = rangeOf(rays.x_inf);
  y = rangeOf(rays.y_inf);
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
  const Directions directions(rays);
  std::vector<RayBins> all;
  for (const auto& [key, packets] : in_front) {
    const int begin = std::get<1>(key);
    const int end = std::get<2>(key);
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
      all.push_back(RayBins(planes, {first, packet}, grid, directions));
    }
  }
  tbb::parallel_for_each(all, [&rays](RayBins& bins) { bins.store(rays); });
  return all;
}

RayBins::RayBins(const PlaneRange& planes, std::vector<RayPacket> packets, const DsiGrid& grid,
                 const Directions& directions)
    : planes_(planes), packets_(std::move(packets)), view_(grid.view) {
  const ReferenceView& view = view_;
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
  to_pixels_ = pixelPlane(grid.planes) - anchor_;
  columns_ = axisOf(1, view.width, view.cx, directions.x, count);
  rows_ = axisOf(2, view.height, view.cy, directions.y, count);
}

RayBins::Transfer RayBins::toOther(const RayPacket& packet, Eigen::Index axis,
                                   double principal) const {
  const Eigen::Array3d anchor = transferAt(packet, view_, anchor_);
  const Eigen::Array3d other = transferAt(packet, view_, other_);
  const double scale = other[0] / anchor[0];
  return {scale, principal + other[axis] - scale * (principal + anchor[axis])};
}

/// Returns bins for the anchor-plane pixels of all rays that are inside the view on some plane. A
/// ray is farthest from the view at one of the two ends of the planes.
RayBins::Axis RayBins::axisOf(Eigen::Index axis, int pixels, double principal,
                              const Range& at_infinity, std::size_t rays) const {
  double in_view_min = 0;
  double in_view_max = pixels;
  double min = kInfinity;
  double max = -kInfinity;
  double widening = 1;  // from the anchor plane to the other end
  for (const RayPacket& packet : packets_) {
    const Transfer to = toOther(packet, axis, principal);
    in_view_min = std::min(in_view_min, (0 - to.offset) / to.scale);
    in_view_max = std::max(in_view_max, (pixels - to.offset) / to.scale);
    const Eigen::Array3d anchor = transferAt(packet, view_, anchor_);
    for (const float u : {at_infinity.min, at_infinity.max}) {
      const double pixel = principal + anchor[0] * (double{u} - principal) + anchor[axis];
      min = std::min(min, pixel);
      max = std::max(max, pixel);
    }
    widening = std::max(widening, to.scale);
  }
  const Range range{static_cast<float>(std::max(min, in_view_min)),
                    static_cast<float>(std::min(max, in_view_max))};
  // Number of bins along each axis, so that a bin has kRaysPerBin rays on average.
  const double bins = std::max(1.0, std::sqrt(static_cast<double>(rays) / kRaysPerBin));
  const double width = std::max(double{range.max - range.min}, 1.0);
  const double side = std::max(kBin_px / widening, width / bins);
  return {range, static_cast<float>(side)};
}

void RayBins::store(const RayBundle& bundle) {
  struct ToPlane {
    ToPlane(const RayPacket& packet, const ReferenceView& view, double inverse_depth) {
      const PlaneTransfer to = transferToPlane(packet, view, 1 / inverse_depth);
      scale = static_cast<float>(to.scale);
      x = static_cast<float>(to.offset_x);
      y = static_cast<float>(to.offset_y);
    }
    float scale, x, y;
  };
  const auto crosses = [](float a, float b, int pixels) {
    constexpr float kRounding_px = 0.01F;
    constexpr float kFinite = 1e30F;
    const float min = std::min(a, b);
    const float max = std::max(a, b);
    return (max >= -kRounding_px) & (min <= static_cast<float>(pixels - 1) + kRounding_px) &
           (max - min < kFinite);
  };
  struct Crossing {  // a ray that crosses the view
    kernels::BinnedRay ray;
    std::uint32_t bin;
  };
  std::vector<Crossing> crossing;  // 20 bytes a ray: computing them twice is slower
  std::size_t count = 0;
  for (const RayPacket& packet : packets_) count += packet.end - packet.begin;
  crossing.reserve(count);
  const std::size_t columns = columns_.bins();
  begin_.assign(rows_.bins() * columns + 1, 0);
  float max_shift = 0;
  for (const RayPacket& packet : packets_) {
    const ToPlane anchor(packet, view_, anchor_);
    const ToPlane other(packet, view_, other_);
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
      if (!(crosses(x, x_other, view_.width) & crosses(y, y_other, view_.height))) continue;
      const kernels::BinnedRay ray{x, y, a - c * x_inf, b - c * y_inf};
      const std::size_t column = columns_.binOf(x);
      const std::size_t row = rows_.binOf(y);
      max_shift = std::max({max_shift, std::abs(ray.dx), std::abs(ray.dy)});
      columns_.on_anchor[column].extend(x);
      columns_.on_other[column].extend(x_other);
      rows_.on_anchor[row].extend(y);
      rows_.on_other[row].extend(y_other);
      crossing.push_back({ray, static_cast<std::uint32_t>(row * columns + column)});
      ++begin_[crossing.back().bin + 1];
    }
  }
  std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
  std::vector<std::uint32_t> next(begin_.begin(), begin_.end() - 1);
  rays_.resize(begin_.back() + kernels::kRayPadding);
  for (const auto& [ray, bin] : crossing) rays_[next[bin]++] = ray;
  packets_ = {};
  constexpr double kMaxDistance_px = 8192;  // floats have a resolution of 1/2048 px there
  moving_ = double{max_shift} * std::abs(to_pixels_) <= kMaxDistance_px;
}

RayBins::Footprint RayBins::footprintOn(const PlaneRange& planes) const {
  Footprint footprint;
  footprint.planes_ = planes;
  footprint.columns_ = sideOf(columns_, planes);
  footprint.rows_ = sideOf(rows_, planes);
  return footprint;
}

/// Rays are straight: on a plane between the two ends, pixels are weighted means of the pixels at
/// both ends.
RayBins::Footprint::Side RayBins::sideOf(const Axis& axis, const PlaneRange& planes) const {
  const auto pixelsOn = [&](std::size_t bin, double inverse_depth) {
    const Range& anchor = axis.on_anchor[bin];
    const Range& other = axis.on_other[bin];
    if (anchor.min > anchor.max || other_ == anchor_) return anchor;
    const auto t = static_cast<float>((inverse_depth - anchor_) / (other_ - anchor_));
    return Range{anchor.min + t * (other.min - anchor.min),
                 anchor.max + t * (other.max - anchor.max)};
  };
  Footprint::Side side;
  for (std::size_t bin = 0; bin < axis.bins(); ++bin) {
    const Range first = pixelsOn(bin, planes.first);
    const Range last = pixelsOn(bin, planes.last);
    side.min_from.push_back(std::min(first.min, last.min));
    side.max_until.push_back(std::max(first.max, last.max));
  }
  for (std::size_t bin = 1; bin < axis.bins(); ++bin) {
    side.max_until[bin] = std::max(side.max_until[bin], side.max_until[bin - 1]);
    const std::size_t back = axis.bins() - 1 - bin;
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
                     const kernels::TileFunctions& functions, TileRays& rays) const {
  constexpr double kRounding_px = 0.01;
  constexpr std::uint32_t kRaysPerLine = 64 / sizeof(kernels::BinnedRay);
  static_assert(kRaysPerLine > 0);
  constexpr std::uint32_t kPrefetchedRays = 64 * kRaysPerLine;
  const cv::Rect& cells = tile.in_view;
  const auto narrow = [](double value) { return static_cast<float>(value); };
  kernels::GatherRequest request;
  request.to_first = narrow(footprint.planes_.first - anchor_);
  request.to_last = narrow(footprint.planes_.last - anchor_);
  request.to_pixels = moving_ ? narrow(to_pixels_) : request.to_first;
  request.moving = moving_ ? 1.0F : 0.0F;
  request.left = narrow(cells.x - kRounding_px);
  request.right = narrow(cells.x + cells.width + kRounding_px);
  request.top = narrow(cells.y - kRounding_px);
  request.bottom = narrow(cells.y + cells.height + kRounding_px);
  request.origin_x = narrow(tile.origin.x);
  request.origin_y = narrow(tile.origin.y);
  const auto [first_column, end_column] = footprint.columns_.binsIn(request.left, request.right);
  const auto [first_row, end_row] = footprint.rows_.binsIn(request.top, request.bottom);
  for (std::size_t row = first_row; row < end_row; ++row) {
    const std::size_t bin = row * columns_.bins();
    const std::uint32_t begin = begin_[bin + first_column];
    const std::size_t count = begin_[bin + end_column] - begin;
    if (row + 1 < end_row) {  // rows are far apart in memory
      const std::uint32_t* next = &begin_[bin + columns_.bins()];
      const std::uint32_t end = std::min(next[end_column], next[first_column] + kPrefetchedRays);
      for (std::uint32_t ray = next[first_column]; ray < end; ray += kRaysPerLine) {
        __builtin_prefetch(&rays_[ray]);
      }
    }
    if (count == 0) continue;
    rays.reserve(count);
    rays.resize(functions.gather(rays_.data() + begin, count, request, rays.view()));
  }
}

}  // namespace efm
