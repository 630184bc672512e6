// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <opencv2/imgcodecs.hpp>

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "plugin/recordings/open/open_recording.h"
#include "plugin/recordings/open/recording_formats.h"
#include "plugin/recordings/text/dataset_folder.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using testing::HasSubstr;

constexpr const char* kCamera =
    "cam0: {camera_model: pinhole, intrinsics: [200, 201, 120, 90], distortion_model: none, "
    "resolution: [346, 260]}\n";

/// Returns two cameras of 240 x 180 pixels. @param shift_ms clock shift of the second camera.
std::string twoCamchain(int shift_ms = 0) {
  std::string text;
  for (const char* name : {"cam0", "cam1"}) {
    text += name +
            std::string(
                ":\n  camera_model: pinhole\n  intrinsics: [200, 200, 120, 90]\n"
                "  distortion_model: none\n  resolution: [240, 180]\n"
                "  T_cn_cnm1: [[1, 0, 0, -0.1], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n"
                "  timeshift_cam_imu: ") +
            std::to_string(name[3] == '1' ? 1e-3 * shift_ms : 0) + "\n";
  }
  return text;
}

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
    return messageOf([&] { openRecording(source); });
  }
  void write(const char* name, const std::string& text) const { writeFile(folder() / name, text); }
};

TEST_F(OpenRecording, AFileThatNobodyReadsIsAnErrorOfTheReaderThatFitsBest) {
  using namespace std::string_literals;
  const std::string other_columns = " (other columns: --event-columns, - for one to ignore)";
  const struct {
    const char* file;
    std::string bytes;
    std::string error;  // text after the name
  } rows[] = {
      {"e.txt", "0.1 1 2 up\n",
       ":1: p = 'up': expected polarity 0 or 1, or -1 or 1, or True or False, or ON or OFF "
       "(columns "
       "in another order: --event-columns)"},
      {"e.txt", "# events\n\n0.1 1 b 0\n",
       ":3: y = 'b': expected a whole number from 0 to 65535 (columns in another order: "
       "--event-columns)"},
      {"e.csv", "t;x;y;p\n", ": there is no event after the header"},
      {"e.txt", "0.1 1 2 0 7\n",
       ":1: '0.1 1 2 0 7': expected 4 fields, t x y p, not 5" + other_columns},
      {"e.csv", "x,y,p,t\n1,2,0\n",
       ":2: '1,2,0': expected 4 fields, x y p t, not 3" + other_columns},
      {"kitti.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n",
       ":1: '1 0 0 0 0 1 0 0 0 0 1 0': expected 4 fields, t x y p, not 12 (12 numbers, as poses of "
       "KITTI have, which have no times: expected t tx ty tz qx qy qz qw; Python writes them: "
       "ef.write_poses('poses.txt', (times, T_world_rig)))"},
      {"old.raw", "% date 2020-01-01\n% plugin_name hal\n\0\1\2"s,
       ": a file of Prophesee without a line '% evt 3.0' (or 2.0, 2.1) in its header: the encoding "
       "of "
       "its events is not known; give the RAW file as it was recorded (docs/recordings.md)"},
      {"a.es", "Event Stream\2\0\0\1"s,
       ": an Event Stream file (.es): it is not read; of the arrays t, x, y and on that the Python "
       "package "
       "event_stream reads, np.save('events.npy', ef.events(x, y, on, t)) makes a file that is "
       "read "
       "(docs/recordings.md)"},
      {"bag/metadata.yaml", "rosbag2_bagfile_information:\n  version: 5\n",
       ": the description of a ROS 2 bag: expected its folder, FOLDER (docs/recordings.md)"},
      {"readme", "gain = 5 at 3 of the set\n",
       ": not a recording (it begins with 'gain = 5 at 3 of the set'): expected a rawlog, or a "
       "recording in another format (docs/recordings.md)"},
  };
  for (const auto& [name, bytes, error] : rows) {
    const std::filesystem::path file = folder() / name;
    writeFile(file, bytes);
    std::string expected = error;
    const std::size_t at = expected.find("FOLDER");
    if (at != std::string::npos) expected.replace(at, 6, file.parent_path().string());
    EXPECT_EQ(errorOf({file}), file.string() + expected);
  }
  write("poses.txt", std::string("\xEF\xBB\xBF") + "0.1 1 2 3 0 0 0 1\n");
  EXPECT_THAT(errorOf({folder() / "poses.txt"}), HasSubstr(": poses: expected --poses "));
}

/// The size of the first camera, and the numbers of poses and of warnings.
struct Opened {
  int width = 0;
  int poses = 0;
  std::vector<std::string> warnings;
};
Opened openedOf(const RecordingSource& source) {
  Opened opened;
  const auto recording = openRecording(source);
  opened.width = recording->rig().cameras.at(0).model.width;
  while (const auto sample = recording->next()) {
    if (std::holds_alternative<PoseSample>(*sample)) ++opened.poses;
  }
  EXPECT_THAT(recording->counts().warnings, testing::IsEmpty());
  for (const Warning& warning : recording->counts().notes) {
    opened.warnings.push_back(warning.name + ": " + warning.text);
  }
  return opened;
}

TEST_F(OpenRecording, TheOnlyCalibrationAndTheOnlyPosesOfAFolderAreTakenAndSaid) {
  write("events.txt", "0.1 300 2 0\n0.2 1 2 1\n");
  write("imu.txt", "0.1 1 2 3 4 5 6\n");
  write("my rig.yaml", kCamera);
  write("tracker.csv", "t_ns,x,y,z,qx,qy,qz,qw\n5,1,2,3,0,0,0,1\n");
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
  write("other.yaml", kCamera);
  EXPECT_THAT(errorOf({folder()}), HasSubstr("no calibration: expected calib.txt or camchain.yaml "
                                             "(not clear: my rig.yaml, other.yaml), or "
                                             "--calibration FILE"));
  write("second.txt", "0.1 1 2 3 0 0 0 1\n");
  source.calibration = folder() / "other.yaml";
  EXPECT_THAT(errorOfSource(source), HasSubstr("no poses: expected groundtruth.txt or poses.txt "
                                               "(not clear: second.txt, tracker.csv), or"));
  // File names that the layout knows have priority, without a message.
  write("groundtruth.txt", "0.1 1 2 3 0 0 0 1\n0.2 1 2 3 0 0 0 1\n");
  const Opened known = openedOf(source);
  EXPECT_EQ(known.poses, 2);
  EXPECT_THAT(known.warnings, testing::IsEmpty());
}

TEST_F(OpenRecording, TheSensorsSizeMayBeTold) {
  write("e.txt", "0.1 300 2 0\n0.2 1 2 1\n");
  write("calib.txt", "200 200 120 90 0 0 0 0 0\n");
  RecordingSource source;
  source.files = {folder() / "e.txt"};
  source.reader.sensor_size = CameraSize{320, 240};
  source.complete = false;
  EXPECT_EQ(openedOf(source).width, 320);
  source.calibration = folder() / "calib.txt";  // a file without a size
  EXPECT_EQ(openedOf(source).width, 320);
  write("e.txt", "640 480\n0.1 300 2 0\n0.2 1 2 1\n");
  EXPECT_EQ(errorOfSource(source),
            "--sensor-size 320x240: " + (folder() / "e.txt").string() + " has 640x480 pixels");
}

TEST_F(OpenRecording, AnIntervalIsOnTheClockOfThePoses) {
  std::string events;  // one event per ms
  for (int i = 1000; i < 2000; ++i) {
    events += "1." + std::to_string(i).substr(1) + " " + std::to_string(i % 240) + " 1 0\n";
  }
  write("cam0/events.txt", events);
  write("cam1/events.txt", events);
  write("poses.txt", "1.5 1 2 3 0 0 0 1\n");
  struct Case {
    int own_ms;
    std::optional<int> given_ms;
    int first_ms;  // event of camera 1, whose times are the poses' times minus the offset
    int end_ms;
  };
  for (const auto& [own_ms, given_ms, first_ms, end_ms] : {Case{0, {}, 400, 600},
                                                           {50, {}, 350, 550},
                                                           {-50, {}, 450, 650},
                                                           {0, 80, 320, 520},
                                                           {50, -80, 480, 680}}) {
    write("camchain.yaml", twoCamchain(own_ms));
    RecordingSource source;
    source.files = {folder()};
    source.limits = {1'400'000'000, 1'600'000'000};
    if (given_ms) {
      write("given.yaml", twoCamchain(*given_ms));
      source.calibration = folder() / "given.yaml";
    }
    std::vector<Event> found[2];
    const auto recording = openRecording(source);
    while (const auto sample = recording->next()) {
      const auto* packet = std::get_if<EventPacket>(&*sample);
      if (packet == nullptr) continue;
      std::vector<Event>& camera = found[packet->camera];
      camera.insert(camera.end(), packet->events.begin(), packet->events.end());
    }
    ASSERT_EQ(found[0].size(), 200U);
    EXPECT_EQ(found[0][0].t_ns, *source.limits.t0_ns);
    ASSERT_EQ(found[1].size(), static_cast<std::size_t>(end_ms - first_ms)) << own_ms;
    EXPECT_EQ(found[1][0].t_ns, (1000 + first_ms) * std::int64_t{1'000'000});
  }
}

TEST_F(OpenRecording, SourcesThatDoNotFitTogetherAreErrors) {
  for (const char* name : {"uzh/events.txt", "a/cam0/events.txt", "b/cam0/events.txt"}) {
    write(name, "0.1 1 2 0\n");
  }
  write("uzh/calib.txt", "200 200 120 90 0 0 0 0 0\n");
  write("a/camchain.yaml", kCamera);
  write("b/camchain.yaml", kCamera);
  write("r.rawlog",
        "\x8d"
        "CObservationGPS");
  const auto uzh = folder() / "uzh";
  const auto a = folder() / "a";
  EXPECT_EQ(errorOf({uzh, a}), a.string() + ": a second calibration, beside " +
                                   (uzh / "calib.txt").string() +
                                   ": expected one of all cameras, or --calibration FILE");
  write("all.yaml", twoCamchain());
  RecordingSource both;
  both.files = {uzh, a};
  both.calibration = folder() / "all.yaml";
  both.complete = false;
  EXPECT_EQ(openRecording(both)->rig().cameras.size(), 2U);
  EXPECT_EQ(errorOf({a, folder() / "b"}),
            (folder() / "b").string() + ": 2 sources: expected one, a dataset folder");
  EXPECT_EQ(
      errorOf({a, folder() / "r.rawlog"}),
      (folder() / "r.rawlog").string() + ": a rawlog beside other sources: expected it alone");
  EXPECT_EQ(errorOf({}), "no source: expected a recording");
  EXPECT_THAT(
      errorOf({a}, "tape"),
      testing::StartsWith("'tape' is not a known format: expected one of auto, rawlog, hdf5"));
}

using testing::AllOf;

/// Opens one file or folder in a format.
std::unique_ptr<Recording> openAs(const std::string& format, const std::filesystem::path& path) {
  RecordingSource source;
  source.files = {path};
  source.format = format;
  return openRecording(source);
}

class TextFolder : public TemporaryFolder {
 protected:
  explicit TextFolder(std::string format) : format_(std::move(format)) {}
  void write(const std::string& name, const std::string& text) const {
    writeFile(folder() / name, text);
  }
  void remove(const std::string& name) const { std::filesystem::remove(folder() / name); }
  std::string errorOfOpening() const {
    return errorOf([&] { openAs(format_, folder()); });
  }

 private:
  std::string format_;
};

class DatasetFolder : public TextFolder {
 protected:
  DatasetFolder() : TextFolder("folder") {
    write("camchain.yaml", twoCamchain());
    write("cam0/events.txt", "0.1 239 179 1\n");
    write("cam1/events.txt", "0.2 0 0 0\n");
    write("poses.txt", "0.3 1 2 3 0 0 0 1\n0.0 0 2 3 0 0 0 1\n");
  }
};

TEST_F(DatasetFolder, ReturnsEventsOfEachCameraAndPosesInOrder) {
  EXPECT_TRUE(looksLikeDatasetFolder(folder()));
  const auto recording = openAs("folder", folder());
  std::string labels;
  while (const auto sample = recording->next()) {
    const auto* packet = std::get_if<EventPacket>(&*sample);
    labels += (packet ? recording->cameras()[std::size_t(packet->camera)].label
                      : std::get<PoseSample>(*sample).source.label) +
              " ";
  }
  EXPECT_NEAR(recording->rig().cameras[1].T_rig_cam.translation.x(), 0.1, 1e-15);
  EXPECT_EQ(labels, "pose cam0 cam1 pose ");
  write("cam7/events.txt", "nonsense\n");
  write("notes.txt", "nonsense\n");
  std::filesystem::rename(folder() / "poses.txt", folder() / "groundtruth.txt");
  EXPECT_TRUE(std::holds_alternative<PoseSample>(*openAs("folder", folder())->next()));
}

TEST_F(DatasetFolder, AFileThatIsMissingOrWrongIsNamed) {
  write("cam2/events.txt", "0.2 0 0 0\n");
  EXPECT_THAT(errorOfOpening(),
              HasSubstr("camchain.yaml: 2 cameras: expected 3, because the folder "
                        "has events of cam0 to cam2"));
  remove("cam1/events.txt");
  EXPECT_THAT(errorOfOpening(), HasSubstr("cam1/events.txt: cannot be opened"));
  write("cam1/events.txt", "0.3 240 0 0\n");
  remove("cam2/events.txt");
  EXPECT_THAT(errorOfOpening(), AllOf(HasSubstr("cam1/events.txt:1: "), HasSubstr("'240'")));
  write("cam1/events.txt", "0.2 0 0 0\n");
  write("poses.txt", "0.3 1 2 3 0 0 0 1\n0.4 1 2 3\n");
  EXPECT_THAT(errorOfOpening(), HasSubstr("poses.txt:2: "));
  remove("poses.txt");
  remove("camchain.yaml");
  EXPECT_TRUE(looksLikeDatasetFolder(folder()));
  remove("cam0/events.txt");
  for (const char* name : {"", "cam1/events.txt", "nowhere"}) {
    EXPECT_FALSE(looksLikeDatasetFolder(folder() / name)) << name;
  }
}

TEST_F(DatasetFolder, ADamagedListOfTheTruthStopsOnlyWhoAsksForIt) {
  RecordingSource source;
  source.files = {folder()};
  EXPECT_TRUE(openTruth(source).empty());
  write("depth/index.txt", "# t file\n10.3 a.tiff\n");
  const std::vector<TimedFile> truth = openTruth(source);
  ASSERT_EQ(truth.size(), 1U);
  EXPECT_EQ(truth[0].t_ns, 10'300'000'000);
  EXPECT_EQ(truth[0].file, folder() / "depth" / "a.tiff");
  write("depth/index.txt", "0.3 a.tiff\nsoon b.tiff\n");
  EXPECT_NO_THROW(openAs("folder", folder()));
  EXPECT_THAT(errorOf([&] { openTruth(source); }), HasSubstr("index.txt:2: 'soon b.tiff'"));
}

class UzhText : public TextFolder {
 protected:
  UzhText() : TextFolder("uzh") {
    write("events.txt", "0.1 239 179 1\n");
    write("groundtruth.txt", "0 1 2 3 0 0 0 1\n");
    write("calib.txt", "200 201 120 90 0 0 0 0 0\n");
  }
  std::string sizeFound() const {
    const RecordingParts parts = openUzhFolder({folder()}, {});
    const CameraSize size = parts.cameras[0]->size().value_or(*parts.default_size);
    return std::to_string(size.width) + "x" + std::to_string(size.height);
  }
};

TEST_F(UzhText, TheSensorHasTheSizeOfTheFirstExistingImageElseThatOfADavis240) {
  EXPECT_EQ(sizeFound(), "240x180");
  write("images.txt", "# images/frame_1.png\n0.0 images/frame_0.png\n0.1 images/frame_1.png\n");
  EXPECT_EQ(sizeFound(), "240x180");
  std::filesystem::create_directories(folder() / "images");
  cv::imwrite((folder() / "images" / "frame_1.png").string(), cv::Mat::zeros(260, 346, CV_8UC1));
  EXPECT_EQ(sizeFound(), "346x260");
  write("events.txt", "0.1 345 259 1\n");
  EXPECT_NO_THROW(openAs("uzh", folder()));
  write("images/frame_0.png", "not an image");
  EXPECT_THAT(errorOfOpening(), HasSubstr("frame_0.png: cannot be read as an image"));
}

TEST_F(UzhText, MayHaveACameraChainAndPosesAsOtherFoldersDo) {
  write("poses.txt", "0 7 2 3 0 0 0 1\n");
  EXPECT_EQ(openUzhFolder({folder()}, {}).poses.at(0).T_world_rig.translation.x(), 1);
  for (const char* name : {"calib.txt", "groundtruth.txt"}) remove(name);
  write("camchain.yaml", kCamera);
  EXPECT_EQ(detectFormat(folder())->name, "uzh");
  const auto recording = openAs("auto", folder());
  EXPECT_EQ(recording->rig().cameras.at(0).model.width, 346);
  EXPECT_EQ(std::get<PoseSample>(*recording->next()).T_world_body.translation.x(), 7);
  EXPECT_THAT(recording->counts().warnings, testing::IsEmpty());
}

TEST_F(UzhText, AMissingFileIsNamed) {
  EXPECT_TRUE(looksLikeUzhFolder(folder()));
  write("groundtruth.txt", "\n");
  EXPECT_THAT(errorOfOpening(), HasSubstr("groundtruth.txt: no poses"));
  remove("groundtruth.txt");
  EXPECT_THAT(errorOfOpening(),
              HasSubstr(": no poses: expected groundtruth.txt or poses.txt, or --poses FILE"));
  remove("calib.txt");
  EXPECT_THAT(
      errorOfOpening(),
      HasSubstr(": no calibration: expected calib.txt or camchain.yaml, or --calibration FILE"));
  remove("events.txt");
  EXPECT_FALSE(looksLikeUzhFolder(folder()));
  EXPECT_FALSE(looksLikeUzhFolder(folder() / "nowhere"));
}

}  // namespace

}  // namespace efm
