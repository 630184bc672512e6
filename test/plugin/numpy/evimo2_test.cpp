// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/numpy/evimo2.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "plugin/readers/recording_formats.h"
#include "test/plugin/formats/files.h"
#include "test/plugin/numpy/zip_file.h"
#include "test/plugin/streams/reading.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using testing::AllOf;
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
  ASSERT_TRUE(parts.calibration);
  const CameraModel model = parts.calibration->camera(0, CameraSize{640, 480}).model;
  EXPECT_EQ(model.fy, 501);
  EXPECT_EQ(model.cx, 320);
  EXPECT_EQ(model.coefficients.at(3), 0.5);
  EXPECT_TRUE(parts.poses.empty());
}

TEST_F(Evimo2, TheSamsungsPolarityIsTheOtherWayAround) {
  RecordingParts parts = openEvimo2({writeThree("samsung_mono"), writeThree("left_camera")}, {});
  ASSERT_EQ(parts.cameras.size(), 2U);
  EXPECT_FALSE(parts.calibration) << "there is no transform between them";
  EXPECT_FALSE(readStream(*parts.cameras[0]).at(0).polarity);
  EXPECT_TRUE(readStream(*parts.cameras[1]).at(0).polarity);
}

TEST_F(Evimo2, PosesAndTheSensorsSizeAreThoseOfFurtherFiles) {
  const std::filesystem::path path = writeThree("right_camera");
  writeFile(path / "poses.txt", "0.1 1 2 3 0 0 0 1\n");
  writeZip(
      path / "dataset_depth.npz",
      {{"depth_0000000001.npy", npyArray<std::uint16_t>("<u2", "(2, 3)", {0, 0, 0, 0, 0, 0})}});
  RecordingParts parts = openEvimo2({path}, {});
  EXPECT_EQ(parts.poses.size(), 1U);
  ASSERT_TRUE(parts.cameras[0]->size());
  EXPECT_EQ(parts.cameras[0]->size()->width, 3);
}

TEST_F(Evimo2, SeekingLeavesOutNothing) {
  constexpr int kCount = 200'000;
  std::vector<double> t;
  for (int i = 0; i < kCount; ++i) t.push_back(i * 1e-5);
  const std::filesystem::path path = writeThree("left_camera");
  const std::string n = std::to_string(kCount);
  write(path, "events_t.npy", npyArray("<f8", "(" + n + ",)", t));
  write(path, "events_xy.npy",
        npyArray("<i8", "(" + n + ", 2)", std::vector<std::int64_t>(2 * kCount, 3)));
  write(path, "events_p.npy", npyArray("|b1", "(" + n + ",)", std::vector<std::uint8_t>(kCount)));
  for (const std::int64_t t_ns : {-5L, 1'000'000'000L, 1'999'990'000L, 5'000'000'000L}) {
    RecordingParts parts = openEvimo2({path}, {});
    parts.cameras[0]->seek(t_ns);
    const std::vector<Event> events = readStream(*parts.cameras[0]);
    const std::int64_t first = std::clamp<std::int64_t>((t_ns - 10'000'000) / 10'000, 0, kCount);
    ASSERT_NEAR(static_cast<double>(events.size()), static_cast<double>(kCount - first), 1) << t_ns;
    if (t_ns < 2'000'000'000) {
      ASSERT_FALSE(events.empty());
      EXPECT_EQ(events.back().t_ns, 1'999'990'000) << t_ns;
    }
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
      {"events_t.npy", npyArray<float>("<f4", "(4,)", {1, 2, 3}),
       "events_t.npy: 12 bytes follow the array's header: expected 16"},
      {"events_t.npy", npyArray<float>("<f4", "(1000000000000,)", {1}), "bytes follow the array's"},
      {"events_t.npy", "no array", "events_t.npy: the array's header: it does not begin"},
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
