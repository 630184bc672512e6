// SPDX-License-Identifier: BSD-3-Clause
// Tests that each mistake gives a warning with a name, or an error.

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <sstream>
#include <string>
#include <vector>

#include "event_fusion/engine.h"
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
  /// Maps the recording after a change.
  Result mapWith(const Mistake& mistake) const {
    for (const char* name : {"data", "out"}) std::filesystem::remove_all(folder() / name);
    DraftRecording draft = base_;
    mistake.make(draft);
    writeDraft(draft, base_, folder() / "base", folder() / "data");
    return run("map rig.ini data --out out " + mistake.arguments);
  }

  DraftRecording base_;
};

/// Returns whether a line begins as expected.
bool begins(const std::string& line, const std::string& expected) {
  const char* at = line.c_str();
  for (const char* e = expected.c_str(); *e != '\0';) {
    if (*e != '~') {
      if (*at++ != *e++) return false;
      continue;
    }
    char* end_of_expected = nullptr;
    char* end_of_found = nullptr;
    const double number = std::strtod(e + 1, &end_of_expected);
    const double found = std::strtod(at, &end_of_found);
    if (end_of_found == at || std::abs(found - number) > 0.2 * std::abs(number)) return false;
    e = end_of_expected;
    at = end_of_found;
  }
  return true;
}

TEST_F(Mistakes, AreNamedWithTheirNumbersAndNothingElseIs) {
  for (const Mistake& mistake : allMistakes()) {
    const Result result = mapWith(mistake);
    SCOPED_TRACE(mistake.name + (":\n" + result.err));
    std::vector<std::string> expected;
    for (const std::string& line : mistake.lines) {
      const std::size_t at = line.find('#');
      expected.push_back(line);
      if (at == std::string::npos) continue;
      expected.back()[at] = '0';
      expected.push_back(line);
      expected.back()[at] = '1';
    }
    const bool fails = std::any_of(expected.begin(), expected.end(), [](const std::string& line) {
      return line.rfind("error: ", 0) == 0;
    });
    EXPECT_EQ(result.status, fails ? 1 : 0);
    const bool exactly = expected.back() != "…";
    if (!exactly) expected.pop_back();
    std::istringstream err(result.err);
    std::size_t found = 0;
    for (std::string line; std::getline(err, line);) {
      if (line.rfind("event-fusion: mapping ", 0) == 0) continue;  // progress, on a slow machine
      const auto known = std::find_if(expected.begin(), expected.end(), [&](const auto& begin) {
        return begins(line, "event-fusion: " + begin);
      });
      if (known != expected.end()) {
        expected.erase(known);
        ++found;
      } else {
        EXPECT_FALSE(exactly) << "unexpected: " << line;
      }
    }
    EXPECT_THAT(expected, testing::IsEmpty());
    EXPECT_GT(found, 0U);
  }
}

TEST_F(Mistakes, AreNotSeenWhereThereAreNone) {
  const Result result = mapWith({"none", [](DraftRecording&) {}, {}});
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

TEST_F(Mistakes, OfOwnDataAreNamedToo) {
  const std::vector<RigCamera> cameras = openRecording({folder() / "base"})->rig().cameras;
  const struct {
    const char* warning;
    std::function<void(DraftRecording&)> make;
  } kMistakes[] = {
      {"", [](DraftRecording&) {}},
      {"cameras-swapped ",
       [](DraftRecording& draft) { std::swap(draft.events[0], draft.events[1]); }},
      {"poses-inverted ",
       [](DraftRecording& draft) {
         for (StampedPose& pose : draft.poses) pose.T_world_rig = pose.T_world_rig.inverse();
       }},
      {"time-shift ",
       [](DraftRecording& draft) {
         for (StampedPose& pose : draft.poses) pose.t_ns += 100'000'000;
       }},
      {"polarity ",
       [](DraftRecording& draft) {
         for (Event& event : draft.events[0]) event.polarity = true;
       }},
  };
  for (const auto& mistake : kMistakes) {
    DraftRecording draft = base_;
    mistake.make(draft);
    std::string logged;
    Mapper::Callbacks callbacks;
    callbacks.warn = [&](const std::string& text) { logged += text; };
    Mapper mapper({}, callbacks);
    for (const RigCamera& camera : cameras) mapper.addCamera(camera);
    for (const StampedPose& pose : draft.poses) mapper.addPose(pose);
    for (int c = 0; c < 2; ++c) mapper.addEvents(c, draft.events[static_cast<std::size_t>(c)]);
    mapper.finish();
    std::string names;
    for (const Warning& warning : mapper.warnings()) names += warning.name + " ";
    EXPECT_THAT(names, HasSubstr(mistake.warning));
    EXPECT_EQ(names.empty(), *mistake.warning == '\0') << names;
    EXPECT_EQ(logged.empty(), names.empty() || names == "polarity ") << logged << names;
  }
}

}  // namespace
}  // namespace efm
