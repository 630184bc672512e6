// SPDX-License-Identifier: BSD-3-Clause
// Mistakes in the poses.

#include <cmath>

#include "mapping/geometry/timestamp.h"
#include "test/integration/mistakes.h"

namespace efm {
namespace {

using Draft = DraftRecording;

/// Returns a change of each pose.
template <typename Change>
std::function<void(Draft&)> eachPose(Change change) {
  return [change](Draft& draft) {
    for (StampedPose& pose : draft.poses) change(pose, draft.poses.front());
  };
}

/// Returns a change of line 101 of the poses: `numbers` replace all its numbers but the time.
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

/// Returns poses at 100 Hz that start at 1.4 s.
std::string posesInMicroseconds() {
  std::string text;
  for (int i = 0; i < 50; ++i) {
    text += std::to_string(1'400'000 + 10'000 * i) + " 0 0 0 0 0 0 1\n";
  }
  return text;
}

const std::string kEvents = "1.400001000 to 1.799998000 s (+0 to +0.4 s)";

}  // namespace

std::vector<Mistake> poseMistakes() {
  return {
      {"no motion",
       eachPose([](StampedPose& pose, const StampedPose& first) {
         pose.T_world_rig = first.T_world_rig;
       }),
       {"warning: depths-disagree: the depths from the cameras of the rig and those from the "
        "motion of one camera agree within 15 % in ~28 % of the pixels",
        "warning: no-motion: the poses move by at most 0 m and 0 degrees within a window"}},
      {"rotation alone",
       eachPose([](StampedPose& pose, const StampedPose& first) {
         pose.T_world_rig.translation = first.T_world_rig.translation;
       }),
       {"warning: depths-disagree: the depths from the cameras of the rig and those from the "
        "motion of one camera agree within 15 % in ~22 % of the pixels",
        "warning: rotation-only: the poses move by at most 0 m and 1.42 degrees within a window"}},
      {"positions in millimetres",
       eachPose(
           [](StampedPose& pose, const StampedPose&) { pose.T_world_rig.translation *= 1000; }),
       {"warning: speed: the poses move at up to 547 m/s: expected at most 50; are positions in "
        "metres",
        "warning: depths-disagree: the depths from the cameras of the rig and those from the "
        "motion of one camera agree within 15 % in ~14 % of the pixels",
        "warning: depths-at-limit: ~56 % of the depths lie at the farthest plane, 5 m"}},
      {"positions twice as large",
       eachPose([](StampedPose& pose, const StampedPose&) { pose.T_world_rig.translation *= 2; }),
       {"warning: scale: the depths from the motion are ~2 times those from the cameras of the "
        "rig: the positions of the poses or the distance of the cameras have another unit or "
        "scale; both must be in metres"}},
      {"positions half as large",
       eachPose([](StampedPose& pose, const StampedPose&) { pose.T_world_rig.translation *= 0.5; }),
       {"warning: scale: the depths from the motion are ~0.5 times those from the cameras of the "
        "rig"}},
      {"poses that are T_rig_world",
       eachPose([](StampedPose& pose, const StampedPose&) {
         pose.T_world_rig = pose.T_world_rig.inverse();
       }),
       {"warning: poses-inverted: the events are ~1.3 times as sharp with each pose inverted"}},
      {"quaternions in the order w x y z",
       eachPose([](StampedPose& pose, const StampedPose&) {
         const Eigen::Quaterniond q = pose.T_world_rig.rotation;
         pose.T_world_rig.rotation = Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y());
       }),
       {"warning: quaternion-order: the events are ~1.8 times as sharp with the quaternions read "
        "as qw qx qy qz; the order must be qx qy qz qw"}},
      {"poses of a body with x forward",
       eachPose([](StampedPose& pose, const StampedPose&) {
         Eigen::Matrix3d R_body_rig;
         R_body_rig << 0, 0, 1, -1, 0, 0, 0, -1, 0;
         pose.T_world_rig.rotation = pose.T_world_rig.rotation * R_body_rig.transpose();
       }),
       {"warning: axis-convention: the events are ~1.5 times as sharp if the rig's axes x, y, z "
        "are the axes -y, -z, x of the poses; give a file with T_body_rig: [[0, 0, 1, 0], [-1, 0, "
        "0, 0], [0, -1, 0, 0], [0, 0, 0, 1]]"}},
      {"cameras exchanged",
       [](Draft& draft) { std::swap(draft.events[0], draft.events[1]); },
       {"warning: cameras-swapped: the events are ~3.0 times as sharp with the transform between "
        "cameras 0 and 1 inverted"}},
      {"a jump of the tracker",
       eachPose([](StampedPose& pose, const StampedPose& first) {
         if (pose.t_ns - first.t_ns > 200'000'000) pose.T_world_rig.translation.x() += 2;
       }),
       {"warning: speed: the poses move at up to 200 m/s: expected at most 50; are positions in "
        "metres, times in seconds and the columns in order? Or the tracker jumps",
        "warning: pose-jump: the poses jump by 2 m after 1.599000000 s (+0.199 s)",
        "warning: depths-disagree: the depths from the cameras of the rig and those from the "
        "motion of one camera agree within 15 % in ~26 % of the pixels",
        "warning: depths-sensitive: the depths change by ~6.7 % where the clock"}},
      {"a step of 5 cm, as of a loop closure",
       eachPose([](StampedPose& pose, const StampedPose& first) {
         if (pose.t_ns - first.t_ns > 250'000'000) pose.T_world_rig.translation.y() -= 0.05;
       }),
       {"warning: pose-jump: the poses jump by 0.05 m after 1.649000000 s (+0.249 s): 11.4 pixels, "
        "at 50 m/s beside the motion before and after, where 0.05 are usual; a loop closure or a "
        "lost tracker? What is mapped before and after does not fit together: give a trajectory "
        "that was optimised as a whole (--poses",
        "…"}},
      {"a tracker that hangs for 0.15 s",
       [](Draft& draft) {
         const Rigid3 T_world_rig = draft.poses[150].T_world_rig;
         for (std::size_t i = 150; i <= 300; ++i) draft.poses[i].T_world_rig = T_world_rig;
       },
       {"warning: poses-frozen: the poses repeat for 0.15 s, after 1.549000000 s (+0.149 s)",
        "warning: pose-jump: the poses jump by 0.0781 m after 1.699000000 s (+0.299 s): 17.8"}},
      {"0.15 s without poses",
       [](Draft& draft) {
         draft.poses.erase(draft.poses.begin() + 151, draft.poses.begin() + 300);
       },
       {"warning: pose-interpolation: poses are 0.15 s apart, after 1.549000000 s (+0.149 s): the "
        "image moves by 21.8 pixels meanwhile, and straight interpolation misses some 2.2 of them; "
        "a pose at least every 0.1 s is needed (--poses), or --set rig.max_pose_gap_s=0.1"}},
      {"poses that turn too fast",
       eachPose([](StampedPose& pose, const StampedPose& first) {
         const double angle = 40 * secondsBetween(first.t_ns, pose.t_ns);
         pose.T_world_rig.rotation =
             Eigen::Quaterniond(std::cos(angle / 2), 0, std::sin(angle / 2), 0);
       }),
       {"warning: rotation-rate: the poses rotate at up to 40 rad/s: expected at most 20; is the "
        "order of the quaternion",
        "…"}},
      {"poses a day late",
       eachPose([](StampedPose& pose, const StampedPose&) { pose.t_ns += 86'400'000'000'000; }),
       apart({kEvents, "86401.399000000 to 86401.800000000 s (+86399.999 to +86400.4 s)",
              "; have they one clock", "86399.599002000"})},
      {"times of poses in milliseconds",
       eachPose([](StampedPose& pose, const StampedPose&) { pose.t_ns *= 1000; }),
       apart({kEvents, "1399.000000000 to 1800.000000000 s (+1397.6 to +1798.6 s)",
              "; they fit if the poses' times are in ms", "1397.200002000"},
             {"warning: no-motion: the poses move by at most 0.000547185 m and 0.0111 degrees "
              "within a window"})},
      {"poses of the first third alone",
       [](Draft& draft) { draft.poses.resize(draft.poses.size() / 3); },
       {"warning: clock-overlap: the poses cover 33.0 % of the events' time: events from "
        "1.400001000 to 1.799998000 s (+0 to +0.4 s), poses from 1.399000000 to 1.532000000 s "
        "(-0.001 to +0.132 s)",
        "warning: events-without-pose: 259083 of 394260 events have no pose"},
       "--set keyframes.window_s=0.1"},
      {"a gap between poses",
       [](Draft& draft) {
         draft.poses.erase(draft.poses.begin() + 110, draft.poses.begin() + 300);
       },
       {"warning: pose-gap: the largest gap between two poses is 0.191 s, after 1.508000000 s "
        "(+0.108 s): events in gaps of more than 0.1 s are not used",
        "warning: events-without-pose: 198967 of 394260 events have no pose",
        "warning: windows-without-pose: 1 windows were left out: no pose at their reference time"},
       "--set rig.max_pose_gap_s=0.1 --set keyframes.window_s=0.1"},
      {"no poses",
       file("poses.txt", "# t tx ty tz qx qy qz qw\n"),
       {"error: data/poses.txt: no poses"}},
      {"a single pose", [](Draft& draft) { draft.poses.resize(1); },
       apart({kEvents, "1.399000000 to 1.399000000 s (-0.001 to -0.001 s)", "", "0.001001000"})},
      {"a position that is not a number",
       oddPose("nan 0 0 0 0 0 1"),
       {"error: data/poses.txt:101: tx = 'nan': expected a finite number"}},
      {"a quaternion of length 0.5",
       oddPose("1 2 3 0.5 0 0 0"),
       {"error: data/poses.txt:101: qx qy qz qw = '0.5 0 0 0', of length 0.5: expected a rotation, "
        "of length 1 within 1 %; are the columns t tx ty tz qx qy qz qw? A header names"}},
      {"rotation before position",
       oddPose("0 0 0 1 1 2 3"),
       {"error: data/poses.txt:101: qx qy qz qw = '1 1 2 3', of length 3.87298: expected a "
        "rotation, of length 1 within 1 %; tx ty tz qx has length 1: is the order t qx qy qz qw tx "
        "ty tz? A header names"}},
      {"angles instead of a quaternion",
       file("poses.txt", "t_s,x,y,z,roll,pitch,yaw\n1.4,0,0,0,0,0,0\n"),
       {"error: data/poses.txt:1: 't_s,x,y,z,roll,pitch,yaw': angles are not read, because their "
        "order and axes differ between tools"}},
      {"times that are all equal",
       eachPose([](StampedPose& pose, const StampedPose& first) { pose.t_ns = first.t_ns; }),
       {"error: data/poses.txt: the first 100 poses have one time, 1.399: expected a time of its "
        "own for each pose"}},
      {"whole numbers as times of poses",
       file("poses.txt", posesInMicroseconds()),
       {"error: data/poses.txt: all times are whole numbers, of an unknown unit: probably us, "
        "where 50 poses take 0.49 s: expected --pose-time-unit us"}},
  };
}

}  // namespace efm
