// SPDX-License-Identifier: BSD-3-Clause
// Tests that each mistake gives a warning with a name, or an error.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <sstream>
#include <string>
#include <vector>

#include "event_fusion/engine.h"
#include "mapping/geometry/rigid3.h"
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
    readBase("--t0 1.4 --t1 1.8");
    write("rig.ini",
          "[keyframes]\nwindow_s = 0.2\nstride_s = 0.2\n[dsi]\nmin_depth_m = 0.55\n"
          "max_depth_m = 5\n[fusion]\nacross_cameras = harmonic\n");
  }
  /// Takes a part of the desk's recording.
  void readBase(const std::string& part) {
    std::filesystem::remove_all(folder() / "base");
    const Result made =
        run("export '" EFM_RECORDINGS "/desk_stereo' --to folder --out base " + part);
    EXPECT_EQ(made.status, 0) << made.err;
    base_ = readDraft(folder() / "base");
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

// The table of docs/recordings.md, "A symptom is not a cause": one desk, the automatic options.
TEST_F(Mistakes, AreAmongTheCausesThatEachWarningNames) {
  readBase("--t0 1.2 --t1 2.4");
  write("rig.ini", "");
  constexpr double kDegree = kRadiansPerDegree;
  /// Turns camera 1, in place.
  const auto turned = [](const Eigen::Vector3d& turn_rad) {
    return [turn_rad](DraftRecording& draft) {
      const Eigen::Matrix3d R = rotationBy(turn_rad).toRotationMatrix().transpose();
      const double x_m = -0.1;  // camera 1 lies 10 cm to the right of camera 0
      std::string rows;
      for (int row = 0; row < 3; ++row) {
        rows +=
            fmt::format("  - [{}, {}, {}, {}]\n", R(row, 0), R(row, 1), R(row, 2), x_m * R(row, 0));
      }
      const std::size_t begin = draft.camchain.find("  - [1, 0, 0,");
      const std::size_t end = draft.camchain.find("  - [0, 0, 0, 1]");
      ASSERT_LT(begin, end) << draft.camchain;
      draft.camchain.replace(begin, end - begin, rows);
    };
  };
  /// Replaces the last place of a text, which is that of camera 1.
  const auto ofCamera1 = [](const std::string& part, const std::string& by) {
    return [part, by](DraftRecording& draft) {
      ASSERT_NE(draft.camchain.rfind(part), std::string::npos) << draft.camchain;
      draft.camchain.replace(draft.camchain.rfind(part), part.size(), by);
    };
  };
  const auto eachPose = [](auto change) {
    return [change](DraftRecording& draft) {
      for (StampedPose& pose : draft.poses) change(pose);
    };
  };
  const struct {
    const char* name;
    std::function<void(DraftRecording&)> make;
    std::vector<std::string> words;  // each warning has one of them
    std::string arguments{};
  } kFaults[] = {
      {"camera 1 turned about the baseline", turned({0.5 * kDegree, 0, 0}), {"extrinsics"}},
      {"camera 1 turned about y",
       turned({0, 0.5 * kDegree, 0}),
       {"extrinsics", "pose of the cameras"}},
      {"camera 1 turned about its view", turned({0, 0, 0.5 * kDegree}), {"extrinsics"}},
      {"principal point", ofCamera1("173, 130", "176, 130"), {"principal point"}},
      {"focal length", ofCamera1("226, 226", "233, 233"), {"focal length"}},
      {"lens",
       ofCamera1("distortion_coeffs: []\n  distortion_model: none",
                 "distortion_coeffs: [-0.1, 0, 0, 0]\n  distortion_model: radtan"),
       {"lens"}},
      {"clock of camera 1", [](DraftRecording&) {}, {"clock"}, "--set rig.time_offsets_s=0,0.012"},
      {"clock of camera 1, more",
       [](DraftRecording&) {},
       {"clock"},
       "--set rig.time_offsets_s=0,0.06"},
      {"clock of the poses",
       eachPose([](StampedPose& pose) { pose.t_ns += 60'000'000; }),
       {"with the poses", "clock of the poses"}},
      {"cropped pictures",
       [](DraftRecording& draft) {
         for (std::vector<Event>& events : draft.events) {
           std::vector<Event> kept;
           for (Event event : events) {
             if (event.x < 40) continue;
             event.x = static_cast<std::uint16_t>(event.x - 40);
             kept.push_back(event);
           }
           events = std::move(kept);
         }
       },
       {"cropped"}},
      {"quaternions with w first",
       eachPose([](StampedPose& pose) {
         const Eigen::Quaterniond q = pose.T_world_rig.rotation;
         pose.T_world_rig.rotation = Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y());
       }),
       {"quaternion"}},
      {"poses that are T_rig_world",
       eachPose([](StampedPose& pose) { pose.T_world_rig = pose.T_world_rig.inverse(); }),
       {"inverted"}},
      {"poses in millimetres",
       eachPose([](StampedPose& pose) { pose.T_world_rig.translation *= 1000; }),
       {"metres", "poses"}},
      {"half of the poses",
       [](DraftRecording& draft) { draft.poses.resize(draft.poses.size() / 2); },
       {"complete", "end early"}},
      {"errors of a tracker",
       [](DraftRecording&) {},
       {"the poses"},
       "--perturb tracker=typical,seed=1"},
  };
  for (const auto& fault : kFaults) {
    const Result result = mapWith({fault.name, fault.make, {}, fault.arguments});
    SCOPED_TRACE(fault.name + (":\n" + result.err));
    ASSERT_EQ(result.status, 0);
    const auto report = reportIn("out");
    EXPECT_GT(report["warnings"].size(), 0U);
    for (const auto& warning : report["warnings"]) {
      const std::string text = warning["text"];
      EXPECT_TRUE(std::any_of(fault.words.begin(), fault.words.end(), [&](const std::string& word) {
        return text.find(word) != std::string::npos;
      })) << text;
    }
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
