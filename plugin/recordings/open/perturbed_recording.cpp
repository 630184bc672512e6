// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/open/perturbed_recording.h"

#include <mrpt/obs/CObservationRobotPose.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "mapping/geometry/timestamp.h"
#include "plugin/mrpt/pose_observation.h"

namespace efm {
namespace {

using mrpt::obs::CObservation;
using mrpt::obs::CObservationRobotPose;

}  // namespace

/// Applies the faults to the poses of one source.
class PerturbedRecording::Tracker {
  /// Returns the poses that it was fed.
  class FedPoses : public PoseSource {
   public:
    void feed(const StampedPose& pose) { poses_.push_back(pose); }
    void end() { no_more_ = true; }

    std::optional<StampedPose> next() override {
      if (poses_.empty()) return std::nullopt;
      const StampedPose pose = poses_.front();
      poses_.pop_front();
      return pose;
    }
    bool ended() const override { return no_more_ && poses_.empty(); }

   private:
    std::deque<StampedPose> poses_;
    bool no_more_ = false;
  };

 public:
  struct Output {
    CObservationRobotPose::Ptr pose;
    std::int64_t t_ns = 0;
    bool inserted = false;  // older than the pose that was fed last
  };

  explicit Tracker(const TrackerFaults& faults) : moves_(faults.perturbation.any()) {
    auto fed = std::make_unique<FedPoses>();
    fed_ = fed.get();
    poses_ = withFaults(std::move(fed), faults);
  }

  void feed(const CObservationRobotPose::Ptr& pose, std::int64_t t_ns) {
    fed_->feed({t_ns, rigidFrom(pose->pose.mean)});
    pending_.push_back({pose, t_ns});
  }
  void end() { fed_->end(); }

  std::optional<Output> next() {
    const std::optional<StampedPose> pose = poses_->next();
    if (!pose) return std::nullopt;
    const bool inserted = pose->t_ns < pending_.back().t_ns;
    while (pending_.front().t_ns < pose->t_ns) pending_.pop_front();  // these were lost
    // The pose behind an inserted one is still to come.
    Output output = pending_.front();
    if (output.t_ns == pose->t_ns) {
      pending_.pop_front();
    } else {
      output = {CObservationRobotPose::Create(*output.pose), pose->t_ns};
      output.pose->timestamp = mrptTimeFrom(pose->t_ns);
    }
    output.inserted = inserted;
    if (moves_ && pose->T_world_rig.translation.allFinite()) {
      output.pose->pose.mean = mrptPoseFrom(pose->T_world_rig);
    }
    return output;
  }

 private:
  bool moves_;
  std::unique_ptr<PoseSource> poses_;
  FedPoses* fed_;  // owned by `poses_`, which reads from it
  std::deque<Output> pending_;
};

PerturbedRecording::PerturbedRecording(std::unique_ptr<Recording> recording,
                                       const TrackerFaults& faults)
    : recording_(std::move(recording)), faults_(faults) {
  faults_.perturbation.tick_ns = kMrptTickNs;
  faults_.validate();
  if (faults_.perturbation.keyframe.any() && faults_.latency_ns == 0) {
    read_ahead_ns_ = durationFromSeconds(faults_.perturbation.max_pose_gap_s);
  }
}

PerturbedRecording::~PerturbedRecording() = default;

CObservation::Ptr PerturbedRecording::next() {
  while (!ended_ && (ready_.empty() || !isFinal(ready_.front()))) readOne();
  if (ready_.empty()) {
    if (error_) std::rethrow_exception(error_);
    return nullptr;
  }
  Entry entry = std::move(ready_.front());
  ready_.pop_front();
  position_ = std::move(entry.position);
  return entry.observation;
}

/// Whether no pose can be inserted before it any more.
bool PerturbedRecording::isFinal(const Entry& entry) const {
  return read_ahead_ns_ == 0 || !entry.t_ns || *newest_ns_ - *entry.t_ns > read_ahead_ns_;
}

void PerturbedRecording::readOne() {
  try {
    const CObservation::Ptr observation = recording_->next();
    if (observation) return take(observation);
  } catch (const std::exception&) {
    error_ = std::current_exception();
  }
  end();
}

void PerturbedRecording::take(const CObservation::Ptr& observation) {
  const std::optional<PoseSourceId> origin = poseSourceOf(*observation);
  const bool perturbed = origin && origin->kind == PoseKind::kPose;
  const std::optional<std::int64_t> t_ns =
      perturbed ? poseIn(*observation)->t_ns : nanosecondsIfKnown(observation->timestamp);
  if (t_ns) newest_ns_ = std::max(newest_ns_.value_or(*t_ns), *t_ns);
  if (!perturbed) {
    ready_.push_back({observation, t_ns, recording_->position()});
    return;
  }
  auto& tracker = trackers_[*origin];
  if (!tracker) tracker = std::make_unique<Tracker>(faults_);
  tracker->feed(std::dynamic_pointer_cast<CObservationRobotPose>(observation), *t_ns);
  try {
    insertPoses(*tracker);
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(recording_->position() + ": " + error.what());
  }
}

/// Inserts poses at their position in time; late poses go to the end.
void PerturbedRecording::insertPoses(Tracker& tracker) {
  while (const auto output = tracker.next()) {
    auto position = ready_.end();
    if (output->inserted && faults_.latency_ns == 0) {
      position = std::find_if(ready_.begin(), ready_.end(), [&](const Entry& entry) {
        return entry.t_ns && *entry.t_ns >= output->t_ns;
      });
    }
    ready_.insert(position, {output->pose, output->t_ns, recording_->position()});
  }
}

void PerturbedRecording::end() {
  ended_ = true;
  for (auto& [origin, tracker] : trackers_) {
    tracker->end();
    insertPoses(*tracker);
  }
}

}  // namespace efm
