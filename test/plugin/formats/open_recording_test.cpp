// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/formats/open_recording.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "plugin/mrpt/CObservationEvents.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::IsSupersetOf;

class OpenRecording : public TemporaryFolder {
 protected:
  static std::string errorOf(const std::vector<std::filesystem::path>& sources,
                             const std::string& format = "auto") {
    RecordingSource source;
    source.files = sources;
    source.format = format;
    return errorOfSource(source);
  }
  static std::string errorOfSource(const RecordingSource& source) {
    try {
      openRecording(source);
    } catch (const std::exception& error) {
      return error.what();
    }
    return "no error";
  }
};

TEST_F(OpenRecording, AMissingSourceIsNamed) {
  EXPECT_THAT(errorOf({folder() / "nowhere"}), HasSubstr("nowhere: no such file or folder"));
}

TEST_F(OpenRecording, AnotherFolderIsAnErrorThatNamesTheExpectedFiles) {
  std::ofstream(folder() / "notes.txt") << "nothing";
  EXPECT_THAT(errorOf({folder()}), AllOf(HasSubstr("not a recording"), HasSubstr("camchain.yaml"),
                                         HasSubstr("events.txt"), HasSubstr("calib.txt")));
}

TEST_F(OpenRecording, AFileThatNobodyReadsIsAnErrorOfTheReaderThatFitsBest) {
  using namespace std::string_literals;
  std::filesystem::create_directory(folder() / "bag");
  const std::string other_columns = " (other columns: --event-columns, - for one to ignore)";
  const struct {
    const char* file;
    std::string bytes;
    std::string error;  // behind the name
  } rows[] = {
      {"e.txt", "0.1 1 2 up\n",
       ":1: '0.1 1 2 up': p = 'up': expected polarity 0 or 1, or -1 or 1, or True or False, or ON "
       "or "
       "OFF"},
      {"e.txt", "# events\n\n0.1 1 b 0\n", ":3: '0.1 1 b 0': y = 'b': expected a number"},
      {"e.txt", "0,1 1 2 0\n",
       ":1: '0,1 1 2 0': decimal commas: expected decimal points (tr , . <FILE >NEW)"},
      {"e.csv", "t;x;y;p\n0,1;1;2;0\n",
       ":2: '0,1;1;2;0': decimal commas: expected decimal points (tr , . <FILE >NEW)"},
      {"e.txt", "0.1 1 2 0 7\n",
       ":1: '0.1 1 2 0 7': expected 4 fields, t x y p, not 5" + other_columns},
      {"e.csv", "x,y,p,t\n1,2,0\n",
       ":2: '1,2,0': expected 4 fields, x y p t, not 3" + other_columns},
      {"poses.txt",
       "\xEF\xBB\xBF"
       "0.1 1 2 3 0 0 0 1\n",
       ": poses: expected --poses PATH"},
      {"kitti.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n",
       ":1: '1 0 0 0 0 1 0 0 0 0 1 0': 12 numbers, as poses of KITTI have, which have no times: "
       "expected t tx ty tz qx qy qz qw, or a .npz file with N times and N x 4 x 4 matrices"},
      {"calib.txt", "200 200 120 90 0 0 0 0 0\n", ": a calibration: expected --calibration PATH"},
      {"rig.ini", "[dsi]\nnum_planes = 5\n",
       ": an .ini file among the sources: expected one option file, --config NAME; a calibration "
       "is "
       "given with --calibration"},
      {"old.raw", "% date 2020-01-01\n% plugin_name hal\n\0\1\2"s,
       ": a file of Prophesee without a line '% evt 3.0' (or 2.0, 2.1) in its header: the encoding "
       "of "
       "its events is not known; give the RAW file as it was recorded (docs/recordings.md)"},
      {"a.es", "Event Stream\2\0\0\1"s,
       ": an Event Stream file (.es): it is not read; save the t, x, y and on that the Python "
       "package "
       "event_stream reads as a NumPy array, and give --time-unit us (docs/recordings.md)"},
      {"bag/metadata.yaml", "rosbag2_bagfile_information:\n  version: 5\n",
       ": the description of a ROS 2 bag: expected its folder, FOLDER (docs/recordings.md)"},
      {"notes.txt", "words\n",
       ": not a recording (it begins with 'words\\x0a'): expected a rawlog, or a recording in "
       "another format (docs/recordings.md)"},
      {"readme", "gain = 5 at 3 of the set\n",
       ": not a recording (it begins with 'gain = 5 at 3 of the set'): expected a rawlog, or a "
       "recording in another format (docs/recordings.md)"},
      {"my.rawlog", "words\n",
       ": not a rawlog (it begins with 'words\\x0a'): expected a rawlog, or a recording in another "
       "format (docs/recordings.md)"},
  };
  for (const auto& [name, bytes, error] : rows) {
    const std::filesystem::path file = folder() / name;
    std::ofstream(file, std::ios::binary) << bytes;
    std::string expected = error;
    for (const auto& [word, path] : {std::pair<std::string, std::filesystem::path>{"PATH", file},
                                     {"FOLDER", file.parent_path()}}) {
      const std::size_t at = expected.find(word);
      if (at != std::string::npos) expected.replace(at, word.size(), path.string());
    }
    EXPECT_EQ(errorOf({file}), file.string() + expected);
  }
}

TEST_F(OpenRecording, FiveColumnsAreReadWithTheOption) {
  std::ofstream(folder() / "e.txt") << "0.1 1 2 0 left\n";
  RecordingSource source;
  source.files = {folder() / "e.txt"};
  source.reader.columns = "t x y p -";
  source.complete = false;
  EXPECT_NE(openRecording(source)->next(), nullptr);
}

/// The size of the first camera, and the number of poses and of warnings.
struct Opened {
  int width = 0;
  int poses = 0;
  std::vector<std::string> warnings;
};
Opened openedOf(const RecordingSource& source) {
  Opened opened;
  const auto recording = openRecording(source);
  while (const auto observation = recording->next()) {
    const auto* events = dynamic_cast<const CObservationEvents*>(observation.get());
    if (events != nullptr) opened.width = static_cast<int>(events->camera.width);
    if (events == nullptr) ++opened.poses;
  }
  for (const Warning& warning : recording->counts().warnings) {
    opened.warnings.push_back(warning.name + ": " + warning.text);
  }
  return opened;
}

TEST_F(OpenRecording, TheOnlyCalibrationAndTheOnlyPosesOfAFolderAreTakenAndSaid) {
  const std::string camera =
      "cam0: {camera_model: pinhole, intrinsics: [200, 201, 120, 90], distortion_model: none, "
      "resolution: [346, 260]}\n";
  std::ofstream(folder() / "events.txt") << "0.1 300 2 0\n0.2 1 2 1\n";
  std::ofstream(folder() / "imu.txt") << "0.1 1 2 3 4 5 6\n";
  std::ofstream(folder() / "my rig.yaml") << camera;
  std::ofstream(folder() / "tracker.csv") << "t_ns,x,y,z,qx,qy,qz,qw\n5,1,2,3,0,0,0,1\n";
  RecordingSource source;
  source.files = {folder()};
  const Opened opened = openedOf(source);
  EXPECT_EQ(opened.width, 346);
  EXPECT_EQ(opened.poses, 1);
  const auto said = [&](const char* name, const char* option) {
    return "found-file: " + (folder() / name).string() +
           ": taken, as the only one in the folder (" + option + ")";
  };
  EXPECT_THAT(opened.warnings, testing::ElementsAre(said("my rig.yaml", "--calibration"),
                                                    said("tracker.csv", "--poses")));
  std::ofstream(folder() / "other.yaml") << camera;
  EXPECT_THAT(
      errorOf({folder()}),
      HasSubstr("no calibration: expected calib.txt (not clear: my rig.yaml, other.yaml), or "
                "--calibration FILE"));
  std::ofstream(folder() / "second.txt") << "0.1 1 2 3 0 0 0 1\n";
  source.calibration = folder() / "other.yaml";
  EXPECT_THAT(
      errorOfSource(source),
      HasSubstr("no poses: expected groundtruth.txt (not clear: second.txt, tracker.csv), or"));
  // Names that the layout knows come first, without a word.
  std::ofstream(folder() / "groundtruth.txt") << "0.1 1 2 3 0 0 0 1\n0.2 1 2 3 0 0 0 1\n";
  const Opened known = openedOf(source);
  EXPECT_EQ(known.poses, 2);
  EXPECT_THAT(known.warnings, testing::IsEmpty());
}

TEST_F(OpenRecording, TheSensorsSizeMayBeTold) {
  std::ofstream(folder() / "e.txt") << "0.1 300 2 0\n0.2 1 2 1\n";
  std::ofstream(folder() / "calib.txt") << "200 200 120 90 0 0 0 0 0\n";
  RecordingSource source;
  source.files = {folder() / "e.txt"};
  source.reader.sensor_size = CameraSize{320, 240};
  source.complete = false;
  EXPECT_EQ(openedOf(source).width, 320);
  source.calibration = folder() / "calib.txt";  // without a size
  EXPECT_EQ(openedOf(source).width, 320);
  std::ofstream(folder() / "e.txt") << "640 480\n0.1 300 2 0\n0.2 1 2 1\n";
  EXPECT_EQ(errorOfSource(source),
            "--sensor-size 320x240: " + (folder() / "e.txt").string() + " has 640x480 pixels");
}

TEST_F(OpenRecording, AnUnknownFormatIsNamed) {
  EXPECT_THAT(errorOf({folder()}, "tape"), HasSubstr("'tape'"));
}

TEST_F(OpenRecording, FormatsBeginWithAuto) {
  const std::vector<std::string> names = recordingFormats();
  EXPECT_EQ(names.front(), "auto");
  EXPECT_THAT(names, IsSupersetOf({"rawlog", "folder", "uzh"}));
}

}  // namespace
}  // namespace efm
