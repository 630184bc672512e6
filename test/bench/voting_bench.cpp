// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <string>
#include <vector>

#include "mapping/back_projection.h"
#include "mapping/kernels/vote.h"
#include "mapping/space_sweep.h"
#include "mapping/voting_kernel.h"
#include "test/bench/benches.h"
#include "test/bench/performance_ratios.h"
#include "test/bench/synthetic_window.h"

namespace efm::bench {
namespace {

/// One camera's events as rays, ready to vote.
struct VotingInput {
  ReferenceView view;
  DepthPlanes planes;
  std::vector<CameraRays> cameras;

  const RayBundle& rays() const { return cameras.front().front(); }
};

VotingInput makeInput(const SensorSize& sensor, int planes) {
  SyntheticWindow made = makeSyntheticWindow(sensor.window(1));
  made.options.planes.num_planes = planes;
  const RigCamera& camera = made.rig.cameras.front();
  VotingInput input{ReferenceView::of(camera.model), DepthPlanes(made.options.planes), {}};
  const UndistortionTable undistortion(camera.model);
  const PacketGeometry geometry{made.trajectory.poseAt(made.window.t_ref_ns)->inverse(), input.view,
                                input.planes.depth(0), input.planes.depth(planes - 1)};
  const PosePackets packets = splitIntoPosePackets(made.events.front(), camera, undistortion,
                                                   made.trajectory, geometry, made.options.packets);
  input.cameras.push_back({backProject(made.events.front(), packets, undistortion, input.view)});
  return input;
}

void countVotes(benchmark::State& state, const VotingInput& input) {
  const auto events = static_cast<double>(input.rays().size());
  const double votes = events * input.planes.size();
  state.counters["events/s"] =
      benchmark::Counter(events, benchmark::Counter::kIsIterationInvariantRate);
  state.counters["votes/s"] =
      benchmark::Counter(votes, benchmark::Counter::kIsIterationInvariantRate);
  state.counters["packets"] = static_cast<double>(input.rays().packets.size());
}

/// What every ratio is against: the plain kernel on one plane that is cleared for each depth. Where
/// the rays go is computed beforehand.
void voteYardstick(benchmark::State& state, const VotingInput& input) {
  const RayBundle& rays = input.rays();
  std::vector<std::vector<kernels::RayTransfer>> transfers;  // per plane
  for (int plane = 0; plane < input.planes.size(); ++plane) {
    auto& of_plane = transfers.emplace_back();
    for (const RayPacket& packet : rays.packets) {
      const PlaneTransfer to = transferToPlane(packet, input.view, input.planes.depth(plane));
      if (!to.in_front) continue;
      of_plane.push_back({packet.begin, packet.end, static_cast<float>(to.scale),
                          static_cast<float>(to.offset_x), static_cast<float>(to.offset_y)});
    }
  }
  std::vector<float> votes(input.view.pixels());
  for (auto _ : state) {
    for (const auto& of_plane : transfers) {
      std::fill(votes.begin(), votes.end(), 0.0F);
      for (const kernels::RayTransfer& transfer : of_plane) {
        benchmark::DoNotOptimize(
            kernels::votePlain({rays.x_inf.data(), rays.y_inf.data()}, transfer,
                               {votes.data(), input.view.width, input.view.height}));
      }
      benchmark::ClobberMemory();
    }
  }
  countVotes(state, input);
}

void sweep(benchmark::State& state, const VotingInput& input, VotingKernel kernel) {
  SpaceSweepOptions options;
  options.threads = 1;
  options.kernel = kernel;
  const SpaceSweep space_sweep(options);
  for (auto _ : state) {
    benchmark::DoNotOptimize(space_sweep.run(input.cameras, input.view, input.planes));
  }
  countVotes(state, input);
}

}  // namespace

void benchVoting(BenchSession& session) {
  for (const SensorSize& sensor : session.plan().sensors) {
    const VotingInput input = makeInput(sensor, session.plan().planes);
    session.add({"voting", sensor.name(), kYardstick},
                [&](benchmark::State& state) { voteYardstick(state, input); });
    for (const VotingKernel kernel : availableKernels()) {
      session.add({"voting", sensor.name(), std::string(nameOf(kernel))},
                  [&, kernel](benchmark::State& state) { sweep(state, input, kernel); });
    }
    session.run();
  }
}

}  // namespace efm::bench
