// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/sweep/ray_bins.h"

#include <tbb/parallel_for_each.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

namespace efm {
namespace {

/// Side of a bin. Smaller bins are more, larger bins have more rays that a tile does not see.
constexpr double kBin_px = 16;
/// The largest difference of a compact ray from the common shift, in units.
constexpr double kMaxOwnShift = 32'000;
/// The widest margin of bins around the view where rays are compact.
constexpr double kMaxMargin_px = 2048;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

bool isInFront(const RayPacket& packet, const DsiGrid& grid, int plane) {
  return transferToPlane(packet, grid.view, grid.planes.depth(plane)).in_front;
}

/// How far from the view a ray that is inside it on some plane can meet the anchor plane, in
/// pixels. From its pixel u on a plane it moves by (f C_x - C_z u) / (1 - C_z/Z) per unit of
/// inverse depth; the maximum lies at the ends of the ranges of planes and u.
double marginOf(const RayPacket& packet, const DsiGrid& grid, double anchor) {
  const ReferenceView& view = grid.view;
  const double cz = packet.center_ref.z();
  double margin = 0;
  for (const int plane : {0, grid.planes.size() - 1}) {
    const double at = 1 / grid.planes.depth(plane);
    if (!isInFront(packet, grid, plane)) return kInfinity;
    const double step = std::abs((at - anchor) / (1 - cz * at));
    const auto extend = [&](double shift_at_center, double u) {
      margin = std::max(margin, step * std::abs(shift_at_center - cz * u));
    };
    for (const double x : {0, view.width}) extend(view.fx * packet.center_ref.x(), x - view.cx);
    for (const double y : {0, view.height}) extend(view.fy * packet.center_ref.y(), y - view.cy);
  }
  return margin;
}

/// The kind of a packet's rays; none where all planes are behind the camera.
std::optional<RayBins::Kind> kindOf(const RayPacket& packet, const DsiGrid& grid) {
  const bool near = isInFront(packet, grid, 0);
  const bool far = isInFront(packet, grid, grid.planes.size() - 1);
  if (near && far && marginOf(packet, grid, RayBins::middleAnchor(grid.planes)) <= kMaxMargin_px) {
    return RayBins::Kind::kAllPlanes;
  }
  if (far && packet.forward) return RayBins::Kind::kFarPlanes;
  if (near && !packet.forward) return RayBins::Kind::kNearPlanes;
  return std::nullopt;
}

double anchorOf(RayBins::Kind kind, const DepthPlanes& planes) {
  switch (kind) {
    case RayBins::Kind::kAllPlanes:
      return RayBins::middleAnchor(planes);
    case RayBins::Kind::kFarPlanes:
      return 1 / planes.depth(planes.size() - 1);
    case RayBins::Kind::kNearPlanes:
      return 1 / planes.depth(0);
  }
  return 0;
}

}  // namespace

void RayBins::Range::extend(double value) {
  min = std::min(min, value);
  max = std::max(max, value);
}

double RayBins::middleAnchor(const DepthPlanes& planes) {
  return 0.5 * (1 / planes.depth(0) + 1 / planes.depth(planes.size() - 1));
}

RayBins::Shift RayBins::shiftFrom(const RayPacket& packet, const ReferenceView& view,
                                  double anchor) {
  const Eigen::Vector3d& center = packet.center_ref;
  const double scale = 1 - center.z() * anchor;
  return {view.fx * center.x() / scale, view.fy * center.y() / scale, center.z() / scale};
}

/// The end of an interval of time in which the camera moves so little that the rays of a bin stay
/// together on all planes, to within its side. Their differences from the common shift are small
/// then, and the unit of these is fine.
RayBins::PacketIterator RayBins::endOfSlowMotion(PacketIterator packet, PacketIterator end,
                                                 const DsiGrid& grid) {
  const DepthPlanes& planes = grid.planes;
  const double anchor = middleAnchor(planes);
  const double half_range = 0.5 * (1 / planes.depth(0) - 1 / planes.depth(planes.size() - 1));
  Range a{kInfinity, -kInfinity};
  Range b = a;
  Range c = a;
  double margin = 0;
  for (; packet != end; ++packet) {
    const Shift shift = shiftFrom(*packet, grid.view, anchor);
    a.extend(shift.a);
    b.extend(shift.b);
    c.extend(shift.c);
    margin = std::max(margin, marginOf(*packet, grid, anchor));
    const double along_x = a.width() + c.width() * (grid.view.width + margin);
    const double along_y = b.width() + c.width() * (grid.view.height + margin);
    if (std::max(along_x, along_y) * half_range > kBin_px) break;  // never at the first
  }
  return packet;
}

std::vector<RayBins> RayBins::sort(const RayBundle& rays, const DsiGrid& grid) {
  constexpr Kind kKinds[] = {Kind::kAllPlanes, Kind::kFarPlanes, Kind::kNearPlanes};
  std::array<std::vector<RayPacket>, std::size(kKinds)> packets;
  for (const RayPacket& packet : rays.packets) {
    const auto kind = kindOf(packet, grid);
    if (kind) packets[static_cast<std::size_t>(*kind)].push_back(packet);
  }
  std::vector<RayBins> all;
  for (const Kind kind : kKinds) {
    const std::vector<RayPacket>& of_kind = packets[static_cast<std::size_t>(kind)];
    for (auto begin = of_kind.begin(); begin != of_kind.end();) {
      const auto end =
          kind == Kind::kAllPlanes ? endOfSlowMotion(begin, of_kind.end(), grid) : of_kind.end();
      all.push_back(RayBins(kind, std::vector<RayPacket>(begin, end), grid));
      begin = end;
    }
  }
  tbb::parallel_for_each(all, [&rays](RayBins& bins) {
    bins.countRays(rays);
    bins.onAllPlanes() ? bins.storeCompact(rays) : bins.storeWide(rays);
  });
  return all;
}

RayBins::RayBins(Kind kind, std::vector<RayPacket> packets, const DsiGrid& grid)
    : kind_(kind),
      view_(grid.view),
      anchor_(anchorOf(kind, grid.planes)),
      packets_(std::move(packets)) {
  columns_.principal = view_.cx;
  columns_.pixels = view_.width;
  rows_.principal = view_.cy;
  rows_.pixels = view_.height;
  c_ = columns_.at_center = rows_.at_center = {kInfinity, -kInfinity};
  for (const RayPacket& packet : packets_) {
    const Shift shift = shiftOf(packet);
    columns_.at_center.extend(shift.a);
    rows_.at_center.extend(shift.b);
    c_.extend(shift.c);
  }
  spanBins(grid);
}

RayBins::Shift RayBins::shiftOf(const RayPacket& packet) const {
  return shiftFrom(packet, view_, anchor_);
}

RayBins::Range RayBins::Axis::fromPrincipal() const {
  return {begin - principal, begin + bins * kBin_px - principal};
}

/// Lays bins over the view and a margin. The margin holds all compact rays. Of wide rays, the
/// outermost bins also hold those beyond it.
void RayBins::spanBins(const DsiGrid& grid) {
  double margin = kMaxMargin_px;
  if (onAllPlanes()) {
    margin = 0;
    for (const RayPacket& packet : packets_) {
      margin = std::max(margin, marginOf(packet, grid, anchor_));
    }
  }
  const double border = kBin_px * std::ceil((margin + 1) / kBin_px);
  for (Axis* axis : {&columns_, &rows_}) {
    axis->begin = -border;
    axis->bins = static_cast<int>(std::ceil((axis->pixels + 2 * border) / kBin_px));
    // Two shifts at the same pixel differ most where |u| is largest.
    const Range u = axis->fromPrincipal();
    const double max_difference = 0.5 * axis->at_center.width() +
                                  0.5 * c_.width() * std::max(std::abs(u.min), std::abs(u.max));
    axis->step = max_difference / kMaxOwnShift;
  }
}

/// Visits the rays packet by packet. visit(packet) returns the function that visits a ray of the
/// packet: f(bin, column, row, index), with the ray's position in columns and rows of bins.
template <typename Visit>
void RayBins::forEachRay(const RayBundle& rays, const Visit& visit) const {
  const auto columns = static_cast<float>(columns_.bins);
  const auto rows = static_cast<float>(rows_.bins);
  for (const RayPacket& packet : packets_) {
    const PlaneTransfer to_anchor = transferToPlane(packet, view_, 1 / anchor_);
    const auto scale = static_cast<float>(to_anchor.scale / kBin_px);
    const auto offset_x = static_cast<float>((to_anchor.offset_x - columns_.begin) / kBin_px);
    const auto offset_y = static_cast<float>((to_anchor.offset_y - rows_.begin) / kBin_px);
    const auto visit_ray = visit(packet);
    for (std::size_t i = packet.begin; i < packet.end; ++i) {
      float column = scale * rays.x_inf[i] + offset_x;
      float row = scale * rays.y_inf[i] + offset_y;
      if (!(column >= 0 && column < columns && row >= 0 && row < rows)) {
        if (onAllPlanes() || !std::isfinite(column) || !std::isfinite(row)) continue;
        column = std::clamp(column, 0.0F, columns - 1);
        row = std::clamp(row, 0.0F, rows - 1);
      }
      visit_ray(binAt(static_cast<int>(column), static_cast<int>(row)), column, row, i);
    }
  }
}

void RayBins::countRays(const RayBundle& rays) {
  begin_.assign(binAt(0, rows_.bins) + 1, 0);
  forEachRay(rays, [this](const RayPacket&) {
    return [this](std::size_t bin, float, float, std::size_t) { ++begin_[bin + 1]; };
  });
  std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
}

void RayBins::storeCompact(const RayBundle& rays) {
  const auto within_bin = [](float position) {
    return static_cast<std::uint16_t>((position - static_cast<float>(static_cast<int>(position))) *
                                      65536.0F);
  };
  // A ray's difference from the common shift in units, linear in its position.
  struct OwnShift {
    float at_zero = 0;
    float gradient = 0;
    std::int16_t operator()(float position) const {
      constexpr float kToNearest = 32768.5F;  // makes numbers positive before they are rounded
      return static_cast<std::int16_t>(
          static_cast<int>(at_zero + gradient * position + kToNearest) - 32768);
    }
  };
  const auto own_shift = [this](const Axis& axis, double at_center, double c) {
    if (axis.step == 0) return OwnShift();
    const double gradient = (c_.middle() - c) / axis.step;
    const double center = (at_center - axis.at_center.middle()) / axis.step;
    return OwnShift{static_cast<float>(center + gradient * (axis.begin - axis.principal)),
                    static_cast<float>(gradient * kBin_px)};
  };
  std::vector<std::size_t> next(begin_.begin(), begin_.end() - 1);
  compact_.resize(begin_.back() + kernels::kRayPadding);
  forEachRay(rays, [&](const RayPacket& packet) {
    const Shift shift = shiftOf(packet);
    return [&, dx = own_shift(columns_, shift.a, shift.c), dy = own_shift(rows_, shift.b, shift.c)](
               std::size_t bin, float column, float row, std::size_t) {
      compact_[next[bin]++] = {within_bin(column), within_bin(row), dx(column), dy(row)};
    };
  });
}

void RayBins::storeWide(const RayBundle& rays) {
  std::vector<std::size_t> next(begin_.begin(), begin_.end() - 1);
  wide_.resize(begin_.back());
  forEachRay(rays, [&](const RayPacket& packet) {
    const auto index = static_cast<std::uint32_t>(&packet - packets_.data());
    return [&, index](std::size_t bin, float, float, std::size_t ray) {
      wide_[next[bin]++] = {rays.x_inf[ray], rays.y_inf[ray], index};
    };
  });
}

double RayBins::maxShift() const {
  const auto max_abs = [](const Range& range) {
    return std::max(std::abs(range.min), std::abs(range.max));
  };
  const auto along = [&](const Axis& axis) {
    return max_abs(axis.at_center) + max_abs(c_) * max_abs(axis.fromPrincipal());
  };
  return std::max(along(columns_), along(rows_));
}

RayBins::Footprint RayBins::footprintIn(const PlaneRange& group) const {
  Footprint footprint;
  footprint.group_ = group;
  footprint.columns_ = footprintAlong(columns_, group);
  footprint.rows_ = footprintAlong(rows_, group);
  if (onAllPlanes()) return footprint;
  for (const RayPacket& packet : packets_) {
    footprint.transfers_.push_back(transferToPlane(packet, view_, group.first_depth_m));
  }
  return footprint;
}

std::vector<RayBins::Range> RayBins::footprintAlong(const Axis& axis,
                                                    const PlaneRange& group) const {
  const auto rangeOf = [](std::initializer_list<double> values) {
    const auto [min, max] = std::minmax(values);
    return Range{min, max};
  };
  const double to_first = 1 / group.first_depth_m - anchor_;
  const double to_last = 1 / group.last_depth_m - anchor_;
  std::vector<Range> footprint(static_cast<std::size_t>(axis.bins));
  for (int bin = 0; bin < axis.bins; ++bin) {
    const double begin = axis.begin + bin * kBin_px;
    const double u0 = begin - axis.principal;
    const double u1 = u0 + kBin_px;
    const Range cu = rangeOf({c_.min * u0, c_.min * u1, c_.max * u0, c_.max * u1});
    const Range shift{axis.at_center.min - cu.max, axis.at_center.max - cu.min};
    const Range moved = rangeOf(
        {to_first * shift.min, to_first * shift.max, to_last * shift.min, to_last * shift.max});
    const bool open = !onAllPlanes() && (bin == 0 || bin == axis.bins - 1);
    footprint[static_cast<std::size_t>(bin)] =
        open ? Range{-kInfinity, kInfinity} : Range{begin + moved.min, begin + kBin_px + moved.max};
  }
  return footprint;
}

void RayBins::gather(const Footprint& footprint, const TileCells& tile,
                     const kernels::TileFunctions& functions, TileRays& rays) const {
  constexpr double kRounding_px = 0.01;  // coordinates are rounded to 1/4096 px later
  constexpr double kHalfUnit_px = 0.5 / 4096;
  const cv::Rect& cells = tile.in_view;
  const auto narrow = [](double value) { return static_cast<float>(value); };
  kernels::GatherRequest request;
  request.cx = narrow(view_.cx);
  request.cy = narrow(view_.cy);
  request.a = narrow(columns_.at_center.middle());
  request.b = narrow(rows_.at_center.middle());
  request.c = narrow(c_.middle());
  request.step_x = narrow(columns_.step);
  request.step_y = narrow(rows_.step);
  request.to_first = narrow(1 / footprint.group_.first_depth_m - anchor_);
  request.to_last = narrow(1 / footprint.group_.last_depth_m - anchor_);
  request.left = narrow(cells.x - kRounding_px);
  request.right = narrow(cells.x + cells.width + kRounding_px);
  request.top = narrow(cells.y - kRounding_px);
  request.bottom = narrow(cells.y + cells.height + kRounding_px);
  request.origin_x = narrow(tile.origin.x);
  request.origin_y = narrow(tile.origin.y);

  const auto touches = [](const Range& bin, float min, float max) {
    return bin.max >= min && bin.min <= max;
  };
  for (int row = 0; row < rows_.bins; ++row) {
    if (!touches(footprint.rows_[static_cast<std::size_t>(row)], request.top, request.bottom))
      continue;
    request.corner_y = narrow(rows_.begin + row * kBin_px + kHalfUnit_px);
    for (int column = 0; column < columns_.bins; ++column) {
      const Range& bin_columns = footprint.columns_[static_cast<std::size_t>(column)];
      if (!touches(bin_columns, request.left, request.right)) continue;
      request.corner_x = narrow(columns_.begin + column * kBin_px + kHalfUnit_px);
      const std::size_t bin = binAt(column, row);
      const std::size_t count = begin_[bin + 1] - begin_[bin];
      if (count == 0) continue;
      rays.reserve(count);
      if (onAllPlanes()) {
        rays.resize(functions.gather(compact_.data() + begin_[bin], count, request, rays.view()));
      } else {
        gatherWide(footprint, bin, request, rays);
      }
    }
  }
}

/// Gathers rays that need not be on all planes, by their pixel on the group's one plane, which the
/// plain kernel computes alike.
void RayBins::gatherWide(const Footprint& footprint, std::size_t bin,
                         const kernels::GatherRequest& request, TileRays& rays) const {
  constexpr auto kScale = static_cast<float>(1 << kernels::kFractionBits);
  for (std::size_t i = begin_[bin]; i < begin_[bin + 1]; ++i) {
    const WideRay& ray = wide_[i];
    const PlaneTransfer& transfer = footprint.transfers_[ray.packet];
    if (!transfer.in_front) continue;
    const float x =
        static_cast<float>(transfer.scale) * ray.x_inf + static_cast<float>(transfer.offset_x);
    const float y =
        static_cast<float>(transfer.scale) * ray.y_inf + static_cast<float>(transfer.offset_y);
    if (x >= request.left && x < request.right && y >= request.top && y < request.bottom) {
      rays.add((x - request.origin_x) * kScale, (y - request.origin_y) * kScale);
    }
  }
}

}  // namespace efm
