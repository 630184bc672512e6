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

TEST_F(EventArrays, AllThatNumPyWritesHaveTheEventsOfTheText) {
  const std::vector<Event> all = manyEvents();
  fs::create_directories(folder() / "data/cam0");
  writeEvents(folder() / "data/cam0/events.txt", all);
  ASSERT_EQ(std::system(("/usr/bin/python3 '" EFM_SOURCE_DIR "/test/formats/write_numpy.py' '" +
                         (folder() / "data").string() + "' '" + folder().string() + "'")
                            .c_str()),
            0)
      << "packages.txt: python3-numpy";
  const struct {
    const char* file;
    std::string columns;
    std::string warning;
  } rows[] = {
      {"metavision/cam0.npy", "", ""},
      {"fields/cam0.npy", "", ""},
      {"fields/cam0.npy", "t=t_ns x=col y=row p=polarity", ""},
      {"rows/cam0.npy", "", "the columns are x y t p (--event-columns \"x y t p\")"},
      {"rows/cam0.npy", "x y t p", ""},
      {"columns/cam0.npy", "", ""},
      {"lying/cam0.npy", "", "the columns are p t x y"},
      {"transposed/cam0.npy", "", ""},
      {"stored/cam0.npz", "", ""},
      {"deflated/cam0.npz", "", ""},
      {"named/cam0.npz", "t=a,x=b,y=c,p=d", ""},
      {"packed/cam0.npz", "", ""},
  };
  for (const auto& row : rows) {
    SCOPED_TRACE(std::string(row.file) + " " + row.columns);
    const fs::path file = folder() / row.file;
    ASSERT_NE(detectFormat(file), nullptr);
    EXPECT_EQ(detectFormat(file)->name, "numpy");
    ReaderOptions options;
    options.columns = row.columns;
    const auto camera = std::move(openEventArrays({file}, options).cameras.at(0));
    EXPECT_TRUE(readStream(*camera) == all);
    EXPECT_EQ(camera->progress(), 1);
    EXPECT_EQ(camera->warnings().size(), row.warning.empty() ? 0U : 1U);
    for (const Warning& warning : camera->warnings()) {
      EXPECT_THAT(warning.text, HasSubstr(row.warning));
    }
    const auto later = std::move(openEventArrays({file}, options).cameras.at(0));
    const std::int64_t t_ns = all[40'000].t_ns;
    later->seek(t_ns);
    // The reader starts 10 ms before, because events may be that late. An archive cannot seek.
    const auto first = std::find_if(all.begin(), all.end(), [&](const Event& event) {
      return file.extension() == ".npz" || event.t_ns >= t_ns - 10'000'000;
    });
    std::vector<Event> read;
    ASSERT_TRUE(later->read(read));
    EXPECT_TRUE(read == std::vector<Event>(first, all.end()));
    EXPECT_THAT(later->positionOf(7),
                HasSubstr(": row " + std::to_string(first - all.begin() + 7)));
  }
}

TEST_F(EventArrays, TimesKeepTheDigitsThatTheirTypeHolds) {
  const auto times_of = [&](const std::string& t, const std::string& name,
                            const std::string& unit = "") {
    const std::string ones = npyArray("|u1", "(2,)", std::vector<std::uint8_t>{1, 1});
    writeZip(folder() / "e.npz", {{name, t}, {"x.npy", ones}, {"y.npy", ones}, {"p.npy", ones}});
    ReaderOptions options;
    options.time_unit = unit;
    std::vector<std::int64_t> times;
    for (const Event& event :
         readStream(*openEventArrays({folder() / "e.npz"}, options).cameras[0])) {
      times.push_back(event.t_ns);
    }
    return times;
  };
  const auto real = [](double a, double b) {
    return npyArray("<f8", "(2,)", std::vector<double>{a, b});
  };
  const auto whole = [](const char* type, std::vector<std::int64_t> t) {
    return npyArray(type, "(2,)", t);
  };
  using Times = std::vector<std::int64_t>;
  EXPECT_EQ(times_of(real(0.000000001, 12.345678912), "t.npy"), (Times{1, 12'345'678'912}));
  EXPECT_EQ(times_of(real(1.5e9 + 0.5, 1'500'000'001.123456), "t.npy"),
            (Times{1'500'000'000'500'000'000, 1'500'000'001'123'456'000}));
  EXPECT_EQ(times_of(npyArray("<f4", "(2,)", std::vector<float>{-0.25F, 10.123456F}), "ts.npy"),
            (Times{-250'000'000, 10'123'456'000}));
  EXPECT_EQ(times_of(real(7, 12.5), "t_us.npy"), (Times{7'000, 12'500}));
  EXPECT_EQ(times_of(real(7, 12.5), "t_us.npy", "ms"), (Times{7'000'000, 12'500'000}));
  EXPECT_EQ(times_of(whole("<i8", {5, 1'700'000'000'000'000'001}), "t.npy", "ns"),
            (Times{5, 1'700'000'000'000'000'001}));
  EXPECT_EQ(times_of(whole(">i8", {0x0700'0000'0000'0000, 0x0001'0000'0000'0000}), "t.npy", "ns"),
            (Times{7, 256}));
  EXPECT_EQ(times_of(npyArray("<u4", "(2,)", std::vector<std::uint32_t>{5, 4'000'000'000}), "t.npy",
                     "us"),
            (Times{5'000, 4'000'000'000'000}));
}

TEST_F(EventArrays, AnArchiveMayHaveTheCamerasCalibration) {
  const std::string ones = npyArray("|u1", "(2,)", std::vector<std::uint8_t>{1, 1});
  const std::string matrix = npyArray<double>("<f8", "(3, 3)", {500, 0, 320, 0, 501, 240, 0, 0, 1});
  std::vector<std::pair<std::string, std::string>> members = {
      {"t.npy", npyArray("<f8", "(2,)", std::vector<double>{0.5, 1.25})},
      {"x.npy", ones},
      {"y.npy", ones},
      {"p.npy", ones},
      {"K.npy", matrix}};
  writeZip(folder() / "e.npz", members);
  EXPECT_FALSE(openEventArrays({folder() / "e.npz"}, {}).calibration) << "without D";
  members.emplace_back("D.npy", npyArray<double>("<f8", "(1, 4)", {0.1, 0.2, 0.3, 0.4}));
  writeZip(folder() / "e.npz", members);
  const RecordingParts parts = openEventArrays({folder() / "e.npz"}, {});
  ASSERT_TRUE(parts.calibration);
  CameraModel expected{346, 260, 500, 501, 320, 240, DistortionModel::kRadtan, {}};
  expected.coefficients = {0.1, 0.2, 0.3, 0.4};
  EXPECT_EQ(parts.calibration->camera(0, CameraSize{346, 260}).model, expected);
  EXPECT_EQ(readStream(*parts.cameras.at(0)).size(), 2U);
}

TEST_F(EventArrays, AnErrorNamesTheFileWhatItHasAndWhatWasExpected) {
  const std::vector<double> ten(40, 1.0);
  const std::string expected = ": expected events: N x 4 numbers, a structured array with";
  const struct {
    std::string bytes;
    std::string error;
    std::size_t events = 0;  // number of events before the error
  } rows[] = {
      {npyArray("<f8", "(10,)", ten), ": (10)" + expected},
      {npyArray("<f8", "(13, 3)", ten), ": (13, 3)" + expected},
      {npyArray("<f8", "(5, 8)", ten), ": (5, 8): poses: expected --poses "},
      {npyArray("[('x', '<u2'), ('y', '<u2'), ('stamps', '<i8')]", "(3,)", ten),
       ": (3) with fields x y stamps" + expected},
      {npyArray("[('x', '<u2'), ('x_px', '<u2'), ('y', '<u2'), ('t', '<i8'), ('p', '|i1')]", "(3,)",
                ten),
       ": (3) with fields x x_px y t p" + expected},
      {npyArray("|O", "(3,)", ten), ": the array's header: descr = ''|O'', Python objects"},
      {npyArray("<f8", "(1000000000000, 4)", ten),
       " 320 bytes follow the array's header: expected"},
      {npyArray("<f8", "(3, 4)", std::vector<double>{0.5, 1, 2, 1, NAN, 1, 2, 1, 1, 1, 2, 1}),
       ": row 1: t = nan: expected a time", 1},
      {npyArray("<f8", "(3, 4)",
                std::vector<double>{0, 65'535, 0, -1, 0, 0, 65'535, 0, 0, 65'536, 0, 1}),
       ": row 2: x = 65536: expected a whole number from 0 to 65535", 2},
      {npyArray("<f8", "(1, 4)", std::vector<double>{0, 0, -1, 1}), ": row 0: y = -1: expected"},
      {npyArray("<f8", "(1, 4)", std::vector<double>{0.5, 7, 1.25, 1}),
       ": row 0: y = 1.25: expected a whole number from 0 to 65535; rectified events have "
       "fractions"},
      {npyArray("<f8", "(2, 4)", std::vector<double>{0.5, 1, 2, 2, 0.6, 1, 2, 1}),
       ": row 0: p = 2: expected polarity 0 or 1, or -1 or 1"},
      {npyArray("<f4", "(2, 4)", std::vector<float>{16'383.5F, 1, 2, 1, 16'384, 1, 2, 1}),
       ": row 1: t = 16384: expected a time before the year 2116, and no float32 number that", 1},
      {npyArray("<f4", "(10, 4)", std::vector<float>(40, 1.7e9F)),
       "the times are float32 numbers, which are 128 s apart at 1700000000: expected float64"},
  };
  for (const auto& row : rows) {
    const fs::path file = write("e.npy", row.bytes);
    std::vector<Event> events;
    EXPECT_THAT(errorOf([&] { openEventArrays({file}, {}).cameras.at(0)->read(events); }),
                AllOf(StartsWith(file.string()), HasSubstr(row.error)));
    EXPECT_EQ(events.size(), row.events) << row.error;
  }
  const fs::path matrix = write("e.npy", npyArray("<f8", "(10, 4)", ten));
  ReaderOptions named;
  named.columns = "t=a x=b y=c p=d";
  EXPECT_THAT(
      errorOfFile(matrix, named),
      HasSubstr("e.npy: (10, 4); --event-columns 't=a x=b y=c p=d' names others" + expected));
  const std::string three = npyArray("<f8", "(3,)", ten);
  const fs::path archive = folder() / "e.npz";
  writeZip(archive, {{"t.npy", three}, {"x.npy", three}, {"y.npy", three}});
  EXPECT_THAT(errorOfFile(archive), HasSubstr("e.npz: t (3), x (3), y (3)" + expected));
  ReaderOptions options;
  options.columns = "t=t x=x y=y p=q";
  EXPECT_THAT(errorOfFile(archive, options), HasSubstr("--event-columns 't=t x=x y=y p=q' names"));
  for (const char* wrong : {"t=t", "t=t x=x y=y p=", "t=a t=b x=c y=d p=e", "t=t x=x y=y q=p"}) {
    options.columns = wrong;
    EXPECT_THAT(errorOfFile(archive, options), HasSubstr("expected t=NAME x=NAME y=NAME p=NAME"));
  }
  writeZip(archive, {{"t.npy", three},
                     {"x.npy", three},
                     {"y.npy", three},
                     {"p.npy", npyArray("<f8", "(2,)", ten)}});
  EXPECT_THAT(errorOfFile(archive), HasSubstr("e.npz/p.npy: 2 rows: expected 3, as "));
}

TEST_F(EventArrays, DamagedFilesAreReadOrRejected) {
  const std::string structured =
      npyArray("[('', '|V2'), ('x', '>u2'), ('y', '<u2'), ('p', '<i2'), ('t', '<f8')]", "(40,)",
               std::vector<double>(80, 0.0));
  readDamaged(structured, folder() / "damaged.npy", "numpy");
  const std::string zeros = npyArray("<f8", "(40,)", std::vector<double>(40, 0.0));
  writeZip(folder() / "whole.npz",
           {{"t.npy", zeros}, {"x.npy", zeros}, {"y.npy", zeros}, {"p.npy", zeros}});
  readDamaged(readText(folder() / "whole.npz"), folder() / "damaged.npz", "numpy");
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
