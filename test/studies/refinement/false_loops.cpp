// SPDX-License-Identifier: BSD-3-Clause
#include "test/studies/refinement/false_loops.h"

#include <algorithm>
#include <cstddef>
#include <optional>

#include "mapping/geometry/rigid3.h"
#include "test/studies/refinement/pose_refinement_run.h"
#include "tracking_stub/random/random_numbers.h"

namespace efm::studies {
namespace {

constexpr double kProbability = 0.3;
constexpr double kMaxOverlapOfOther = 0.05;
constexpr double kMinOverlapOfSame = 0.3;
constexpr double kWrongM = 0.3;
constexpr double kWrongRad = 15 * kRadiansPerDegree;

Rigid3 errorOf(RandomNumbers& random, double length_m, double angle_rad) {
  return {rotationBy(angle_rad * randomDirection(random)), length_m * randomDirection(random)};
}

/// Makes false loops.
class LoopForger {
 public:
  LoopForger(const std::vector<KeyframeDepthMap>& keyframes, const std::vector<Rigid3>& T_world_ref,
             const RefinementOptions& options, std::uint64_t seed)
      : T_world_ref_(T_world_ref), random_(seed, 7) {
    for (const KeyframeDepthMap& keyframe : keyframes) {
      clouds_.emplace_back(keyframe, options.points);
    }
  }

  /// A false loop of this keyframe and an older one; often none.
  std::optional<LoopCandidate> next(std::size_t newer) {
    if (newer == 0 || random_.uniform() >= kProbability) return std::nullopt;
    const bool another_place = next_is_another_place_;
    next_is_another_place_ = !next_is_another_place_;
    if (auto loop = forge(newer, another_place)) return loop;
    return forge(newer, !another_place);
  }

 private:
  std::optional<LoopCandidate> forge(std::size_t newer, bool another_place) {
    std::vector<std::size_t> fitting;
    for (std::size_t older = 0; older < newer; ++older) {
      const double overlap = viewOverlap(clouds_[newer], clouds_[older],
                                         T_world_ref_[older].inverse() * T_world_ref_[newer]);
      if (another_place ? overlap < kMaxOverlapOfOther : overlap >= kMinOverlapOfSame)
        fitting.push_back(older);
    }
    if (fitting.empty()) return std::nullopt;
    const std::size_t older =
        fitting[static_cast<std::size_t>(random_.below(static_cast<int>(fitting.size())))];
    return LoopCandidate{older, newer, another_place ? claimNearby() : claimWrong(older, newer)};
  }

  Rigid3 claimNearby() {
    return errorOf(random_, random_.uniform(0, kWrongM), random_.uniform(0, kWrongRad));
  }

  Rigid3 claimWrong(std::size_t older, std::size_t newer) {
    const Rigid3 T_older_newer = T_world_ref_[older].inverse() * T_world_ref_[newer];
    const int kind = random_.below(3);
    const double length_m = kind == 1 ? 0 : random_.uniform(kWrongM, 1);
    const double angle_rad = kind == 2 ? 0 : random_.uniform(kWrongRad, 3 * kWrongRad);
    return T_older_newer * errorOf(random_, length_m, angle_rad);
  }

  const std::vector<Rigid3>& T_world_ref_;
  std::vector<RegistrationCloud> clouds_;
  RandomNumbers random_;
  bool next_is_another_place_ = true;
};

}  // namespace

FalseLoops proposeFalseLoops(const std::vector<KeyframeDepthMap>& keyframes,
                             const std::vector<Rigid3>& T_world_true,
                             const std::vector<Rigid3>& T_world_ref,
                             const RefinementOptions& options, std::uint64_t seed) {
  FalseLoops result;
  LoopForger forger(keyframes, T_world_true, options, seed);
  const RefinerRun with =
      refineKeyframes(keyframes, options, [&](KeyframeRefiner& refiner, std::size_t newer) {
        const std::optional<LoopCandidate> loop = forger.next(newer);
        if (!loop) return;
        ++result.proposed;
        if (refiner.propose(*loop)) ++result.accepted;
      });
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    const Rigid3& a = T_world_ref[i];
    const Rigid3& b = with.T_world_ref[i];
    result.moved_m = std::max(result.moved_m, (a.translation - b.translation).norm());
    result.moved_rad = std::max(result.moved_rad, a.rotation.angularDistance(b.rotation));
  }
  return result;
}

}  // namespace efm::studies
