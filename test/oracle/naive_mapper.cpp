// SPDX-License-Identifier: BSD-3-Clause
#include "test/oracle/naive_mapper.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace efm::oracle {
namespace {

std::size_t index(const Dsi& dsi, int plane, int x, int y) {
  return (static_cast<std::size_t>(plane) * static_cast<std::size_t>(dsi.height) +
          static_cast<std::size_t>(y)) *
             static_cast<std::size_t>(dsi.width) +
         static_cast<std::size_t>(x);
}

void vote(const Eigen::Vector3d& center, const Eigen::Vector3d& direction, double depth_m,
          const ReferenceView& view, int plane, Dsi& dsi) {
  const double along = (depth_m - center.z()) / direction.z();
  if (!(along > 0)) return;
  const Eigen::Vector2d pixel = view.project(center + along * direction);
  const double left = std::floor(pixel.x());
  const double top = std::floor(pixel.y());
  if (!(left >= 0 && left + 1 <= view.width - 1 && top >= 0 && top + 1 <= view.height - 1)) return;
  for (int j = 0; j < 2; ++j) {
    for (int i = 0; i < 2; ++i) {
      const double weight_x = 1 - std::abs(pixel.x() - (left + i));
      const double weight_y = 1 - std::abs(pixel.y() - (top + j));
      dsi.at(plane, static_cast<int>(left) + i, static_cast<int>(top) + j) += weight_x * weight_y;
    }
  }
}

}  // namespace

Dsi::Dsi(int planes_, const ReferenceView& view)
    : planes(planes_),
      width(view.width),
      height(view.height),
      values(static_cast<std::size_t>(planes_) * view.pixels(), 0.0) {}

double& Dsi::at(int plane, int x, int y) { return values[index(*this, plane, x, y)]; }
double Dsi::at(int plane, int x, int y) const { return values[index(*this, plane, x, y)]; }

std::vector<PosedEvent> poseEach(const std::vector<Event>& events, const RigCamera& camera,
                                 const Trajectory& trajectory, const Rigid3& T_world_ref) {
  const Rigid3 T_ref_world = T_world_ref.inverse();
  std::vector<PosedEvent> posed;
  for (const Event& event : events) {
    const std::optional<Rigid3> T_world_rig = trajectory.poseAt(event.t_ns);
    if (T_world_rig) posed.push_back({event, T_ref_world * *T_world_rig * camera.T_rig_cam});
  }
  return posed;
}

std::vector<PosedEvent> poseByPacket(const std::vector<Event>& events, const PosePackets& packets) {
  std::vector<PosedEvent> posed;
  for (const PosePacket& packet : packets.packets) {
    for (std::size_t i = packet.begin; i < packet.end; ++i) {
      posed.push_back({events[i], packet.T_ref_cam});
    }
  }
  return posed;
}

Dsi rayDensity(const std::vector<PosedEvent>& events, const UndistortionTable& undistortion,
               const ReferenceView& view, const DepthPlanes& planes) {
  Dsi dsi(planes.size(), view);
  for (const PosedEvent& posed : events) {
    const Eigen::Vector3d ray_cam = undistortion.ray(posed.event.x, posed.event.y).homogeneous();
    const Eigen::Vector3d direction = posed.T_ref_cam.rotation * ray_cam;
    for (int plane = 0; plane < planes.size(); ++plane) {
      vote(posed.T_ref_cam.translation, direction, planes.depth(plane), view, plane, dsi);
    }
  }
  return dsi;
}

namespace {

/// Returns the sum of the harmonic means of the first value with each other.
double pairs(const std::vector<double>& values) {
  double sum = 0;
  for (std::size_t k = 1; k < values.size(); ++k) sum += 2 / (1 / values[0] + 1 / values[k]);
  return sum;
}

}  // namespace

double fuse(FusionRule rule, const std::vector<double>& values) {
  const auto n = static_cast<double>(values.size());
  double sum = 0;
  double product = 1;
  double squares = 0;
  double reciprocals = 0;
  for (const double value : values) {
    sum += value;
    product *= value;
    squares += value * value;
    reciprocals += 1 / value;
  }
  switch (rule) {
    case FusionRule::kMin:
      return *std::min_element(values.begin(), values.end());
    case FusionRule::kHarmonic:
      return n / reciprocals;
    case FusionRule::kPairs:
      return values.size() == 1 ? values[0] : pairs(values);
    case FusionRule::kGeometric:
      return std::pow(product, 1 / n);
    case FusionRule::kArithmetic:
      return sum / n;
    case FusionRule::kRms:
      return std::sqrt(squares / n);
    case FusionRule::kMax:
      return *std::max_element(values.begin(), values.end());
  }
  throw std::logic_error("unknown rule");
}

Dsi fuse(FusionRule rule, const std::vector<Dsi>& inputs) {
  Dsi fused = inputs.front();
  std::vector<double> values(inputs.size());
  for (std::size_t i = 0; i < fused.values.size(); ++i) {
    for (std::size_t n = 0; n < inputs.size(); ++n) values[n] = inputs[n].values[i];
    fused.values[i] = fuse(rule, values);
  }
  return fused;
}

std::vector<std::vector<Event>> splitEvents(const std::vector<Event>& events, std::int64_t t0_ns,
                                            std::int64_t t1_ns, int count, SubintervalSplit split) {
  std::vector<std::vector<Event>> parts;
  for (int s = 0; s < count; ++s) {
    std::vector<Event>& part = parts.emplace_back();
    for (std::size_t i = 0; i < events.size(); ++i) {
      const bool by_count = split == SubintervalSplit::kCount;
      const std::int64_t whole =
          by_count ? static_cast<std::int64_t>(events.size()) : t1_ns - t0_ns;
      const std::int64_t position =
          by_count ? static_cast<std::int64_t>(i) : events[i].t_ns - t0_ns;
      if (whole * s / count <= position && position < whole * (s + 1) / count)
        part.push_back(events[i]);
    }
  }
  return parts;
}

double fuse(const FusionOptions& options, const std::vector<std::vector<double>>& values) {
  std::vector<double> fused;
  if (options.order == FusionOrder::kTimeThenCameras) {
    for (const auto& camera : values) fused.push_back(fuse(options.across_time, camera));
    return fuse(options.across_cameras, fused);
  }
  for (std::size_t slot = 0; slot < values.front().size(); ++slot) {
    std::vector<double> simultaneous;
    for (const auto& camera : values) simultaneous.push_back(camera[slot]);
    fused.push_back(fuse(options.across_cameras, simultaneous));
  }
  return fuse(options.across_time, fused);
}

Dsi fuse(const FusionOptions& options, const std::vector<std::vector<Dsi>>& inputs) {
  Dsi fused = inputs.front().front();
  for (std::size_t i = 0; i < fused.values.size(); ++i) {
    std::vector<std::vector<double>> values;
    for (const auto& camera : inputs) {
      auto& of_camera = values.emplace_back();
      for (const Dsi& slot : camera) of_camera.push_back(slot.values[i]);
    }
    fused.values[i] = fuse(options, values);
  }
  return fused;
}

std::vector<int> peakPlanes(const Dsi& dsi) {
  std::vector<int> peaks;
  for (int y = 0; y < dsi.height; ++y) {
    for (int x = 0; x < dsi.width; ++x) {
      int best = 0;
      for (int plane = 1; plane < dsi.planes; ++plane) {
        if (dsi.at(plane, x, y) > dsi.at(best, x, y)) best = plane;
      }
      peaks.push_back(best);
    }
  }
  return peaks;
}

std::vector<double> peakValues(const Dsi& dsi) {
  const std::vector<int> planes = peakPlanes(dsi);
  std::vector<double> values;
  for (std::size_t i = 0; i < planes.size(); ++i) {
    const auto x = static_cast<int>(i) % dsi.width;
    const auto y = static_cast<int>(i) / dsi.width;
    values.push_back(dsi.at(planes[i], x, y));
  }
  return values;
}

}  // namespace efm::oracle
