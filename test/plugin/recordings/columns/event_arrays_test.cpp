// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>
#include <string>
#include <tuple>
#include <vector>

#include "plugin/recordings/columns/event_arrays.h"
#include "plugin/recordings/open/recording_formats.h"
#include "test/paths.h"
#include "test/plugin/recordings/columns/zip_file.h"
#include "test/plugin/recordings/streams/reading.h"
#include "test/plugin/temporary_folder.h"
#include "tracking_stub/truth/dataset_writer.h"

namespace efm {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

namespace fs = std::filesystem;

class EventArrays : public TemporaryFolder {
 protected:
  fs::path write(const std::string& name, const std::string& bytes) const {
    writeFile(folder() / name, bytes);
    return folder() / name;
  }
  static std::string errorOfFile(const fs::path& file, const ReaderOptions& options = {}) {
    return errorOf([&] { readStream(*openEventArrays({file}, options).cameras.at(0)); });
  }
};

/// Returns events of a camera at current times, in whole microseconds.
std::vector<Event> manyEvents() {
  std::mt19937 random(3);
  std::vector<Event> events;
  std::int64_t t_ns = 1'700'000'000'123'457'000;
  for (int i = 0; i < 60'000; ++i) {
    t_ns += static_cast<std::int64_t>(random() % 20) * 1'000;
    events.push_back({t_ns, static_cast<std::uint16_t>(random() % 346),
                      static_cast<std::uint16_t>(random() % 260), random() % 3 == 0});
  }
  return events;
}

TEST_F(EventArrays, OfMetavisionAndOfOtherFieldsHaveTheEventsOfTheText) {
  const std::vector<Event> all = manyEvents();
  fs::create_directories(folder() / "data/cam0");
  writeEvents(folder() / "data/cam0/events.txt", all);
  ASSERT_EQ(std::system(("/usr/bin/python3 '" EFM_SOURCE_DIR "/test/formats/write_numpy.py' '" +
                         (folder() / "data").string() + "' '" + folder().string() + "'")
                            .c_str()),
            0)
      << "packages.txt: python3-numpy";
  for (const auto& [name, unit] : {std::pair{"metavision/cam0.npy", ""},
                                   {"metavision_ns/cam0.npy", "ns"},
                                   {"fields/cam0.npy", ""}}) {
    SCOPED_TRACE(name);
    const fs::path file = folder() / name;
    ASSERT_NE(detectFormat(file), nullptr);
    EXPECT_EQ(detectFormat(file)->name, "numpy");
    ReaderOptions options;
    options.time_unit = unit;
    const auto camera = std::move(openEventArrays({file}, options).cameras.at(0));
    EXPECT_TRUE(readStream(*camera) == all);
    EXPECT_EQ(camera->progress(), 1);
    EXPECT_TRUE(camera->warnings().empty());
    const auto later = std::move(openEventArrays({file}, options).cameras.at(0));
    const std::int64_t t_ns = all[40'000].t_ns;
    later->seek(t_ns);
    // The reader starts 10 ms before, because events may be that late.
    const auto first = std::find_if(all.begin(), all.end(), [&](const Event& event) {
      return event.t_ns >= t_ns - 10'000'000;
    });
    std::vector<Event> read;
    ASSERT_TRUE(later->read(read));
    EXPECT_TRUE(read == std::vector<Event>(first, all.end()));
    EXPECT_THAT(later->positionOf(7),
                HasSubstr(": row " + std::to_string(first - all.begin() + 7)));
  }
}

TEST_F(EventArrays, TimesKeepTheDigitsThatTheirTypeHolds) {
  const auto times_of = [&](const char* type, const auto& times, const std::string& unit = "") {
    const std::string dtype =
        std::string("[('t', '") + type + "'), ('x', '|u1'), ('y', '|u1'), ('p', '|u1')]";
    std::string bytes = npyArray(dtype, "(2,)", std::vector<std::uint8_t>{});
    for (const auto time : times) {
      bytes.append(reinterpret_cast<const char*>(&time), sizeof time);
      bytes.append(3, '\1');
    }
    const fs::path file = write("e.npy", bytes);
    ReaderOptions options;
    options.time_unit = unit;
    std::vector<std::int64_t> found;
    for (const Event& event : readStream(*openEventArrays({file}, options).cameras[0])) {
      found.push_back(event.t_ns);
    }
    return found;
  };
  using Reals = std::vector<double>;
  using Times = std::vector<std::int64_t>;
  EXPECT_EQ(times_of("<f8", Reals{0.000000001, 12.345678912}), (Times{1, 12'345'678'912}));
  EXPECT_EQ(times_of("<f8", Reals{1.5e9 + 0.5, 1'500'000'001.123456}),
            (Times{1'500'000'000'500'000'000, 1'500'000'001'123'456'000}));
  EXPECT_EQ(times_of("<f4", std::vector<float>{-0.25F, 10.123456F}),
            (Times{-250'000'000, 10'123'456'000}));
  EXPECT_EQ(times_of("<i8", Times{5, 1'700'000'000'000'000'001}, "ns"),
            (Times{5, 1'700'000'000'000'000'001}));
  EXPECT_EQ(times_of(">i8", Times{0x0700'0000'0000'0000, 0x0001'0000'0000'0000}, "ns"),
            (Times{7, 256}));
  EXPECT_EQ(times_of("<u4", std::vector<std::uint32_t>{5, 4'000'000'000}, "us"),
            (Times{5'000, 4'000'000'000'000}));
}

/// Runs the Python that the error for a file names, and returns the events that it wrote.
class OtherArrays : public EventArrays {
 protected:
  std::string pythonFor(const fs::path& file) const {
    const std::string error = errorOfFile(file);
    const std::size_t begin = error.find("import numpy");
    return begin == std::string::npos ? error
                                      : error.substr(begin, error.find(", if these") - begin);
  }
};

TEST_F(OtherArrays, AnErrorNamesTheLinesOfPython) {
  const std::vector<double> ten(40, 1.0);
  const std::string three = npyArray("<f8", "(3,)", ten);
  const auto archive = [&](const std::vector<std::pair<std::string, std::string>>& members) {
    writeZip(folder() / "e.npz", members);
    return folder() / "e.npz";
  };
  const std::string pair = npyArray("<f8", "(3, 2)", ten);
  const struct {
    fs::path file;
    std::string content, call;
  } rows[] = {
      {write("a.npy", npyArray("<f8", "(10, 4)", ten)), "a.npy: (10, 4): expected a structured",
       "ef.events(z[:, 1], z[:, 2], z[:, 3], z[:, 0], time_unit='us')"},
      {write("b.npy",
             npyArray("[('ts', '<i8'), ('x', '<u2'), ('y', '<u2'), ('pol', '|i1')]", "(3,)", ten)),
       "b.npy: (3) with fields ts x y pol",
       "ef.events(z['x'], z['y'], z['pol'], z['ts'], time_unit='us')"},
      {archive({{"timestamps_us.npy", three},
                {"xs.npy", three},
                {"ys.npy", three},
                {"polarity.npy", three}}),
       "e.npz: timestamps_us (3), xs (3), ys (3), polarity (3): expected",
       "ef.events(z['xs'], z['ys'], z['polarity'], z['timestamps_us'], time_unit='us')"},
  };
  for (const auto& row : rows) {
    EXPECT_THAT(errorOfFile(row.file), AllOf(StartsWith(row.file.string()), HasSubstr(row.content),
                                             HasSubstr("--time-unit ns")));
    EXPECT_THAT(pythonFor(row.file), HasSubstr(row.call));
  }
  const fs::path enerf = archive({{"position.npy", pair}, {"t.npy", three}, {"p.npy", three}});
  EXPECT_THAT(pythonFor(enerf),
              HasSubstr("ef.events(z['position'][:, 0], z['position'][:, 1], z['p'], z['t']"));
  EXPECT_THAT(errorOf([&] { readPoses(enerf); }),
              AllOf(HasSubstr("e.npz: position (3, 2), t (3), p (3): expected poses as text"),
                    HasSubstr("ef.write_poses('poses.txt', (t, T)")));
}

TEST_F(EventArrays, AnErrorNamesTheFileTheRowAndTheExpectedValue) {
  const auto structured = [](const char* t, const char* xyp, const std::string& rows) {
    const std::string x = std::string("', '") + xyp + "'), ('";
    return npyArray("[('t', '" + std::string(t) + "'), ('x" + x + "y" + x + "p', '" + xyp + "')]",
                    "(2,)", std::vector<char>(rows.begin(), rows.end()));
  };
  const auto bytesOf = [](const auto& numbers) {
    return std::string(reinterpret_cast<const char*>(numbers.data()),
                       numbers.size() * sizeof numbers[0]);
  };
  using Reals = std::vector<double>;
  const auto real = [&](const Reals& numbers) {
    return structured("<f8", "<f8", bytesOf(numbers));
  };
  const struct {
    std::string bytes;
    std::string error;
    std::size_t events = 0;  // number of events before the error
  } rows[] = {
      {npyArray("|O", "(3,)", Reals{}), ": the array's header: descr = ''|O'', Python objects"},
      {npyArray("[('t', '<f8'), ('x', '<f8'), ('y', '<f8'), ('p', '<f8')]", "(1000000000,)",
                Reals(40)),
       " 320 bytes follow the array's header: expected"},
      {real({0.5, 1, 2, 1, NAN, 1, 2, 1}), ": row 1: t = nan: expected a time", 1},
      {real({0.5, 1, 2, 1, 0.6, 65'536, 2, 1}),
       ": row 1: x = 65536: expected a whole number from 0 to 65535", 1},
      {real({0.5, 1, -1, 1, 0.6, 1, 2, 1}), ": row 0: y = -1: expected"},
      {real({0.5, 7, 1.25, 1, 0.6, 1, 2, 1}),
       ": row 0: y = 1.25: expected a whole number from 0 to 65535; rectified events have "
       "fractions"},
      {real({0.5, 1, 2, 2, 0.6, 1, 2, 1}), ": row 0: p = 2: expected polarity 0 or 1, or -1 or 1"},
      {structured("<f4", "<f4", bytesOf(std::vector<float>{16'383.5F, 1, 2, 1, 16'384, 1, 2, 1})),
       ": row 1: t = 16384: expected a time before the year 2116, and no float32 number that", 1},
  };
  for (const auto& row : rows) {
    const fs::path file = write("e.npy", row.bytes);
    std::vector<Event> events;
    EXPECT_THAT(errorOf([&] { readBlock(*openEventArrays({file}, {}).cameras.at(0), events); }),
                AllOf(StartsWith(file.string()), HasSubstr(row.error)));
    EXPECT_EQ(events.size(), row.events) << row.error;
  }
}

TEST_F(EventArrays, DamagedFilesAreReadOrRejected) {
  const std::string structured =
      npyArray("[('', '|V2'), ('x', '>u2'), ('y', '<u2'), ('p', '<i2'), ('t', '<f8')]", "(40,)",
               std::vector<double>(80, 0.0));
  readDamaged(structured, folder() / "damaged.npy", "numpy");
}

class Evimo2 : public TemporaryFolder {
 protected:
  std::filesystem::path sequence(const std::string& camera) const {
    return folder() / camera / "sfm" / "eval" / "scene_01";
  }
  void write(const std::filesystem::path& to, const std::string& name,
             const std::string& bytes) const {
    writeFile(to / ("dataset_" + name), bytes);
  }
  /// Writes three events, at 0.016667, 0.5 and 10.123456 s.
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
  // Other files give the poses and the sensor's size.
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
  // The Samsung's polarity is inverted. The files have no transform between two cameras.
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
