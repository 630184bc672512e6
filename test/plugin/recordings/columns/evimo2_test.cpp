// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/columns/event_arrays.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <tuple>
#include <vector>

#include "plugin/recordings/open/recording_formats.h"
#include "test/plugin/recordings/columns/zip_file.h"
#include "test/plugin/recordings/streams/reading.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using testing::HasSubstr;

class Evimo2 : public TemporaryFolder {
 protected:
  std::filesystem::path sequence(const std::string& camera) const {
    return folder() / camera / "sfm" / "eval" / "scene_01";
  }
  void write(const std::filesystem::path& to, const std::string& name,
             const std::string& bytes) const {
    writeFile(to / ("dataset_" + name), bytes);
  }
  /// Three events, at 0.016667, 0.5 and 10.123456 s.
  std::filesystem::path writeThree(const std::string& camera) const {
    const std::filesystem::path to = sequence(camera);
    write(to, "events_t.npy", npyArray<float>("<f4", "(3, 1)", {0.016667F, 0.5F, 10.123456F}));
    write(to, "events_xy.npy", npyArray<std::uint16_t>("<u2", "(3, 2)", {1, 2, 639, 479, 5, 6}));
    write(to, "events_p.npy", npyArray<std::uint8_t>("|u1", "(3,)", {1, 0, 1}));
    writeZip(to / "dataset_info.npz",
             {{"K.npy", npyArray<double>("<f8", "(3, 3)", {500, 0, 320, 0, 501, 240, 0, 0, 1})},
              {"D.npy", npyArray<float>("<f4", "(4,)", {0.1F, 0.2F, 0.3F, 0.5F})},
              {"meta.npy", npyArray<double>("|O", "()", {0})}});
    return to;
  }
  std::string errorOfFolder(const std::filesystem::path& path) const {
    return errorOf([&] {
      RecordingParts parts = openEvimo2({path}, {});
      readStream(*parts.cameras[0]);
    });
  }
};

TEST_F(Evimo2, HasEventsAndTheCamerasCalibration) {
  const std::filesystem::path path = writeThree("left_camera");
  ASSERT_NE(detectFormat(path), nullptr);
  EXPECT_EQ(detectFormat(path)->name, "evimo2");
  RecordingParts parts = openEvimo2({path}, {});
  const std::vector<Event> expected = {
      {16'667'000, 1, 2, true}, {500'000'000, 639, 479, false}, {10'123'456'000, 5, 6, true}};
  EXPECT_TRUE(readStream(*parts.cameras.at(0)) == expected);
  CameraModel model{640, 480, 500, 501, 320, 240, DistortionModel::kRadtan, {}};
  for (const float k : {0.1F, 0.2F, 0.3F, 0.5F}) model.coefficients.push_back(k);
  EXPECT_EQ(parts.calibration.value().camera(0, CameraSize{640, 480}).model, model);
  EXPECT_EQ(parts.cameras[0]->size(), std::nullopt);
  EXPECT_TRUE(parts.poses.empty());
  // Further files have poses and the sensor's size.
  writeFile(path / "poses.txt", "0.1 1 2 3 0 0 0 1\n");
  for (const auto& [shape, width, height] :
       {std::tuple("(2, 3)", 3, 2), std::tuple("(65535, 1)", 1, 65'535),
        std::tuple("(65536, 1)", 0, 0), std::tuple("(0, 1)", 0, 0), std::tuple("(2, 0)", 0, 0),
        std::tuple("(6,)", 0, 0)}) {
    writeZip(path / "dataset_depth.npz",
             {{"depth_0000000001.npy", npyArray<std::uint16_t>("<u2", shape, {0, 0, 0, 0, 0, 0})}});
    const RecordingParts more = openEvimo2({path}, {});
    EXPECT_EQ(more.poses.size(), 1U);
    EXPECT_EQ(more.cameras[0]->size().value_or(CameraSize{0, 0}).width, width) << shape;
    EXPECT_EQ(more.cameras[0]->size().value_or(CameraSize{0, 0}).height, height) << shape;
  }
  // The Samsung's polarity is the other way around; there is no transform between two cameras.
  RecordingParts two = openEvimo2({writeThree("samsung_mono"), path}, {});
  ASSERT_EQ(two.cameras.size(), 2U);
  EXPECT_FALSE(two.calibration);
  for (const int camera : {0, 1}) {
    const std::vector<Event> events = readStream(*two.cameras[static_cast<std::size_t>(camera)]);
    EXPECT_EQ(events.at(0).polarity, camera == 1);
    EXPECT_EQ(events.at(1).polarity, camera == 0);
  }
}

TEST_F(Evimo2, AnErrorNamesTheFileTheRowAndTheExpectedValue) {
  const std::filesystem::path path = writeThree("left_camera");
  const struct {
    const char* file;
    std::string bytes;
    const char* error;
  } cases[] = {
      {"events_xy.npy", npyArray<std::uint16_t>("<u2", "(2, 2)", {1, 2, 3, 4}),
       "events_xy.npy: 2 rows of 2 numbers: expected 3 of 2"},
      {"events_xy.npy", npyArray<float>("<f4", "(3, 2)", {1, 2, 3.5F, 4, 5, 6}),
       "events_xy.npy: row 1: x = 3.5: expected a whole number"},
      {"events_p.npy", npyArray<std::uint8_t>("|u1", "(3,)", {1, 0, 2}),
       "events_p.npy: row 2: p = 2: expected polarity 0 or 1"},
      {"events_t.npy", npyArray<float>("<f4", "(3,)", {1, NAN, 2}), "events_t.npy: row 1: t = nan"},
      {"events_t.npy", "no array", "events_t.npy: the array's header: it does not begin"},
      {"events_t.npy", npyArray<float>("<f4", "(3, 2)", {1, 2, 3, 4, 5, 6}),
       "events_t.npy: 3 rows of 2 numbers: expected 3 of 1"},
      {"events_p.npy", npyArray<std::uint8_t>("|u1", "(3, 2)", {1, 0, 1, 0, 1, 0}),
       "events_p.npy: 3 rows of 2 numbers: expected 3 of 1"},
      {"info.npz", "PK\x03\x04 garbage", "dataset_info.npz: cannot be unpacked"},
  };
  for (const auto& row : cases) {
    writeThree("left_camera");
    write(path, row.file, row.bytes);
    EXPECT_THAT(errorOfFolder(path), HasSubstr(row.error)) << row.file;
  }
  writeThree("left_camera");
  std::filesystem::remove(path / "dataset_events_p.npy");
  EXPECT_THAT(errorOfFolder(path), HasSubstr("dataset_events_p.npy: cannot be opened"));
}

}  // namespace
}  // namespace efm
