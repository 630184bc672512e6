// SPDX-License-Identifier: BSD-3-Clause
#include "event_fusion/engine.h"
#include "plugin/session/event_fusion_options.h"
#include "plugin/session/mapper_core.h"

namespace efm {

Mapper::Mapper(const Options& options, Callbacks callbacks,
               const std::vector<StoredKeyframe>& earlier)
    : core_(MapperCore::make(options.values(), std::move(callbacks), earlier)) {}

Mapper::~Mapper() = default;

int Mapper::addCamera(const RigCamera& camera) { return core_->addCamera(camera); }
void Mapper::addEvents(int camera, std::vector<Event> events) {
  core_->addEvents(camera, std::move(events));
}
void Mapper::addPose(const StampedPose& pose, const std::optional<PoseNoise>& noise) {
  PoseSample sample;
  sample.t_ns = nearestTick(pose.t_ns);
  sample.T_world_body = roundedPose(pose.T_world_rig);
  sample.noise = noise;
  core_->add(std::move(sample));
}
void Mapper::add(Sample sample) { core_->add(std::move(sample)); }
void Mapper::finish() { core_->finish(); }
void Mapper::stop() { core_->stop(); }

std::shared_ptr<const MapSnapshot> Mapper::snapshot() const { return core_->newest(true); }
std::shared_ptr<const MapSnapshot> Mapper::keyframes() const { return core_->newest(false); }
SessionStatus Mapper::status() const { return core_->status(); }
std::vector<Warning> Mapper::warnings() const { return core_->warnings(); }

}  // namespace efm
