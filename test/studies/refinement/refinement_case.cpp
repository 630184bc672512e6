// SPDX-License-Identifier: BSD-3-Clause
#include "test/studies/refinement/refinement_case.h"

#include <algorithm>
#include <future>
#include <memory>
#include <stdexcept>

#include "mapping/geometry/rigid3.h"
#include "test/studies/recordings/real_rigs.h"
#include "test/studies/recordings/room_loop.h"
#include "test/studies/refinement/pose_refinement_run.h"
#include "tracking_stub/presets/presets.h"

namespace efm::studies {
namespace {

EventFusionOptions optionsOf(const RefinementCase& what) {
  EventFusionOptions options;
  options.mapper.keyframe.planes.min_depth_m = what.min_depth_m;
  options.mapper.keyframe.planes.max_depth_m = what.max_depth_m;
  options.mapper.policy.window_s = options.mapper.policy.stride_s = what.window_s;
  options.refinement.enabled = true;
  return options;
}

TrackerFaults noiseOf(double noise_m, double noise_deg, std::uint64_t seed) {
  TrackerFaults faults;
  faults.perturbation.keyframe.noise_m = noise_m;
  faults.perturbation.keyframe.noise_rad = noise_deg * kRadiansPerDegree;
  faults.perturbation.seed = seed;
  return faults;
}

TrackerFaults driftOf(double share, double deg_per_m, std::uint64_t seed) {
  TrackerFaults faults;
  faults.perturbation.drift = {share, deg_per_m * kRadiansPerDegree};
  faults.perturbation.seed = seed;
  return faults;
}
/// Seeds of the smaller experiments.
constexpr std::uint64_t kFewSeeds = 2;

/// All experiments with one recording. Several recordings may be mapped in parallel.
class RefinementCaseRun {
 public:
  RefinementCaseRun(const StudyRun& run, const RefinementCase& what)
      : case_(what),
        seeds_(run.pick<std::uint64_t>(5, 1)),
        recording_(run.recordings->make(what.file, what.simulation())),
        options_(optionsOf(what)),
        truth_(recording_.simulation) {}

  void map() {
    results_.exact = {outcomeOf(mapped({}))};
    for (std::uint64_t seed = 1; seed <= seeds_; ++seed) {
      noise(seed);
      drift(seed);
    }
    for (std::uint64_t seed = 1; seed <= std::min(kFewSeeds, seeds_); ++seed) {
      results_.small_noise.push_back(outcomeOf(mapped(noiseOf(0.002, 0.1, seed))));
    }
  }

  /// Measures the time to refine the noisy keyframes. Keyframes without a full window are excluded.
  void time() {
    const RefinementOptions& options = options_.refinement.refiner;
    for (const PoseRefinementRun& run : noisy_) {
      const RefinerRun again = refineKeyframes(run.keyframes, options);
      for (std::size_t i = 0; i < run.keyframes.size(); ++i) {
        if (!isSame(again.T_world_ref[i], run.T_world_ref[i])) {
          throw std::logic_error(case_.name + ", keyframe " + std::to_string(i) +
                                 ": the session refined it to another pose");
        }
      }
      const auto first = std::min<std::ptrdiff_t>(
          options.window, static_cast<std::ptrdiff_t>(again.seconds.size()) - 1);
      const auto append = [&](const std::vector<double>& from, std::vector<double>& to) {
        to.insert(to.end(), from.begin() + first, from.end());
      };
      append(again.seconds, results_.seconds);
      append(again.processor_seconds, results_.processor_seconds);
    }
  }

  const RefinementResults& results() const { return results_; }

 private:
  PoseRefinementRun mapped(const TrackerFaults& faults) const {
    return mapRefined(recording_, options_, faults);
  }

  MapErrors errorsAt(const PoseRefinementRun& run, const std::vector<Rigid3>& T_map_ref) {
    return truth_.errorsOf(run.keyframes, T_map_ref,
                           *mapAt(run.keyframes, T_map_ref, options_.cloud));
  }

  RefinementOutcome outcomeOf(const PoseRefinementRun& run) {
    return {errorsAt(run, run.T_odom_ref),
            truth_.errorsOf(run.keyframes, run.T_world_ref, *run.refined_map)};
  }

  void noise(std::uint64_t seed) {
    PoseRefinementRun run = mapped(noiseOf(0.01, 0.5, seed));
    const RefinementOutcome outcome = outcomeOf(run);
    results_.noise.push_back(outcome);
    results_.keyframes = run.keyframes.size();
    if (seed <= kFewSeeds) {
      results_.noise_feared.push_back({outcome.without, errorsExpecting(10, run)});
      results_.noise_denied.push_back({outcome.without, errorsExpecting(0.1, run)});
    }
    results_.false_loops.push_back(proposeFalseLoops(run.keyframes, truePoses(run), run.T_world_ref,
                                                     options_.refinement.refiner, seed));
    run.refined_map = {};
    noisy_.push_back(std::move(run));
  }

  /// Refined with options that scale the tracker's noise by a factor.
  MapErrors errorsExpecting(double times, const PoseRefinementRun& run) {
    RefinementOptions wrong = options_.refinement.refiner;
    wrong.tracker.noise_m *= times;
    wrong.tracker.noise_rad *= times;
    return errorsAt(run, refineKeyframes(run.keyframes, wrong).T_world_ref);
  }

  void drift(std::uint64_t seed) {
    PoseRefinementRun run = mapped(driftOf(0.01, 0.5, seed));
    results_.drift.push_back(outcomeOf(run));
    results_.loops.push_back(run.counts);
    if (seed > 1 || !case_.is_loop) return;
    RefinementDrawing& drawing = results_.drawing;
    drawing.tracker_map = mapAt(run.keyframes, run.T_odom_ref, options_.cloud);
    drawing.refined_map = std::move(run.refined_map);
    drawing.T_world_true = truePoses(run);
    drawing.T_odom_ref = run.T_odom_ref;
    drawing.T_world_ref = run.T_world_ref;
  }

  std::vector<Rigid3> truePoses(const PoseRefinementRun& run) const {
    std::vector<Rigid3> T_world_ref;
    for (const auto& keyframe : run.keyframes) T_world_ref.push_back(truth_.T_world_ref(keyframe));
    return T_world_ref;
  }

  const RefinementCase& case_;
  std::uint64_t seeds_;
  Recording recording_;
  EventFusionOptions options_;
  MapTruth truth_;
  RefinementResults results_;
  std::vector<PoseRefinementRun> noisy_;
};
}  // namespace

std::vector<RefinementCase> casesOf(const StudyRun& run) {
  if (run.quick) {
    return {{"MVSEC", "mvsec_room", [&run] { return mvsecInRoom(run, 0.2); }, 1, 6.5, 0.05}};
  }
  const auto room = [] {
    SimulationOptions options;
    options.preset = "room_stereo";
    return makeSimulation(options);
  };
  return {{"room_stereo", "room_stereo", room, 0.9, 7, 0.3},
          {"loop", "room_loop", [] { return roomLoop(24); }, 0.9, 7, 0.6, true},
          {"MVSEC", "mvsec_room_20s", [&run] { return mvsecInRoom(run, 20); }, 1, 6.5, 1}};
}
void mapAll(const StudyRun& run, RefinementStudyResults& all) {
  std::vector<std::unique_ptr<RefinementCaseRun>> case_runs;
  std::vector<std::future<void>> mapped;
  for (const auto& [what, results] : all) {
    case_runs.push_back(std::make_unique<RefinementCaseRun>(run, what));
    mapped.push_back(
        std::async(std::launch::async, [one = case_runs.back().get()] { one->map(); }));
  }
  for (std::future<void>& one : mapped) one.get();
  for (std::size_t i = 0; i < all.size(); ++i) {
    case_runs[i]->time();
    all[i].second = case_runs[i]->results();
  }
}
}  // namespace efm::studies
