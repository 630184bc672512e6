// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/geometry/trajectory.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

std::vector<StampedPose> read(const std::string& text) {
  std::istringstream stream(text);
  return readTumTrajectory(stream, "poses.txt");
}

std::string errorOf(const std::string& text) {
  return messageOf([&] { read(text); });
}

TEST(TumTrajectory, ReadsWrittenPosesExactly) {
  StampedPose pose;
  pose.t_ns = 1'700'000'000'123'456'789;
  pose.T_world_rig.translation = {1.0 / 3, -2e-7, 12345.678901234567};
  pose.T_world_rig.rotation = Eigen::Quaterniond(0.3, -0.4, 0.5, 0.6).normalized();
  StampedPose early = pose;
  early.t_ns = -1;
  std::stringstream stream;
  writeTumTrajectory(stream, {pose, early});
  const auto poses = readTumTrajectory(stream, "stream");
  ASSERT_EQ(poses.size(), 2U);
  EXPECT_EQ(poses[0].t_ns, pose.t_ns);
  EXPECT_EQ(poses[1].t_ns, -1);
  EXPECT_EQ(poses[0].T_world_rig.translation, pose.T_world_rig.translation);
  EXPECT_LT((poses[0].T_world_rig.rotation.coeffs() - pose.T_world_rig.rotation.coeffs()).norm(),
            1e-15);
}

TEST(TumTrajectory, SkipsCommentsAndBlankLinesAndAcceptsAnyBlanks) {
  const auto poses =
      read("# a comment\n\n  \t\r\n1.5\t1 2  3 0 0 0 1\r\n  2 1 2 3 0 0 0 1 # end\n");
  ASSERT_EQ(poses.size(), 2U);
  EXPECT_EQ(poses[0].t_ns, 1'500'000'000);
  EXPECT_EQ(poses[0].T_world_rig.translation, Eigen::Vector3d(1, 2, 3));
}

TEST(TumTrajectory, ReadsTheQuaternionAsXyzwAndNormalisesIt) {
  const auto poses = read("0 0 0 0 0 0 1.009 0\n1 0 0 0 0.991 0 0 0\n2 0 0 0 .71 .71 0 0\n");
  EXPECT_DOUBLE_EQ(poses[0].T_world_rig.rotation.z(), 1);
  EXPECT_DOUBLE_EQ(poses[0].T_world_rig.rotation.w(), 0);
  EXPECT_DOUBLE_EQ(poses[1].T_world_rig.rotation.x(), 1);
  EXPECT_DOUBLE_EQ(poses[2].T_world_rig.rotation.norm(), 1);
}

TEST(TumTrajectory, ErrorsNameTheLineTheFieldAndTheExpectedValue) {
  struct Row {
    const char* text;
    std::vector<const char*> parts;
  };
  const Row rows[] = {
      {"0 0 0 0 0 0 0 1\n\n1 2 3\n", {"poses.txt:3: ", "3 fields", "expected 8"}},
      {"0 0 0 0 0 0 0 1 9\n", {"poses.txt:1: ", "9 fields"}},
      {"# t\nnow 0 0 0 0 0 0 1\n", {"poses.txt:2: ", "t = 'now'", "seconds"}},
      {"0 0 1,5 0 0 0 0 1\n", {"poses.txt:1: ", "ty = '1,5'", "number"}},
      {"0 0 0 nan 0 0 0 1\n", {"tz = 'nan': expected a finite number"}},
      {"0 0 0 0 0 0 0 inf\n", {"qw = 'inf': expected a finite number"}},
      {"nan 0 0 0 0 0 0 1\n", {"t = 'nan'"}},
      {"4.7e9 0 0 0 0 0 0 1\n", {"t = '4.7e9'", "4.6e9 s"}},
      {"-4.7e9 0 0 0 0 0 0 1\n", {"t = '-4.7e9'", "4.6e9 s"}},
      {"9223372036 0 0 0 0 0 0 1\n", {"t = '9223372036'", "4.6e9 s"}},
      {"-9223372036 0 0 0 0 0 0 1\n", {"t = '-9223372036'", "4.6e9 s"}},
      {"1 0 0 0 5 5 0 0\n",
       {"poses.txt:1: qx qy qz qw = '5 5 0 0', of length 7.07107: expected a rotation, of length 1 "
        "within 1 %"}},
      {"1 0 0 0 0 0 0 0\n", {"of length 0: expected"}},
      {"1 0 0 0 0 0 0 0.98\n", {"of length 0.98: expected"}},
      {"1 0 0 0 0 0 0 1.02\n", {"of length 1.02: expected"}},
      {"1 0 0 0 1e300 1e300 0 0\n", {"of length 1.41421e+300: expected"}}};
  for (const Row& row : rows) {
    for (const char* part : row.parts) EXPECT_THAT(errorOf(row.text), HasSubstr(part));
  }
  EXPECT_EQ(read("4.6e9 0 0 0 0 0 0 1\n").size(), 1U);
}

TEST(TumTrajectory, ErrorsContainNoControlSequences) {
  const std::string error = errorOf("0 0 \x1b[2J" + std::string(10'000, 'x') + " 0 0 0 0 1\n");
  EXPECT_THAT(error, AllOf(HasSubstr("poses.txt:1: ty = '\\x1b[2J"), Not(HasSubstr("\x1b"))));
  EXPECT_LT(error.size(), 200U);
}

TEST(TumTrajectory, NamesTheFileThatIsMissing) {
  EXPECT_THAT(messageOf([] { readTumTrajectory("no/such/poses.txt"); }),
              HasSubstr("no/such/poses.txt"));
  EXPECT_THROW(writeTumTrajectory("no/such/poses.txt", {}), std::runtime_error);
}

}  // namespace
}  // namespace efm
