// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/space_sweep.h"

#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/partitioner.h>
#include <tbb/task_arena.h>

#include <algorithm>

#include <utility>

#include "mapping/kernels/vote.h"
#include "mapping/named_choice.h"
#include "mapping/option_check.h"

namespace efm {
namespace {

constexpr NamedChoice<VotingKernel> kKernels[] = {{VotingKernel::kPlain, "plain"}};

/// Two groups of planes per thread even out that some planes cost more than others.
constexpr int kGroupsPerThread = 2;
constexpr float kNoValue = -1;

/// The best value along each ray over a group of consecutive planes, and the group's outermost
/// planes: what its neighbours need to complete their parabolas.
class GroupPeaks {
 public:
  explicit GroupPeaks(std::size_t pixels)
      : best_(pixels, kNoValue),
        before_(pixels, kNoValue),
        after_(pixels, kNoValue),
        plane_(pixels, -1),
        previous_(pixels, kNoValue) {}

  /// Planes in increasing order.
  void take(int plane, const std::vector<float>& values) {
    if (first_.empty()) first_ = values;
    for (std::size_t i = 0; i < values.size(); ++i) {
      const float value = values[i];
      if (value > best_[i]) {
        best_[i] = value;
        before_[i] = previous_[i];
        after_[i] = kNoValue;
        plane_[i] = plane;
      } else if (plane_[i] == plane - 1) {
        after_[i] = value;
      }
      previous_[i] = value;
    }
  }

  /// Takes the group that follows this one.
  void append(const GroupPeaks& next, int first_plane_of_next) {
    for (std::size_t i = 0; i < best_.size(); ++i) {
      if (next.best_[i] > best_[i]) {
        best_[i] = next.best_[i];
        before_[i] = next.plane_[i] == first_plane_of_next ? previous_[i] : next.before_[i];
        after_[i] = next.after_[i];
        plane_[i] = next.plane_[i];
      } else if (plane_[i] == first_plane_of_next - 1) {
        after_[i] = next.first_[i];
      }
    }
    previous_ = next.previous_;
  }

  DsiPeaks images(const ReferenceView& view) const {
    const auto image = [&view](const auto& values) {
      using Value = typename std::decay_t<decltype(values)>::value_type;
      cv::Mat_<Value> result(view.height, view.width);
      std::copy(values.begin(), values.end(), result.begin());
      return result;
    };
    return {image(best_), image(plane_), image(before_), image(after_)};
  }

 private:
  std::vector<float> best_;
  std::vector<float> before_;
  std::vector<float> after_;
  std::vector<std::int32_t> plane_;
  std::vector<float> first_;     // the group's first plane
  std::vector<float> previous_;  // the last plane taken
};

struct PlaneGroup {
  int begin = 0;
  int end = 0;
  std::optional<GroupPeaks> peaks;
  std::vector<VoteCounts> votes;  // per camera
};

std::vector<PlaneGroup> groupPlanes(int planes, int threads) {
  const int count = threads == 1 ? 1 : std::min(planes, threads * kGroupsPerThread);
  std::vector<PlaneGroup> groups(static_cast<std::size_t>(count));
  for (int g = 0; g < count; ++g) {
    auto& group = groups[static_cast<std::size_t>(g)];
    group.begin = static_cast<int>(std::int64_t{planes} * g / count);
    group.end = static_cast<int>(std::int64_t{planes} * (g + 1) / count);
  }
  return groups;
}

kernels::RayTransfer narrow(const RayPacket& packet, const PlaneTransfer& transfer) {
  return {packet.begin, packet.end, static_cast<float>(transfer.scale),
          static_cast<float>(transfer.offset_x), static_cast<float>(transfer.offset_y)};
}

/// Votes one camera's rays on one plane; `votes` is cleared first.
VoteCounts votePlane(const RayBundle& camera, const ReferenceView& view, double depth_m,
                     std::vector<float>& votes) {
  std::fill(votes.begin(), votes.end(), 0.0F);
  const kernels::VotePlane plane{votes.data(), view.width, view.height};
  VoteCounts counts;
  for (const RayPacket& packet : camera.packets) {
    const std::uint64_t rays = packet.end - packet.begin;
    const PlaneTransfer transfer = transferToPlane(packet, view, depth_m);
    if (!transfer.in_front) {
      counts.behind_camera += rays;
      continue;
    }
    const std::uint64_t cast = kernels::votePlain({camera.x_inf.data(), camera.y_inf.data()},
                                                  narrow(packet, transfer), plane);
    counts.cast += cast;
    counts.outside_view += rays - cast;
  }
  return counts;
}

}  // namespace

std::string_view nameOf(VotingKernel kernel) { return nameIn(kKernels, kernel); }
VotingKernel votingKernelFromName(std::string_view name) { return valueIn(kKernels, name); }

void SpaceSweepOptions::validate() const {
  constexpr int kMaxThreads = 1024;
  requireOption(!threads || (*threads >= 1 && *threads <= kMaxThreads), "threads",
                threads.value_or(0), "1 to 1024");
}

int SpaceSweepOptions::threadsOrCores() const {
  // What the host of this process allows is the limit, also for what was asked for.
  const auto allowed = static_cast<int>(
      tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
  return std::max(1, std::min(threads.value_or(allowed), allowed));
}

VotingKernel SpaceSweepOptions::kernelOrFastest() const {
  return kernel.value_or(VotingKernel::kPlain);
}

SpaceSweep::SpaceSweep(const SpaceSweepOptions& options) : options_(options) {
  options_.validate();
}

SweepResult SpaceSweep::run(const std::vector<RayBundle>& cameras, const ReferenceView& view,
                            const DepthPlanes& planes, DsiSink* sink) const {
  std::vector<PlaneGroup> groups = groupPlanes(planes.size(), options_.threadsOrCores());

  const auto sweep_group = [&](PlaneGroup& group) {
    GroupPeaks& peaks = group.peaks.emplace(view.pixels());
    group.votes.resize(cameras.size());
    std::vector<float> votes(view.pixels());
    FusionAccumulator across_cameras(options_.across_cameras, view.pixels());
    for (int plane = group.begin; plane < group.end; ++plane) {
      across_cameras.begin();
      for (std::size_t c = 0; c < cameras.size(); ++c) {
        group.votes[c] += votePlane(cameras[c], view, planes.depth(plane), votes);
        across_cameras.fold(votes.data());
      }
      across_cameras.finish();
      peaks.take(plane, across_cameras.values());
      if (sink != nullptr) sink->takePlane(plane, across_cameras.values().data());
    }
  };
  tbb::task_arena arena(options_.threadsOrCores());
  arena.execute([&] {
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, groups.size()),
        [&](const tbb::blocked_range<std::size_t>& range) {
          for (std::size_t g = range.begin(); g < range.end(); ++g) sweep_group(groups[g]);
        },
        tbb::simple_partitioner());
  });

  SweepResult result;
  result.votes.resize(cameras.size());
  GroupPeaks& all = *groups.front().peaks;
  for (const PlaneGroup& group : groups) {
    if (&group != &groups.front()) all.append(*group.peaks, group.begin);
    for (std::size_t c = 0; c < cameras.size(); ++c) result.votes[c] += group.votes[c];
  }
  result.peaks = all.images(view);
  return result;
}

}  // namespace efm
