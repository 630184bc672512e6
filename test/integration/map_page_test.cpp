// SPDX-License-Identifier: BSD-3-Clause
// Tests map.html in a browser without a window: it draws, reacts to mouse and keys, and loads no
// other file.
#include <gmock/gmock.h>
#include <unistd.h>

#include <cstring>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <random>
#include <string>
#include <vector>

#include "mapping/geometry/rigid3.h"
#include "plugin/results/viewer/map_page.h"
#include "test/integration/letter_f.h"
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

  /// Opens a copy of the page with the probe in it. @return the probe's measurements.
  json measure(const std::filesystem::path& page, const std::string& options = "",
               const std::string& probe = "page_probe.js") const {
    std::string html = contentOf(page);
    const auto insert = [&](const char* before, const std::string& script) {
      html.insert(html.rfind(before), "<script>" + script + "</script>");
    };
    insert("</body>", contentOf(EFM_SOURCE_DIR "/test/integration/" + probe));
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

  /// Expects the properties that every page must have.
  static void expectSound(const json& measured) {
    EXPECT_THAT(measured["problems"], IsEmpty()) << measured["problems"];
    EXPECT_THAT(measured["requests"], IsEmpty()) << measured["requests"];
    EXPECT_EQ(measured["refused"], 3) << "the page's policy refuses requests of three kinds";
    EXPECT_EQ(measured["gl_error"], 0);
    for (const char* change : {"turned", "moved", "zoomed", "turned_by_key", "aimed", "coloured"}) {
      // A change of the view moves most of the drawn pixels.
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
  // A semi-dense map has lines on an empty ground. The view has 1026 x 768 pixels.
  EXPECT_GT(light["drawn"], 5000);
  EXPECT_LT(light["drawn"], 400000);
  EXPECT_EQ(light["picture_sizes"], json({{346, 260}, {346, 260}})) << "depth map and events";
  const json report = json::parse(contentOf(out + "/report.json"));
  EXPECT_THAT(
      light["text"].get<std::string>(),
      testing::AllOf(HasSubstr(out),
                     HasSubstr(std::to_string(report["keyframes"].get<int>()) + " keyframes"),
                     HasSubstr(report["chosen"][0]["reason"].get<std::string>())));
  ASSERT_EQ(run("export \"" + out + "\" --out session.html").status, 0);
  const json again = measure("session.html");
  expectSound(again);
  EXPECT_EQ(again["points"], light["points"]);
  const json dark = measure(out + "/map.html", "--force-dark-mode");
  expectSound(dark);
  EXPECT_NE(dark["dark"], light["dark"]);
  EXPECT_NEAR(dark["drawn"].get<double>(), light["drawn"].get<double>(),
              0.02 * light["drawn"].get<double>())
      << "the same on another ground";
}

/// Decodes base 64.
std::vector<std::uint8_t> bytesOf(const std::string& text) {
  std::vector<std::uint8_t> bytes;
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    const char* const digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const char* const digit = std::strchr(digits, c);
    if (digit == nullptr || c == '\0') break;
    bits = bits << 6 | static_cast<std::uint32_t>(digit - digits);
    count += 6;
    if (count < 8) continue;
    count -= 8;
    bytes.push_back(static_cast<std::uint8_t>(bits >> count));
  }
  return bytes;
}

/// The map has terraces of 300 x 300 m, seen by 500 keyframes.
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
    cv::randu(depth, -10, 10);  // noise gives the largest pictures
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
                             HasSubstr("left out to keep it small"), HasSubstr("made-up-warning"),
                             HasSubstr("made-up-note")));
}

/// Returns the mean colour (BGR) of the drawn pixels in some rows of a box.
cv::Vec3d colourOf(const cv::Mat3b& picture, const cv::Mat1b& mask, const cv::Rect& rows) {
  const cv::Scalar mean = cv::mean(picture(rows), mask(rows));
  return {mean[0], mean[1], mean[2]};
}

/// Height, confidence, support and keyframe number of an F rise from its foot to its top. The world
/// is rotated against the view. The F must be upright for a person and have the bar's colours.
TEST_F(MapPageInABrowser, AnFStandsUprightInTheColoursOfTheBar) {
  Eigen::Matrix3d y_down;  // the frame of the first camera
  y_down << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  const Eigen::Matrix3d back = Eigen::AngleAxisd(kPi, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const struct {
    const char* view;
    Eigen::Matrix3d R_world_view;  ///< The view has x right, y forwards and z up.
    Eigen::Vector3d along;         ///< Direction of the F's stem.
  } cases[] = {{"front", y_down, {0, 0, 1}}, {"top", back, {0, 1, 0}}};
  constexpr int kKeyframes = 11;
  for (const auto& [view, R_world_view, along] : cases) {
    std::vector<CloudPoint> points;
    const auto add = [&, R = R_world_view, along = along](double right, double up) {
      const double share = up / 2;
      points.push_back(
          {R * (right * Eigen::Vector3d::UnitX() + up * along + Eigen::Vector3d(0, 3, 5)),
           static_cast<float>(std::pow(100, share)),
           1 + static_cast<std::uint32_t>(std::lround(40 * share)),
           static_cast<std::uint64_t>(std::lround((kKeyframes - 1) * share))});
    };
    for (int i = 0; i <= 400; ++i) {
      add(0, 0.005 * i);
      add(0.0025 * i, 2);
      add(0.00125 * i, 1);
    }
    for (int i = 0; i < 40; ++i) add(0.001 * i, 0);  // enough points for the low end of the bar
    Eigen::Matrix3d R_view_cam;                      // columns: x right, y down, z forwards
    R_view_cam << 1, 0, 0, 0, 0, 1, 0, -1, 0;
    std::vector<StampedPose> trajectory;
    for (int i = 0; i < kKeyframes; ++i) {
      trajectory.push_back({i * 1'000'000'000LL,
                            {Eigen::Quaterniond(Eigen::Matrix3d(R_world_view * R_view_cam)),
                             R_world_view * Eigen::Vector3d(0.1 * i, 2, 5)}});
    }
    {
      std::ofstream file(folder() / "map.html", std::ios::binary);
      const KeyframePictures pictures({});
      writeMapPage(file, {"F", *mapCloudOf(points, 1e-4), 1e-4, trajectory, pictures,
                          ReferenceView{640, 480, 300, 300, 320, 240},
                          contentOf(EFM_SOURCE_DIR "/test/integration/page_report.json")});
    }
    const json measured = measure("map.html", "", "page_letter_probe.js");
    EXPECT_THAT(measured["problems"], IsEmpty()) << measured["problems"];
    int seen = 0;
    for (const json& drawn : measured["views"]) {
      const std::string colour = drawn["colour"];
      if (drawn["view"] != view) continue;
      SCOPED_TRACE(view + (" " + colour));
      const cv::Mat3b picture = cv::imdecode(bytesOf(drawn["picture"]), cv::IMREAD_COLOR);
      const cv::Vec3b ground = picture(0, 0);
      cv::Mat1b mask;
      cv::inRange(picture, ground, ground, mask);
      mask = mask == 0;
      const cv::Rect box = cv::boundingRect(mask);
      expectF(mask);
      ++seen;
      if (colour == "height" && along.z() == 0) continue;
      // The view is centred on the F: the middle of the colour range is at half of its height.
      const auto& bar = drawn["bar"];
      EXPECT_EQ(drawn["direction"], "linear-gradient(to right");
      for (const double share : {0.0, 0.5, 1.0}) {
        const int y = box.y + static_cast<int>(std::lround((1 - share) * (box.height - 6)));
        const cv::Vec3d found = colourOf(picture, mask, {box.x, y, box.width, 6});
        const double place = share * static_cast<double>(bar.size() - 1);
        const auto below = static_cast<std::size_t>(place);
        const json& a = bar[below];
        const json& b = bar[std::min(below + 1, bar.size() - 1)];
        for (int channel = 0; channel < 3; ++channel) {
          const double part = place - static_cast<double>(below);
          const double expected =
              (1 - part) * a[channel].get<double>() + part * b[channel].get<double>();
          EXPECT_NEAR(found[2 - channel], expected, 12) << "at " << share;
        }
      }
      const std::pair<std::string, std::string> ends = {drawn["low"], drawn["high"]};
      const std::map<std::string, std::pair<std::string, std::string>> expected = {
          {"height", {"5.00", "7.00"}},
          {"confidence", {"1", "100"}},
          {"support", {"1", "41 or more"}},
          {"time", {"0.00", "10.00"}}};
      EXPECT_EQ(ends, expected.at(colour));
    }
    EXPECT_EQ(seen, 4);
  }
}

}  // namespace
}  // namespace efm
