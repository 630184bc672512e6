// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "mapping/geometry/trajectory.h"

namespace efm {

/// What says where the rig is; the first is the best.
enum class PoseKind {
  kPose,      ///< Poses in the world.
  kOdometry,  ///< Wheels, in the plane: drifts.
  kActions,   ///< Movements, composed: drifts.
};

/// Who says it: a kind, and the label of its sensor.
struct PoseOrigin {
  PoseKind kind = PoseKind::kPose;
  std::string label;

  friend bool operator<(const PoseOrigin& a, const PoseOrigin& b) {
    return std::tie(a.kind, a.label) < std::tie(b.kind, b.label);
  }
  friend bool operator==(const PoseOrigin& a, const PoseOrigin& b) {
    return a.kind == b.kind && a.label == b.label;
  }
};

/// "odometry 'wheels'", for messages.
std::string asText(const PoseOrigin& source);

/// Takes the poses of one source and counts those of the others: two sources have two worlds, or
/// one of them is worse, and their mixture is none.
///
/// The best kind wins, and of two of a kind the one that came first. Poses of the best kind choose
/// their source at once; others are held until `settle`, as a better one may still come.
class PoseChoice {
 public:
  /// @param label of the source to take; empty: the best.
  explicit PoseChoice(std::string label) : label_(std::move(label)) {}

  /// @return the poses that are to be used from now on, in the order they came.
  std::vector<StampedPose> add(const PoseOrigin& source, const StampedPose& pose);
  /// Ends the waiting for a better source. @return as `add`.
  std::vector<StampedPose> settle();

  const std::optional<PoseOrigin>& chosen() const { return chosen_; }
  /// Poses of other sources.
  const std::map<PoseOrigin, std::uint64_t>& unused() const { return unused_; }

 private:
  struct Held {
    PoseOrigin source;
    StampedPose pose;
  };

  std::vector<StampedPose> choose(const PoseOrigin& source);

  std::string label_;
  std::optional<PoseOrigin> chosen_;
  bool settled_ = false;
  std::vector<Held> held_;
  std::map<PoseOrigin, std::uint64_t> unused_;
};

}  // namespace efm
