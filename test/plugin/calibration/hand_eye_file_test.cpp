// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/calibration/hand_eye_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/plugin/formats/files.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class HandEyeFile : public TemporaryFolder {
 protected:
  Rigid3 read(const std::string& text) const {
    writeFile(folder() / "hand_eye.yaml", text);
    return readHandEye(folder() / "hand_eye.yaml");
  }
  std::string errorOfText(const std::string& text) const {
    return errorOf([&] { read(text); });
  }
};

TEST_F(HandEyeFile, GivesTheTransformFromTheRigToTheBody) {
  // The rig looks along the body's x: its z is the body's x.
  const Rigid3 T_body_rig = read(
      "# a car\nT_body_rig:\n- [0, 0, 1, 0.4]\n- [-1, 0, 0, 0.2]\n- [0, -1, 0, -0.1]\n"
      "- [0, 0, 0, 1]\nnote: other keys do not matter\n");
  EXPECT_LT((T_body_rig * Eigen::Vector3d(0, 0, 2) - Eigen::Vector3d(2.4, 0.2, -0.1)).norm(),
            1e-12);
}

TEST_F(HandEyeFile, AnErrorNamesTheFileTheLineAndTheKey) {
  for (const char* text : {"", "5\n", "T_rig_body: 1\n", "0 0 0 0 0 0 1\n"}) {
    EXPECT_THAT(errorOfText(text),
                AllOf(HasSubstr("hand_eye.yaml: T_body_rig is missing: expected YAML"),
                      HasSubstr("4 rows of 4 numbers")))
        << text;
  }
  EXPECT_THAT(errorOfText("\nT_body_rig: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]\n"),
              HasSubstr("hand_eye.yaml:2: T_body_rig = a list: expected 4 rows of 4 numbers"));
  EXPECT_THAT(errorOf([&] { readHandEye(folder() / "nowhere"); }),
              HasSubstr("nowhere: cannot be opened"));
}

}  // namespace
}  // namespace efm
