// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/pose_intake.h"

#include <algorithm>
#include <cstdlib>
#include <utility>

namespace efm {

bool PoseIntake::isPossible(const PoseSample& pose) {
  const Rigid3 T_world_rig = pose.T_world_rig();
  return pose.t_ns <= kEndOfTimeNs && pose.t_ns >= -kEndOfTimeNs &&
         T_world_rig.translation.allFinite() && T_world_rig.rotation.coeffs().allFinite();
}

std::vector<PoseSample> PoseIntake::add(PoseSample pose) {
  std::vector<PoseSample> right;
  Stream& stream = streams_[pose.source];
  const Event time{pose.t_ns, 0, 0, false};  // the checker looks at nothing else
  if (stream.checker.pass(time)) {
    right.push_back(std::move(pose));
  } else if (stream.checker.add(time, 0) == EventChecker::Verdict::kLate) {
    stream.checker.follow(pose.t_ns);  // the tracker's clock may have gone back
    right.push_back(std::move(pose));
  } else {
    stream.waiting.push_back(std::move(pose));
    takeSettled(stream, right);
    confirm(stream, right);
  }
  return right;
}

std::vector<PoseSample> PoseIntake::noteEvents(std::int64_t t_ns) {
  std::vector<PoseSample> right;
  first_event_ns_ = std::min(first_event_ns_, t_ns);
  newest_event_ns_ = std::max(newest_event_ns_, t_ns);
  for (auto& [source, stream] : streams_) {
    confirm(stream, right);
  }
  return right;
}

/// Ends the waiting if events of the time of the last poses have come.
void PoseIntake::confirm(Stream& stream, std::vector<PoseSample>& right) {
  if (stream.checker.lastRunSinceNs() > newest_event_ns_) return;
  stream.checker.confirmLast();
  takeSettled(stream, right);
}

std::vector<PoseSample> PoseIntake::finish() {
  std::vector<PoseSample> right;
  for (auto& [source, stream] : streams_) {
    if (first_event_ns_ <= newest_event_ns_) {
      stream.checker.expectOthers(first_event_ns_, newest_event_ns_);
    }
    stream.checker.finish(true);
    takeSettled(stream, right);
  }
  return right;
}

void PoseIntake::takeSettled(Stream& stream, std::vector<PoseSample>& right) {
  for (const EventChecker::Settled& settled : stream.checker.takeSettled()) {
    PoseSample pose = std::move(stream.waiting.front());
    stream.waiting.pop_front();
    if (!settled.wrong) {
      right.push_back(std::move(pose));
    } else if (wrong_poses_++ == 0) {
      first_wrong_ = asText(pose.source) + " at " + formatSeconds(pose.t_ns) +
                     " s: expected a time near those of the poses beside it";
    }
  }
}

}  // namespace efm
