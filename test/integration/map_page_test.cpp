// SPDX-License-Identifier: BSD-3-Clause
// map.html in a browser without a window: it draws, answers to mouse and keys, and asks for
// nothing.
#include <gmock/gmock.h>
#include <unistd.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <vector>

#include "plugin/viewer/map_page.h"
#include "test/paths.h"
#include "test/plugin/program_test.h"

namespace efm {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::IsEmpty;

class MapPageInABrowser : public ProgramTest {
 protected:
  void SetUp() override {
    for (const char* name : {"chromium", "chromium-browser", "google-chrome"}) {
      if (isInstalled(name)) browser_ = name;
    }
    if (browser_.empty()) GTEST_SKIP() << "there is no browser: the Debian package chromium";
  }

  /// Opens a copy of the page with the probe in it. @return what the probe measured.
  json measure(const std::filesystem::path& page, const std::string& options = "") const {
    std::string html = contentOf(page);
    const auto insert = [&](const char* before, const std::string& script) {
      html.insert(html.rfind(before), "<script>" + script + "</script>");
    };
    insert("</body>", contentOf(EFM_SOURCE_DIR "/test/integration/page_probe.js"));
    insert("<link rel=\"icon\"", R"(const problems = [];
      for (const kind of ["error", "unhandledrejection", "securitypolicyviolation"])
        addEventListener(kind, e => problems.push(`${kind} ${e.message || e.reason || e.blockedURI}`));
      for (const kind of ["error", "warn"])
        console[kind] = (...texts) => problems.push(`console.${kind} ${texts.join(" ")}`);)");
    write("probed.html", html);
    const Result result = shell(
        "timeout 300 " + browser_ + (geteuid() == 0 ? " --no-sandbox" : "") +
        " --headless --use-angle=swiftshader --enable-unsafe-swiftshader --window-size=1366,768"
        " --virtual-time-budget=60000 --timeout=240000 --dump-dom --user-data-dir=profile " +
        options + " \"file://$PWD/probed.html\"");
    const std::string begin = "<pre id=\"measured\">";
    const std::size_t at = result.out.find(begin);
    const std::size_t end = result.out.find("</pre>", at);
    if (at == std::string::npos || end == std::string::npos) {
      ADD_FAILURE() << "the probe did not end: status " << result.status << "\n" << result.err;
      return {};
    }
    return json::parse(result.out.substr(at + begin.size(), end - at - begin.size()));
  }

  /// What holds for every page.
  static void expectSound(const json& measured) {
    EXPECT_THAT(measured["problems"], IsEmpty()) << measured["problems"];
    EXPECT_THAT(measured["requests"], IsEmpty()) << measured["requests"];
    EXPECT_EQ(measured["refused"], 3) << "the page's policy refuses requests of three kinds";
    EXPECT_EQ(measured["gl_error"], 0);
    for (const char* change : {"turned", "moved", "zoomed", "turned_by_key", "aimed", "coloured"}) {
      // A change of the view moves most of what is drawn.
      EXPECT_GT(measured[change].get<double>(), 0.5 * measured["drawn"].get<double>()) << change;
    }
    const json& grown = measured["grown"];
    for (const char* count : {"shown", "drawn"}) {
      EXPECT_GT(grown[0][count], 0) << count;
      EXPECT_LT(grown[0][count], grown[1][count]) << count;
      EXPECT_LT(grown[1][count], grown[2][count]) << count;
    }
    EXPECT_EQ(grown[2]["shown"], measured["points"]);
    EXPECT_GT(measured["in_slab"], 0);
    EXPECT_LT(measured["in_slab"], measured["points"]);
    EXPECT_EQ(measured["selected"], 0);
  }

  std::string browser_;
};

TEST_F(MapPageInABrowser, OfTheDeskDrawsAndAnswers) {
  const std::string out = "desk <b>&amp; 'table'";
  const std::string desk = EFM_RECORDINGS "/desk_stereo";
  ASSERT_EQ(run("map -q '" + desk + "' --out \"" + out + "\"").status, 0);
  const json light = measure(out + "/map.html");
  expectSound(light);
  // A semi-dense map: lines on an empty ground. 1026 x 768 pixels.
  EXPECT_GT(light["drawn"], 5000);
  EXPECT_LT(light["drawn"], 400000);
  EXPECT_EQ(light["picture_sizes"], json({{346, 260}, {346, 260}})) << "depth map and events";
  const json report = json::parse(contentOf(out + "/report.json"));
  EXPECT_THAT(
      light["text"].get<std::string>(),
      testing::AllOf(HasSubstr(out),
                     HasSubstr(std::to_string(report["keyframes"].get<int>()) + " keyframes"),
                     HasSubstr(report["chosen"][0]["reason"].get<std::string>())));
  const json dark = measure(out + "/map.html", "--force-dark-mode");
  expectSound(dark);
  EXPECT_NE(dark["dark"], light["dark"]);
  EXPECT_NEAR(dark["drawn"].get<double>(), light["drawn"].get<double>(),
              0.02 * light["drawn"].get<double>())
      << "the same on another ground";
}

/// Terraces of 300 x 300 m, seen by 500 keyframes.
TEST_F(MapPageInABrowser, OfTwoMillionPointsIsSmallDrawsAndTurns) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> coordinate(0, 300);
  std::vector<CloudPoint> points;
  for (int i = 0; i < 2'300'000; ++i) {
    const double x = coordinate(random), y = coordinate(random);
    points.push_back({{x, y, std::floor(x / 30) + 0.01 * coordinate(random)},
                      static_cast<float>(1 + y),
                      1 + static_cast<std::uint32_t>(y / 20),
                      static_cast<std::uint64_t>(x / 300 * 499)});
  }
  std::vector<StampedPose> trajectory;
  const Eigen::Quaterniond down(0, 1, 0, 0);
  for (int i = 0; i < 500; ++i) {
    trajectory.push_back({i * 1'000'000'000LL, {down, {0.6 * i, 150, 40}}});
  }
  KeyframePictures pictures({});
  cv::Mat1f depth(480, 640);
  cv::Mat_<cv::Vec2i> events(depth.size());
  for (int i = 0; i < 500; ++i) {
    cv::randu(depth, -10, 10);  // noise: the largest pictures there are
    cv::randu(events, 0, 3);
    pictures.add(depth, events);
  }
  const ReferenceView view{640, 480, 300, 300, 320, 240};
  {
    std::ofstream file(folder() / "map.html", std::ios::binary);
    writeMapPage(file, {"terraces", *mapCloudOf(points, 0.05), 0.05, trajectory, pictures, view,
                        contentOf(EFM_SOURCE_DIR "/test/integration/page_report.json")});
  }
  EXPECT_LT(file_size(folder() / "map.html"), 40'000'000U);
  const json measured = measure("map.html");
  expectSound(measured);
  EXPECT_GT(measured["points"], 1'400'000);
  EXPECT_LE(measured["points"], 2'000'000);
  EXPECT_GT(measured["drawn"], 100'000);
  EXPECT_THAT(measured["text"].get<std::string>(),
              testing::AllOf(HasSubstr("of the 2,300,000 points of the map"),
                             HasSubstr("left out to keep it small"), HasSubstr("made-up-warning")));
}

}  // namespace
}  // namespace efm
