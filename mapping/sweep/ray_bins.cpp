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

/// Side of a bin. Smaller ones give more bins, larger ones more rays to look at that are not near.
constexpr double kBin_px = 16;
/// Of a compact ray's own shift, in units.
constexpr double kLargestOwnShift = 32'000;
/// Room for bins around the view, at most, where rays are compact.
constexpr double kWidestMargin_px = 2048;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

bool isInFront(const RayPacket& packet, const ReferenceView& view, double depth_m) {
  return transferToPlane(packet, view, depth_m).in_front;
}

/// How far from the view a ray of the packet that is inside it on some plane can meet the home
/// plane, in pixels. From a plane on which it is at u it moves by (f C_x - C_z u) / (1 - C_z/Z) per
/// unit of inverse depth; the largest lies at the ends of what planes and u can be.
double marginOf(const RayPacket& packet, const ReferenceView& view, double home,
                const DepthPlanes& planes) {
  double margin = 0;
  const double cz = packet.center_ref.z();
  for (const int plane : {0, planes.size() - 1}) {
    const double at = 1 / planes.depth(plane);
    if (!isInFront(packet, view, planes.depth(plane))) return kInfinity;
    const double step = std::abs((at - home) / (1 - cz * at));
    const auto reach = [&](double shift_at_center, double u) {
      margin = std::max(margin, step * std::abs(shift_at_center - cz * u));
    };
    for (const double x : {0, view.width}) reach(view.fx * packet.center_ref.x(), x - view.cx);
    for (const double y : {0, view.height}) reach(view.fy * packet.center_ref.y(), y - view.cy);
  }
  return margin;
}

/// The kind of a packet's rays; none where they are on no plane before the camera.
std::optional<RayBins::Kind> kindOf(const RayPacket& packet, const ReferenceView& view,
                                    const DepthPlanes& planes) {
  const bool near = isInFront(packet, view, planes.depth(0));
  const bool far = isInFront(packet, view, planes.depth(planes.size() - 1));
  if (near && far &&
      marginOf(packet, view, RayBins::middleOf(planes), planes) <= kWidestMargin_px) {
    return RayBins::Kind::kAllPlanes;
  }
  if (far && packet.forward) return RayBins::Kind::kFarPlanes;
  if (near && !packet.forward) return RayBins::Kind::kNearPlanes;
  return std::nullopt;
}

double homeOf(RayBins::Kind kind, const DepthPlanes& planes) {
  switch (kind) {
    case RayBins::Kind::kAllPlanes:
      return RayBins::middleOf(planes);
    case RayBins::Kind::kFarPlanes:
      return 1 / planes.depth(planes.size() - 1);
    case RayBins::Kind::kNearPlanes:
      return 1 / planes.depth(0);
  }
  return 0;
}

}  // namespace

void RayBins::Range::extend(double value) {
  least = std::min(least, value);
  greatest = std::max(greatest, value);
}

double RayBins::middleOf(const DepthPlanes& planes) {
  return 0.5 * (1 / planes.depth(0) + 1 / planes.depth(planes.size() - 1));
}

RayBins::Shift RayBins::shiftFrom(const RayPacket& packet, const ReferenceView& view, double home) {
  const Eigen::Vector3d& center = packet.center_ref;
  const double scale = 1 - center.z() * home;
  return {view.fx * center.x() / scale, view.fy * center.y() / scale, center.z() / scale};
}

/// A stretch of time in which the camera moves so little that rays of a bin stay together on all
/// planes, to within its side. A ray's own shift is small then, and its unit fine.
std::vector<RayPacket>::const_iterator RayBins::endOfSlowMotion(
    std::vector<RayPacket>::const_iterator packet, std::vector<RayPacket>::const_iterator end,
    const ReferenceView& view, const DepthPlanes& planes) {
  const double home = middleOf(planes);
  const double half_range = 0.5 * (1 / planes.depth(0) - 1 / planes.depth(planes.size() - 1));
  Range a{kInfinity, -kInfinity};
  Range b = a;
  Range c = a;
  double margin = 0;
  for (; packet != end; ++packet) {
    const Shift shift = shiftFrom(*packet, view, home);
    a.extend(shift.a);
    b.extend(shift.b);
    c.extend(shift.c);
    margin = std::max(margin, marginOf(*packet, view, home, planes));
    const double along_x = a.width() + c.width() * (view.width + margin);
    const double along_y = b.width() + c.width() * (view.height + margin);
    if (std::max(along_x, along_y) * half_range > kBin_px) break;  // never at the first
  }
  return packet;
}

std::vector<RayBins> RayBins::sort(const RayBundle& rays, const ReferenceView& view,
                                   const DepthPlanes& planes) {
  constexpr Kind kKinds[] = {Kind::kAllPlanes, Kind::kFarPlanes, Kind::kNearPlanes};
  std::array<std::vector<RayPacket>, std::size(kKinds)> packets;
  for (const RayPacket& packet : rays.packets) {
    const auto kind = kindOf(packet, view, planes);
    if (kind) packets[static_cast<std::size_t>(*kind)].push_back(packet);
  }
  std::vector<RayBins> all;
  for (const Kind kind : kKinds) {
    const std::vector<RayPacket>& of_kind = packets[static_cast<std::size_t>(kind)];
    for (auto begin = of_kind.begin(); begin != of_kind.end();) {
      const auto end = kind == Kind::kAllPlanes
                           ? endOfSlowMotion(begin, of_kind.end(), view, planes)
                           : of_kind.end();
      all.push_back(RayBins(kind, std::vector<RayPacket>(begin, end), view, planes));
      begin = end;
    }
  }
  tbb::parallel_for_each(all, [&rays](RayBins& bins) {
    bins.count(rays);
    bins.place(rays);
  });
  return all;
}

RayBins::RayBins(Kind kind, std::vector<RayPacket> packets, const ReferenceView& view,
                 const DepthPlanes& planes)
    : kind_(kind), view_(view), home_(homeOf(kind, planes)), packets_(std::move(packets)) {
  columns_.principal = view.cx;
  columns_.pixels = view.width;
  rows_.principal = view.cy;
  rows_.pixels = view.height;
  c_ = columns_.at_center = rows_.at_center = {kInfinity, -kInfinity};
  for (const RayPacket& packet : packets_) {
    const Shift shift = shiftOf(packet);
    columns_.at_center.extend(shift.a);
    rows_.at_center.extend(shift.b);
    c_.extend(shift.c);
  }
  spanBins(planes);
}

RayBins::Shift RayBins::shiftOf(const RayPacket& packet) const {
  return shiftFrom(packet, view_, home_);
}

RayBins::Range RayBins::Axis::fromPrincipal() const {
  return {begin - principal, begin + bins * kBin_px - principal};
}

/// Bins over the view and a margin: of compact rays, wide enough for all of them; otherwise the
/// outermost bins also hold what lies outside.
void RayBins::spanBins(const DepthPlanes& planes) {
  double margin = kWidestMargin_px;
  if (onAllPlanes()) {
    margin = 0;
    for (const RayPacket& packet : packets_) {
      margin = std::max(margin, marginOf(packet, view_, home_, planes));
    }
  }
  const double border = kBin_px * std::ceil((margin + 1) / kBin_px);
  for (Axis* axis : {&columns_, &rows_}) {
    axis->begin = -border;
    axis->bins = static_cast<int>(std::ceil((axis->pixels + 2 * border) / kBin_px));
    // The largest difference of two shifts in the same place is that of the largest number.
    const Range u = axis->fromPrincipal();
    const double largest = 0.5 * axis->at_center.width() +
                           0.5 * c_.width() * std::max(std::abs(u.least), std::abs(u.greatest));
    axis->step = largest / kLargestOwnShift;
  }
}

/// For every packet, visit(packet) gives what is called for each of its rays: with the bin, the
/// place in columns and rows of bins, and the ray's index.
template <typename Visit>
void RayBins::forEachRay(const RayBundle& rays, const Visit& visit) const {
  const auto columns = static_cast<float>(columns_.bins);
  const auto rows = static_cast<float>(rows_.bins);
  for (const RayPacket& packet : packets_) {
    const PlaneTransfer to_home = transferToPlane(packet, view_, 1 / home_);
    const auto scale = static_cast<float>(to_home.scale / kBin_px);
    const auto offset_x = static_cast<float>((to_home.offset_x - columns_.begin) / kBin_px);
    const auto offset_y = static_cast<float>((to_home.offset_y - rows_.begin) / kBin_px);
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

void RayBins::count(const RayBundle& rays) {
  begin_.assign(binAt(0, rows_.bins) + 1, 0);
  forEachRay(rays, [this](const RayPacket&) {
    return [this](std::size_t bin, float, float, std::size_t) { ++begin_[bin + 1]; };
  });
  std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
}

void RayBins::place(const RayBundle& rays) {
  if (onAllPlanes()) {
    placeCompact(rays);
  } else {
    placeWide(rays);
  }
}

void RayBins::placeCompact(const RayBundle& rays) {
  const auto within_bin = [](float place) {
    return static_cast<std::uint16_t>((place - static_cast<float>(static_cast<int>(place))) *
                                      65536.0F);
  };
  // A ray's own shift in units, linear in its place.
  struct OwnShift {
    float at_zero = 0;
    float slope = 0;
    std::int16_t operator()(float place) const {
      constexpr float kToNearest = 32768.5F;  // of numbers that are above zero then
      return static_cast<std::int16_t>(static_cast<int>(at_zero + slope * place + kToNearest) -
                                       32768);
    }
  };
  const auto own_shift = [this](const Axis& axis, double at_center, double c) {
    if (axis.step == 0) return OwnShift();
    const double slope = (c_.middle() - c) / axis.step;
    const double center = (at_center - axis.at_center.middle()) / axis.step;
    return OwnShift{static_cast<float>(center + slope * (axis.begin - axis.principal)),
                    static_cast<float>(slope * kBin_px)};
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

void RayBins::placeWide(const RayBundle& rays) {
  std::vector<std::size_t> next(begin_.begin(), begin_.end() - 1);
  wide_.resize(begin_.back());
  forEachRay(rays, [&](const RayPacket& packet) {
    const auto index = static_cast<std::uint32_t>(&packet - packets_.data());
    return [&, index](std::size_t bin, float, float, std::size_t ray) {
      wide_[next[bin]++] = {rays.x_inf[ray], rays.y_inf[ray], index};
    };
  });
}

double RayBins::fastestShift() const {
  const auto largest = [](const Range& range) {
    return std::max(std::abs(range.least), std::abs(range.greatest));
  };
  const auto along = [&](const Axis& axis) {
    return largest(axis.at_center) + largest(c_) * largest(axis.fromPrincipal());
  };
  return std::max(along(columns_), along(rows_));
}

RayBins::GroupReach RayBins::reachIn(const PlaneGroup& group) const {
  GroupReach reach;
  reach.group_ = group;
  reach.columns_ = reachAlong(columns_, group);
  reach.rows_ = reachAlong(rows_, group);
  if (onAllPlanes()) return reach;
  for (const RayPacket& packet : packets_) {
    reach.transfers_.push_back(transferToPlane(packet, view_, group.first_depth_m));
  }
  return reach;
}

std::vector<RayBins::Range> RayBins::reachAlong(const Axis& axis, const PlaneGroup& group) const {
  const auto rangeOf = [](std::initializer_list<double> values) {
    const auto [least, greatest] = std::minmax(values);
    return Range{least, greatest};
  };
  const double to_first = 1 / group.first_depth_m - home_;
  const double to_last = 1 / group.last_depth_m - home_;
  std::vector<Range> reach(static_cast<std::size_t>(axis.bins));
  for (int bin = 0; bin < axis.bins; ++bin) {
    const double begin = axis.begin + bin * kBin_px;
    const double u0 = begin - axis.principal;
    const double u1 = u0 + kBin_px;
    const Range cu = rangeOf({c_.least * u0, c_.least * u1, c_.greatest * u0, c_.greatest * u1});
    const Range shift{axis.at_center.least - cu.greatest, axis.at_center.greatest - cu.least};
    const Range moved = rangeOf({to_first * shift.least, to_first * shift.greatest,
                                 to_last * shift.least, to_last * shift.greatest});
    const bool open = !onAllPlanes() && (bin == 0 || bin == axis.bins - 1);
    reach[static_cast<std::size_t>(bin)] =
        open ? Range{-kInfinity, kInfinity}
             : Range{begin + moved.least, begin + kBin_px + moved.greatest};
  }
  return reach;
}

void RayBins::gather(const GroupReach& reach, const cv::Rect& cells, cv::Point origin,
                     const kernels::TileFunctions& functions, TileRays& found) const {
  constexpr double kRounding_px = 0.01;  // coordinates are rounded to 1/4096 px later
  constexpr double kHalfUnit_px = 0.5 / 4096;
  const auto narrow = [](double value) { return static_cast<float>(value); };
  kernels::GatherRequest request;
  request.cx = narrow(view_.cx);
  request.cy = narrow(view_.cy);
  request.a = narrow(columns_.at_center.middle());
  request.b = narrow(rows_.at_center.middle());
  request.c = narrow(c_.middle());
  request.step_x = narrow(columns_.step);
  request.step_y = narrow(rows_.step);
  request.to_first = narrow(1 / reach.group_.first_depth_m - home_);
  request.to_last = narrow(1 / reach.group_.last_depth_m - home_);
  request.left = narrow(cells.x - kRounding_px);
  request.right = narrow(cells.x + cells.width + kRounding_px);
  request.top = narrow(cells.y - kRounding_px);
  request.bottom = narrow(cells.y + cells.height + kRounding_px);
  request.origin_x = narrow(origin.x);
  request.origin_y = narrow(origin.y);

  const auto touches = [](const Range& bin, float least, float greatest) {
    return bin.greatest >= least && bin.least <= greatest;
  };
  for (int row = 0; row < rows_.bins; ++row) {
    if (!touches(reach.rows_[static_cast<std::size_t>(row)], request.top, request.bottom)) continue;
    request.corner_y = narrow(rows_.begin + row * kBin_px + kHalfUnit_px);
    for (int column = 0; column < columns_.bins; ++column) {
      const Range& bin_columns = reach.columns_[static_cast<std::size_t>(column)];
      if (!touches(bin_columns, request.left, request.right)) continue;
      request.corner_x = narrow(columns_.begin + column * kBin_px + kHalfUnit_px);
      const std::size_t bin = binAt(column, row);
      const std::size_t count = begin_[bin + 1] - begin_[bin];
      if (count == 0) continue;
      found.reserve(count);
      if (onAllPlanes()) {
        found.resize(functions.gather(compact_.data() + begin_[bin], count, request, found.view()));
      } else {
        gatherWide(reach, bin, request, found);
      }
    }
  }
}

/// Of rays that need not be on all planes: where they meet the group's one plane, as the plain
/// kernel has it.
void RayBins::gatherWide(const GroupReach& reach, std::size_t bin,
                         const kernels::GatherRequest& request, TileRays& found) const {
  constexpr auto kScale = static_cast<float>(1 << kernels::kFractionBits);
  for (std::size_t i = begin_[bin]; i < begin_[bin + 1]; ++i) {
    const WideRay& ray = wide_[i];
    const PlaneTransfer& transfer = reach.transfers_[ray.packet];
    if (!transfer.in_front) continue;
    const float x =
        static_cast<float>(transfer.scale) * ray.x_inf + static_cast<float>(transfer.offset_x);
    const float y =
        static_cast<float>(transfer.scale) * ray.y_inf + static_cast<float>(transfer.offset_y);
    if (x >= request.left && x < request.right && y >= request.top && y < request.bottom) {
      found.add((x - request.origin_x) * kScale, (y - request.origin_y) * kScale);
    }
  }
}

}  // namespace efm
