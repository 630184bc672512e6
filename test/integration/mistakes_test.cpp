// SPDX-License-Identifier: BSD-3-Clause
// No mistake passes without a word: a warning with a name, or an error.

#include <iterator>
#include <string>
#include <vector>

#include "test/integration/mistakes.h"
#include "test/plugin/app/app_test.h"

namespace efm {
namespace {

using testing::HasSubstr;
using testing::Not;

std::vector<Mistake> allMistakes() {
  std::vector<Mistake> all;
  for (const auto part : {calibrationMistakes, poseMistakes, eventMistakes, commandMistakes}) {
    for (Mistake& mistake : part()) all.push_back(std::move(mistake));
  }
  return all;
}

class Mistakes : public AppTest {
 protected:
  Mistakes() {
    const Result made =
        run("export '" EFM_RECORDINGS "/desk_stereo' --to folder --t0 1.4 --t1 1.8 --out base");
    EXPECT_EQ(made.status, 0) << made.err;
    base_ = readDraft(folder() / "base");
    write("rig.ini",
          "[keyframes]\nwindow_s = 0.2\nstride_s = 0.2\n[dsi]\nmin_depth_m = 0.55\n"
          "max_depth_m = 5\n[fusion]\nacross_cameras = harmonic\n");
  }
  /// Maps the recording with a change.
  Result mapWith(const Mistake& mistake) const {
    for (const char* name : {"data", "out"}) std::filesystem::remove_all(folder() / name);
    DraftRecording draft = base_;
    mistake.make(draft);
    writeDraft(draft, base_, folder() / "base", folder() / "data");
    return run("map rig.ini data --out out " + mistake.arguments);
  }

  DraftRecording base_;
};

TEST_F(Mistakes, HaveNames) {
  for (const Mistake& mistake : allMistakes()) {
    const Result result = mapWith(mistake);
    EXPECT_EQ(result.status, mistake.status) << mistake.name << ":\n" << result.err;
    ASSERT_FALSE(mistake.words.empty()) << mistake.name;
    for (const std::string& words : mistake.words) {
      EXPECT_THAT(result.err, HasSubstr(words)) << mistake.name;
    }
  }
}

TEST_F(Mistakes, AreNotSeenWhereThereAreNone) {
  const Result result = mapWith({"none", [](DraftRecording&) {}, "", kFine, {}});
  EXPECT_EQ(result.status, 0) << result.err;
  EXPECT_THAT(result.err, Not(HasSubstr("warning")));
  EXPECT_EQ(reportIn("out")["warnings"].size(), 0U);
  for (const char* preset : {"slider", "room_stereo"}) {
    const Result made =
        run(std::string("simulate --duration 0.15 --out ") + preset + " --preset " + preset);
    EXPECT_EQ(made.status, 0) << made.err;
    const Result mapped = run(std::string("map ") + preset +
                              " --set keyframes.window_s=0.1 --strict --out out_" + preset);
    EXPECT_EQ(mapped.status, 0) << preset << ":\n" << mapped.err;
    EXPECT_THAT(mapped.err, Not(HasSubstr("warning"))) << preset;
  }
}

}  // namespace
}  // namespace efm
