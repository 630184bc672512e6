// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/mrpt/hosted_mapping.h"

#include "plugin/session/health_checks.h"

namespace efm {

KeyframePoses keyframePoses(std::vector<StampedPose> in_map,
                            const std::vector<Rigid3>& T_odom_ref) {
  KeyframePoses poses{in_map, std::move(in_map)};
  const std::size_t earlier = poses.by_tracker.size() - T_odom_ref.size();
  for (std::size_t i = 0; i < T_odom_ref.size(); ++i) {
    poses.by_tracker[earlier + i].T_world_rig = T_odom_ref[i];
  }
  return poses;
}

void tellChoice(const SessionStatus& status, const HostedMapping::Callbacks& callbacks) {
  if (callbacks.info) callbacks.info(choiceText(status));
  if (!status.scene_unknown || !callbacks.warn) return;
  const Warning warning = noSceneWarning();
  callbacks.warn(warning.name + ": " + warning.text);
}

}  // namespace efm
