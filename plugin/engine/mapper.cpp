// SPDX-License-Identifier: BSD-3-Clause
#include "event_fusion/engine.h"
#include "plugin/engine/host_text.h"
#include "plugin/engine/mapper_driver.h"
#include "plugin/session/event_fusion_options.h"

namespace efm {

namespace {

constexpr HostFace kFace = HostFace::kMapper;

}  // namespace

Mapper::Mapper(const Options& options, Callbacks callbacks,
               const std::vector<StoredKeyframe>& earlier)
    : driver_(MapperDriver::forHost(options.values(), std::move(callbacks), earlier)) {}

Mapper::~Mapper() = default;

int Mapper::addCamera(const RigCamera& camera) {
  return forHost(kFace, [&] { return driver_->addCamera(camera); });
}
void Mapper::addCameras(const Rig& rig) {
  forHost(kFace, [&] { driver_->addCameras(rig); });
}
void Mapper::addEvents(int camera, std::vector<Event> events) {
  forHost(kFace, [&] { driver_->addEvents(camera, std::move(events)); });
}
void Mapper::addPose(const StampedPose& pose, const std::optional<PoseNoise>& noise) {
  PoseSample sample;
  sample.t_ns = nearestTick(pose.t_ns);
  sample.T_world_body = roundedPose(pose.T_world_rig);
  sample.noise = noise;
  add(std::move(sample));
}
void Mapper::add(Sample sample) {
  forHost(kFace, [&] { driver_->add(std::move(sample)); });
}
void Mapper::finish() {
  forHost(kFace, [&] { driver_->finish(); });
}
void Mapper::stop() { driver_->stop(); }

std::shared_ptr<const MapSnapshot> Mapper::snapshot() const { return driver_->newest(true); }
std::shared_ptr<const MapSnapshot> Mapper::keyframes() const { return driver_->newest(false); }
SessionStatus Mapper::status() const { return driver_->statusForHost(); }
std::vector<Warning> Mapper::warnings() const { return hostTexts(driver_->warnings(), kFace); }

}  // namespace efm
