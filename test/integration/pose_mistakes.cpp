// SPDX-License-Identifier: BSD-3-Clause
// Mistakes about the poses.

#include <cmath>

#include "mapping/geometry/timestamp.h"
#include "test/integration/mistakes.h"

namespace efm {
namespace {

using Draft = DraftRecording;

/// Changes each pose.
template <typename Change>
std::function<void(Draft&)> eachPose(Change change) {
  return [change](Draft& draft) {
    for (StampedPose& pose : draft.poses) change(pose, draft.poses.front());
  };
}

/// Replaces the numbers from the second on in line 101 of the poses.
std::function<void(Draft&)> oddPose(const std::string& numbers) {
  return [numbers](Draft& draft) {
    std::string text = draft.poseText();
    std::size_t begin = 0;
    for (int line = 1; line < 101; ++line) begin = text.find('\n', begin) + 1;
    begin = text.find(' ', begin);
    text.replace(begin + 1, text.find('\n', begin) - begin - 1, numbers);
    draft.files["poses.txt"] = text;
  };
}

/// 100 Hz, from 1.4 s on.
std::string posesInMicroseconds() {
  std::string text;
  for (int i = 0; i < 50; ++i) {
    text += std::to_string(1'400'000 + 10'000 * i) + " 0 0 0 0 0 0 1\n";
  }
  return text;
}

}  // namespace

std::vector<Mistake> poseMistakes() {
  return {
      {"no motion",
       eachPose([](StampedPose& pose, const StampedPose& first) {
         pose.T_world_rig = first.T_world_rig;
       }),
       "",
       kFine,
       {"warning: no-motion:"}},
      {"rotation alone",
       eachPose([](StampedPose& pose, const StampedPose& first) {
         pose.T_world_rig.translation = first.T_world_rig.translation;
       }),
       "",
       kFine,
       {"warning: rotation-only:"}},
      {"positions in millimetres",
       eachPose(
           [](StampedPose& pose, const StampedPose&) { pose.T_world_rig.translation *= 1000; }),
       "",
       kFine,
       {"warning: speed:", "are positions in metres"}},
      {"positions twice as large",
       eachPose([](StampedPose& pose, const StampedPose&) { pose.T_world_rig.translation *= 2; }),
       "",
       kFine,
       {"warning: scale: the depths from the motion are", "both must be in metres"}},
      {"poses that are T_rig_world",
       eachPose([](StampedPose& pose, const StampedPose&) {
         pose.T_world_rig = pose.T_world_rig.inverse();
       }),
       "",
       kFine,
       {"warning: poses-inverted:", "times as sharp"}},
      {"quaternions in the order w x y z",
       eachPose([](StampedPose& pose, const StampedPose&) {
         const Eigen::Quaterniond q = pose.T_world_rig.rotation;
         pose.T_world_rig.rotation = Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y());
       }),
       "",
       kFine,
       {"warning: quaternion-order:", "qx qy qz qw"}},
      {"poses of a body with x forward",
       eachPose([](StampedPose& pose, const StampedPose&) {
         Eigen::Matrix3d R_body_rig;
         R_body_rig << 0, 0, 1, -1, 0, 0, 0, -1, 0;
         pose.T_world_rig.rotation = pose.T_world_rig.rotation * R_body_rig.transpose();
       }),
       "",
       kFine,
       {"warning: axis-convention:", "-y, -z, x",
        "T_body_rig: [[0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1]]"}},
      {"cameras exchanged",
       [](Draft& draft) { std::swap(draft.events[0], draft.events[1]); },
       "",
       kFine,
       {"warning: cameras-swapped:"}},
      {"a jump of the tracker",
       eachPose([](StampedPose& pose, const StampedPose& first) {
         if (pose.t_ns - first.t_ns > 200'000'000) pose.T_world_rig.translation.x() += 2;
       }),
       "",
       kFine,
       {"warning: speed:", "the tracker jumps"}},
      {"a step of 5 cm, as of a loop closure",
       eachPose([](StampedPose& pose, const StampedPose& first) {
         if (pose.t_ns - first.t_ns > 250'000'000) pose.T_world_rig.translation.y() -= 0.05;
       }),
       "",
       kFine,
       {"warning: pose-jump: the poses jump by 0.05", "--poses"}},
      {"a tracker that hangs for 0.15 s",
       [](Draft& draft) {
         const Rigid3 T_world_rig = draft.poses[150].T_world_rig;
         for (std::size_t i = 150; i <= 300; ++i) draft.poses[i].T_world_rig = T_world_rig;
       },
       "",
       kFine,
       {"warning: poses-frozen: the poses repeat for 0.15 s, after 1.5"}},
      {"0.15 s without poses",
       [](Draft& draft) {
         draft.poses.erase(draft.poses.begin() + 151, draft.poses.begin() + 300);
       },
       "",
       kFine,
       {"warning: pose-interpolation: poses are 0.15 s apart", "rig.max_pose_gap_s=0.1"}},
      {"poses that turn too fast",
       eachPose([](StampedPose& pose, const StampedPose& first) {
         const double angle = 40 * secondsBetween(first.t_ns, pose.t_ns);
         pose.T_world_rig.rotation =
             Eigen::Quaterniond(std::cos(angle / 2), 0, std::sin(angle / 2), 0);
       }),
       "",
       kFine,
       {"warning: rotation-rate:", "order of the quaternion"}},
      {"poses a day late",
       eachPose([](StampedPose& pose, const StampedPose&) { pose.t_ns += 86'400'000'000'000; }),
       "",
       kJobError,
       {"warning: clock-overlap:", "they miss each other by"}},
      {"times of poses in milliseconds",
       eachPose([](StampedPose& pose, const StampedPose&) { pose.t_ns *= 1000; }),
       "",
       kJobError,
       {"warning: clock-overlap:", "if the poses' times are in ms"}},
      {"poses of the first third alone",
       [](Draft& draft) { draft.poses.resize(draft.poses.size() / 3); },
       "--set keyframes.window_s=0.1",
       kFine,
       {"warning: clock-overlap:", "warning: events-without-pose:"}},
      {"a gap between poses",
       [](Draft& draft) {
         draft.poses.erase(draft.poses.begin() + 110, draft.poses.begin() + 300);
       },
       "--set rig.max_pose_gap_s=0.1 --set keyframes.window_s=0.1",
       kFine,
       {"warning: pose-gap:"}},
      {"no poses",
       file("poses.txt", "# t tx ty tz qx qy qz qw\n"),
       "",
       kJobError,
       {"poses.txt: no poses"}},
      {"a single pose",
       [](Draft& draft) { draft.poses.resize(1); },
       "",
       kJobError,
       {"there is no keyframe"}},
      {"a position that is not a number",
       oddPose("nan 0 0 0 0 0 1"),
       "",
       kJobError,
       {"poses.txt:101: tx = 'nan': expected a finite number"}},
      {"a quaternion of length 0.5",
       oddPose("1 2 3 0.5 0 0 0"),
       "",
       kJobError,
       {"poses.txt:101:", "of length 0.5", "are the columns t tx ty tz qx qy qz qw?"}},
      {"rotation before position",
       oddPose("0 0 0 1 1 2 3"),
       "",
       kJobError,
       {"poses.txt:101:", "is the order t qx qy qz qw tx ty tz?"}},
      {"angles instead of a quaternion",
       file("poses.txt", "t_s,x,y,z,roll,pitch,yaw\n1.4,0,0,0,0,0,0\n"),
       "",
       kJobError,
       {"poses.txt:1:", "angles are not read"}},
      {"times that are all equal",
       eachPose([](StampedPose& pose, const StampedPose& first) { pose.t_ns = first.t_ns; }),
       "",
       kJobError,
       {"warning: duplicate-poses:", "there is no keyframe"}},
      {"whole numbers as times of poses",
       file("poses.txt", posesInMicroseconds()),
       "",
       kJobError,
       {"poses.txt: all times are whole numbers", "--time-unit us"}},
  };
}

}  // namespace efm
