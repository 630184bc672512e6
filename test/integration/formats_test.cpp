// SPDX-License-Identifier: BSD-3-Clause
// Maps one recording in each format: the depth maps are equal. Independent programs wrote the files
// (test/formats).

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <random>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "plugin/recordings/open/open_recording.h"
#include "test/plugin/app/app_test.h"

namespace efm {
namespace {

namespace fs = std::filesystem;

const fs::path kFormats = EFM_RECORDINGS "/formats";

/// A recording as a user names it.
struct Recorded {
  std::string name;
  std::string sources;  ///< Files below `formats/`.
  std::string lacks;    ///< Parts that options must give: "calibration", "poses" or both.
};

void PrintTo(const Recorded& recorded, std::ostream* stream) { *stream << recorded.name; }

class Formats : public AppTest, public testing::WithParamInterface<Recorded> {
 protected:
  /// Returns depth map and confidence map of a window in the middle of the recording.
  std::string mapsOf(const std::string& recording) const {
    const Result result = run("depth " EFM_SOURCE_DIR "/config/simulated_stereo.ini " + recording +
                              " --t0 1.45 --t1 1.6 --out out");
    EXPECT_EQ(result.status, 0) << recording << "\n" << result.err;
    return contentOf("out/depth.tiff") + contentOf("out/confidence.tiff");
  }
  static std::string folderRecording() { return (kFormats / "desk").string(); }
  const std::string& mapsOfFolder() const {
    static const std::string maps = mapsOf(folderRecording());
    return maps;
  }

  static RecordingSource source() {
    RecordingSource source;
    std::istringstream paths(GetParam().sources);
    for (std::string path; paths >> path;) source.files.push_back(kFormats / path);
    const auto lacks = [](const char* part) {
      return GetParam().lacks.find(part) != std::string::npos;
    };
    if (lacks("calibration")) source.calibration = folderRecording() + "/camchain.yaml";
    if (lacks("poses")) source.poses = folderRecording() + "/poses.txt";
    return source;
  }

  /// Returns `source()` as arguments of the command line.
  static std::string arguments() {
    const RecordingSource recording = source();
    std::string arguments;
    for (const fs::path& file : recording.files) arguments += " " + file.string();
    if (!recording.calibration.empty())
      arguments += " --calibration " + recording.calibration.string();
    if (!recording.poses.empty()) arguments += " --poses " + recording.poses.string();
    return arguments;
  }
};

TEST_P(Formats, GivesTheDepthMapOfTheTextFolder) {
  EXPECT_TRUE(mapsOf(arguments()) == mapsOfFolder());
}

/// The options are chosen from the data of the interval only.
TEST_P(Formats, TheMapOfAnIntervalIsThatOfARecordingCutThere) {
  const auto map_of = [&](const std::string& recording) {
    const Result result = run("map " + recording + " --out out");
    EXPECT_EQ(result.status, 0) << recording << "\n" << result.err;
    const nlohmann::json counts = reportIn("out")["events"];
    EXPECT_EQ(counts["outside_window"], 0) << "events outside are not read";
    return contentOf("out/map.pcd");
  };
  std::mt19937 random(1);
  const double t0_s = 1.4 + 0.04 * static_cast<double>(random() % 1000) / 1000;
  const std::string interval = fmt::format(" --t0 {:.9f} --duration 0.18", t0_s);
  const std::string map = map_of(arguments() + interval);
  EXPECT_GT(map.size(), 10'000U);
  ASSERT_EQ(run("import " + arguments() + interval + " --out cut.rawlog").status, 0);
  EXPECT_TRUE(map_of("cut.rawlog") == map);
  ASSERT_EQ(run("import " + arguments() + " --out whole.rawlog").status, 0);
  EXPECT_TRUE(map_of("whole.rawlog" + interval) == map);
}

/// Returns the events of each camera.
std::map<int, std::vector<Event>> eventsOf(const RecordingSource& source) {
  std::map<int, std::vector<Event>> events;
  const std::unique_ptr<Recording> recording = openRecording(source);
  while (const auto sample = recording->next()) {
    const auto* packet = std::get_if<EventPacket>(&*sample);
    if (!packet) continue;
    std::vector<Event>& camera = events[packet->camera];
    camera.insert(camera.end(), packet->events.begin(), packet->events.end());
  }
  return events;
}

TEST_P(Formats, APartIsWhatTheWholeHasThere) {
  RecordingSource part = source();
  const std::map<int, std::vector<Event>> whole = eventsOf(part);
  ASSERT_EQ(whole.size(), 2U);
  std::mt19937 random(1);
  for (int trial = 0; trial < 4; ++trial) {
    const std::vector<Event>& camera = whole.at(trial % static_cast<int>(whole.size()));
    std::array<std::int64_t, 2> limits{};  // times of events, so each limit must be exact
    for (std::int64_t& limit : limits) limit = camera[random() % camera.size()].t_ns;
    const auto [start_ns, end_ns] = std::minmax({limits[0], limits[1] + trial});
    part.limits = {start_ns, end_ns};
    std::map<int, std::vector<Event>> expected;
    for (const auto& [index, events] : whole) {
      for (const Event& event : events) {
        if (event.t_ns >= start_ns && event.t_ns < end_ns) expected[index].push_back(event);
      }
    }
    std::map<int, std::vector<Event>> found = eventsOf(part);
    for (const auto& [index, events] : whole) {
      EXPECT_TRUE(found[index] == expected[index])
          << "camera " << index << " from " << start_ns << " to " << end_ns << ": "
          << found[index].size() << " events instead of " << expected[index].size();
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    All, Formats,
    testing::Values(
        Recorded{"csv", "text/csv", ""}, Recorded{"gz", "text/gz", ""},
        Recorded{"zip", "text/zip", ""}, Recorded{"minus", "text/minus", ""},
        Recorded{"evimo2",
                 "evimo2/left_camera/sfm/eval/scene_00 "
                 "evimo2/right_camera/sfm/eval/scene_00",
                 "calibration poses"},
        Recorded{"numpy", "numpy/metavision/cam0.npy numpy/fields/cam1.npy", "calibration poses"},
        Recorded{"e2vid", "hdf5/e2vid/left.h5 hdf5/e2vid/right.h5", "calibration poses"},
        Recorded{"dsec", "hdf5/dsec", "calibration poses"},
        Recorded{"tum_vie", "hdf5/tum_vie", "calibration poses"},
        Recorded{"m3ed", "hdf5/m3ed/desk_data.h5", "calibration poses"},
        Recorded{"mvsec", "hdf5/mvsec/desk_data.hdf5", "calibration poses"},
        Recorded{"metavision", "hdf5/metavision/left.h5 hdf5/metavision/right.h5",
                 "calibration poses"},
        Recorded{"evt2", "raw/evt2/cam0.raw raw/evt2/cam1.raw", "calibration poses"},
        Recorded{"evt21", "raw/evt21/cam0.raw raw/evt21/cam1.raw", "calibration poses"},
        Recorded{"evt21_legacy", "raw/evt21_legacy/cam0.raw raw/evt21_legacy/cam1.raw",
                 "calibration poses"},
        Recorded{"evt3", "raw/evt3/cam0.raw raw/evt3/cam1.raw", "calibration poses"},
        Recorded{"aedat4", "aedat4/lz4.aedat4", "calibration poses"},
        Recorded{"bag_dvs", "ros1_bag/dvs.bag", "calibration"},
        Recorded{"bag_prophesee", "ros1_bag/prophesee_lz4.bag", "calibration"},
        Recorded{"bag_evt3", "ros1_bag/evt3_bz2.bag", "calibration"},
        Recorded{"bag_mono", "ros1_bag/mono.bag", "calibration"},
        Recorded{"ros2_dvs", "ros2_bag/dvs", "calibration"},
        Recorded{"ros2_mono", "ros2_bag/mono.db3", "calibration"},
        Recorded{"mcap_evt3", "ros2_bag/evt3.mcap", "calibration"},
        Recorded{"mcap_prophesee", "ros2_bag/prophesee.mcap", "calibration"}),
    [](const auto& row) { return row.param.name; });

TEST_F(Formats, ExportedRecordingsGiveTheDepthMapOfTheTextFolder) {
  const std::string maps = mapsOf(folderRecording());
  EXPECT_GT(reportIn("out")["points"], 2000) << "the maps show something";
  ASSERT_EQ(run("import " + folderRecording() + " --out r.rawlog --compression zstd").status, 0);
  EXPECT_TRUE(mapsOf("r.rawlog") == maps);
  // MCAP has no message for the camera poses on the rig.
  const std::string calibration = " --calibration " + folderRecording() + "/camchain.yaml";
  for (const auto& [format, options] :
       {std::pair<std::string, std::string>{"folder", ""}, {"mcap", calibration}}) {
    const Result result = run("export r.rawlog --to " + format + " --out " + format);
    ASSERT_EQ(result.status, 0) << result.err;
    EXPECT_TRUE(mapsOf(format + options) == maps) << format;
  }
}

}  // namespace
}  // namespace efm
