// SPDX-License-Identifier: BSD-3-Clause
#include <alloca.h>
#include <gmock/gmock.h>
#include <unistd.h>

#include <fmt/format.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <random>
#include <thread>
#include <tuple>

#include "mapping/base/atomic_file.h"
#include "mapping/geometry/timestamp.h"
#include "mapping/geometry/trajectory.h"
#include "plugin/recordings/columns/hdf5_crash_note.h"
#include "plugin/recordings/columns/hdf5_file.h"
#include "plugin/recordings/columns/hdf5_files.h"
#include "plugin/recordings/open/recording_formats.h"
#include "plugin/recordings/streams/time_unit.h"
#include "test/paths.h"
#include "test/plugin/recordings/streams/reading.h"
#include "test/plugin/temporary_folder.h"
#include "tracking_stub/truth/dataset_writer.h"

namespace efm {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;

namespace fs = std::filesystem;

Rig rigOfTwo() {
  Rig rig;
  for (int i = 0; i < 2; ++i) {
    RigCamera camera;
    camera.model = {346, 260, 226.5, 227, 173.25, 133, DistortionModel::kRadtan, {-0.1, 0.2, 0, 0}};
    camera.T_rig_cam.translation.x() = 0.1 * i;
    if (i == 1) camera.T_rig_cam.rotation = rotationBy({0.01, -0.02, 0.03});
    rig.cameras.push_back(camera);
  }
  return rig;
}

/// Returns bursts of events with gaps of 15 ms, at current times: doubles resolve them to 240 ns.
std::vector<Event> eventsOf(std::uint32_t seed, std::size_t count) {
  std::mt19937 random(seed);
  std::vector<Event> events;
  std::int64_t t_ns = 1'700'000'000'123'457'000 + seed * 1'000;
  for (std::size_t i = 0; i < count; ++i) {
    t_ns += i % 40'000 == 39'999 ? 15'000'000 : static_cast<std::int64_t>(random() % 3) * 1'000;
    events.push_back({t_ns, static_cast<std::uint16_t>(random() % 346),
                      static_cast<std::uint16_t>(random() % 260), random() % 2 == 0});
  }
  return events;
}

/// A recording in all layouts. h5py writes it once.
class Hdf5Layouts : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = fs::temp_directory_path() / ("efm_hdf5_layouts_" + std::to_string(getpid()));
    const fs::path data = folder_ / "data";
    for (std::uint32_t camera = 0; camera < 2; ++camera) {
      const fs::path cam = data / ("cam" + std::to_string(camera));
      fs::create_directories(cam);
      writeEvents(cam / "events.txt", eventsOf(camera, 3'000));
    }
    writeFile(data / "camchain.yaml", formatCamchain(rigOfTwo()));
    writeTumTrajectory(data / "poses.txt", poses());
    const std::string command = "/usr/bin/python3 '" EFM_SOURCE_DIR
                                "/test/formats/write_hdf5.py' '" +
                                data.string() + "' '" + folder_.string() + "'";
    written_ = std::system(command.c_str()) == 0;
  }
  static void TearDownTestSuite() { fs::remove_all(folder_); }
  void SetUp() override {
    ASSERT_TRUE(written_) << "packages.txt: python3-h5py, hdf5-filter-plugin-blosc-serial";
  }

  static std::vector<StampedPose> poses() {
    std::vector<StampedPose> poses;
    for (int i = 0; i < 5; ++i) {
      poses.push_back({1'700'000'000'123'000'000 + i * 50'000'000,
                       {rotationBy({0.1 * i, 0.2, -0.3}), {1.0 * i, 2, 3}}});
    }
    return poses;
  }

  static inline fs::path folder_;
  static inline bool written_ = false;
};

TEST_F(Hdf5Layouts, FilesKnowTheSensorsTheCalibrationAndThePoses) {
  for (const char* name : {"m3ed", "mvsec"}) {
    const RecordingParts parts = openHdf5({folder_ / name}, {});
    EXPECT_EQ(parts.cameras[1]->size().value().width, 346);
    ASSERT_EQ(parts.poses.size(), poses().size()) << name;
    for (std::size_t i = 0; i < parts.poses.size(); ++i) {
      EXPECT_EQ(parts.poses[i].t_ns, poses()[i].t_ns);
      const Rigid3 difference = parts.poses[i].T_world_rig.inverse() * poses()[i].T_world_rig;
      EXPECT_LT(difference.translation.norm() + difference.rotation.vec().norm(), 1e-12);
    }
  }
  const RecordingParts m3ed = openHdf5({folder_ / "m3ed"}, {});
  EXPECT_EQ(m3ed.calibration.value().rig.cameras.at(1).model, rigOfTwo().cameras[1].model);
  const RecordingParts metavision = openHdf5({folder_ / "metavision/left.h5"}, {});
  EXPECT_EQ(metavision.cameras[0]->size().value().height, 260);
}

TEST_F(Hdf5Layouts, DamagedFilesAreReadOrRejected) {
  for (const char* name : {"dsec/events/left/events.h5", "m3ed/desk_data.h5",
                           "m3ed/desk_pose_gt.h5", "mvsec/desk_data.hdf5"}) {
    readDamaged(readBytes(folder_ / name), folder_ / "damaged.h5", "hdf5");
  }
}

/// Tests with files that the test writes.
class Hdf5Events : public TemporaryFolder {
 protected:
  fs::path file() const { return folder() / "events.h5"; }

  /// Writes data sets without compression.
  class Writing {
   public:
    explicit Writing(const fs::path& file)
        : id_(H5Fcreate(file.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), H5Fclose) {}

    template <typename Number>
    void add(const char* path, hid_t type, const std::vector<Number>& numbers,
             std::vector<hsize_t> sides = {}, hid_t creation = H5P_DEFAULT) {
      if (sides.empty()) sides = {numbers.size()};
      const Hdf5Id links(H5Pcreate(H5P_LINK_CREATE), H5Pclose);
      H5Pset_create_intermediate_group(links.get(), 1);
      const Hdf5Id space(H5Screate_simple(static_cast<int>(sides.size()), sides.data(), nullptr),
                         H5Sclose);
      const Hdf5Id set(
          H5Dcreate2(id_.get(), path, type, space.get(), links.get(), creation, H5P_DEFAULT),
          H5Dclose);
      ASSERT_TRUE(set.valid()) << path;
      if (!numbers.empty()) {
        ASSERT_GE(H5Dwrite(set.get(), memoryType<Number>(), H5S_ALL, H5S_ALL, H5P_DEFAULT,
                           numbers.data()),
                  0);
      }
    }

    void addText(const std::string& path, const std::string& text) {
      const Hdf5Id type(H5Tcopy(H5T_C_S1), H5Tclose);
      H5Tset_size(type.get(), text.size());
      const Hdf5Id space(H5Screate(H5S_SCALAR), H5Sclose);
      const Hdf5Id set(H5Dcreate2(id_.get(), path.c_str(), type.get(), space.get(), H5P_DEFAULT,
                                  H5P_DEFAULT, H5P_DEFAULT),
                       H5Dclose);
      H5Dwrite(set.get(), type.get(), H5S_ALL, H5S_ALL, H5P_DEFAULT, text.data());
    }

   private:
    template <typename Number>
    static hid_t memoryType() {
      return std::is_same_v<Number, double> ? H5T_NATIVE_DOUBLE : H5T_NATIVE_LLONG;
    }
    Hdf5Id id_;
  };

  using Numbers = std::vector<long long>;
  struct Columns {
    Numbers x = {1, 2, 3};
    Numbers y = {4, 5, 6};
    Numbers t = {0, 1'500, 2'500};
    Numbers p = {1, 0, 1};
    std::optional<Numbers> index;
    Numbers offset;  // a number, if there is an offset
    hid_t t_type = H5T_STD_I64LE;
  };
  /// Writes a file in DSEC's layout.
  void write(const Columns& columns) const {
    Writing writing(file());
    writing.add("events/x", H5T_STD_U32LE, columns.x);
    writing.add("events/y", H5T_STD_U16LE, columns.y);
    writing.add("events/t", columns.t_type, columns.t);
    writing.add("events/p", H5T_STD_I8LE, columns.p);
    if (columns.index) writing.add("ms_to_idx", H5T_STD_I64LE, *columns.index);
    if (!columns.offset.empty()) writing.add("t_offset", H5T_STD_I64LE, columns.offset);
  }
  std::string errorOfFile() const {
    return errorOf([&] {
      for (const auto& camera : openHdf5({file()}, {}).cameras) readStream(*camera);
    });
  }
};

TEST_F(Hdf5Events, WrongNumbersAreErrorsAfterTheEventsBeforeThem) {
  const std::string place = file().string() + ":/events";
  const auto check = [&](const Columns& columns, const std::string& expected,
                         std::size_t events_before) {
    write(columns);
    const RecordingParts parts = openHdf5({file()}, {});
    std::vector<Event> block;
    EXPECT_EQ(errorOf([&] { readBlock(*parts.cameras.at(0), block); }), expected);
    EXPECT_EQ(block.size(), events_before);
  };
  Columns columns;
  columns.x = {0, 65'535, 65'536};
  check(columns, place + "[2]: x = '65536': expected a whole number from 0 to 65535", 2);
  columns.p = {1, 2, 0};
  check(columns, place + "[1]: p = '2': expected polarity 1, 0 or -1", 1);
  columns.t = {5'000'000'000'000'000, 0, 0};
  check(columns, place + "[0]: t = '5000000000000000': expected " + kExpectedTime, 0);
  // The error is about the first wrong event and its first wrong column.
  columns.t = {0, -5'000'000'000'000'000, 0};
  check(columns, place + "[1]: t = '-5000000000000000': expected " + kExpectedTime, 1);
  columns.p = {-2, 1, 0};
  check(columns, place + "[0]: p = '-2': expected polarity 1, 0 or -1", 0);
  Columns real;
  real.t_type = H5T_IEEE_F32LE;
  real.t = {0, 16'383, 16'384};  // seconds
  check(real, place + "[2]: t = '16384': expected " + kExpectedTime, 2);
  const long long end_us = kEndOfTimeNs / 1'000;
  for (const int sign : {-1, 1}) {
    Columns shifted;
    shifted.offset = {sign * (end_us - 2'500)};
    shifted.t = {0, 0, sign * 2'500};
    check(shifted, "no error", 3);
    shifted.t[2] = sign * 2'501;
    check(shifted, place + fmt::format("[2]: t = '{}': expected {}", shifted.t[2], kExpectedTime),
          2);
    shifted.offset = {sign * (end_us + 1)};
    write(shifted);
    EXPECT_THAT(errorOfFile(),
                HasSubstr(fmt::format("/t_offset: {}: expected a time", shifted.offset[0])));
  }
}

TEST_F(Hdf5Events, ASeekGoesToTheFirstEventOfItsTimeOrOfItsMillisecondInTheIndex) {
  Columns columns;
  columns.t = {0, 500, 999, 1'000, 1'000, 2'500, 2'500, 4'000};  // µs
  columns.x = columns.y = columns.p = Numbers(8, 1);
  const struct {
    std::optional<Numbers> index;
    Numbers times_ns;
    std::vector<int> first_events;  // one per time
  } cases[] = {
      {std::nullopt,
       {-1'000'000, 0, 1, 500'000, 999'000, 999'001, 1'000'000, 1'000'001, 2'500'000, 2'500'001,
        4'000'000, 4'000'001},
       {0, 0, 1, 1, 2, 3, 3, 5, 5, 7, 7, 8}},
      {Numbers{0, 3, 5, 7, 7},
       {-1'000'000, 999'999, 1'000'000, 1'999'999, 2'000'000, 3'000'000, 4'000'000, 9'000'000},
       {0, 0, 3, 3, 5, 7, 7, 7}},
      // An index that is too early is used. For other wrong indices the events are searched.
      {Numbers{0, 1, 3}, {1'000'000, 1'000'001, 3'000'000}, {1, 1, 3}},
      {Numbers{1, 4, 6}, {0, 500'000, 1'000'000, 2'500'000}, {0, 1, 3, 5}},
      {Numbers{8, 8, 8}, {500'000, 2'500'000, 4'000'000, 4'000'001}, {1, 5, 7, 8}},
      {Numbers{-1, 9, 99}, {0, 1'000'000, 2'500'000, 4'000'001}, {0, 3, 5, 8}},
      {Numbers{}, {999'000, 4'000'001}, {2, 8}},
  };
  for (const Numbers& offset : {Numbers{}, Numbers{7'000'123}, Numbers{-20'000}}) {
    columns.offset = offset;
    const std::int64_t offset_ns = offset.empty() ? 0 : offset[0] * 1'000;
    for (const auto& [index, times_ns, first_events] : cases) {
      columns.index = index;
      write(columns);
      for (std::size_t i = 0; i < times_ns.size(); ++i) {
        const std::int64_t t_ns = times_ns[i];
        const int first = first_events[i];
        const RecordingParts parts = openHdf5({file()}, {});
        parts.cameras[0]->seek(t_ns + offset_ns);
        std::vector<Event> events;
        EXPECT_EQ(parts.cameras[0]->read(events), first < 8) << t_ns;
        ASSERT_EQ(events.size(), static_cast<std::size_t>(8 - first)) << t_ns;
        if (first == 8) continue;
        EXPECT_EQ(events[0].t_ns, columns.t[static_cast<std::size_t>(first)] * 1'000 + offset_ns);
        EXPECT_EQ(parts.cameras[0]->positionOf(0),
                  fmt::format("{}:/events[{}]", file().string(), first));
      }
    }
  }
}

TEST_F(Hdf5Events, RealTimesAreSecondsAndKeepTheDigitsThatTheyHold) {
  const Numbers pixels = {1, 2};
  const struct {
    hid_t type;
    std::vector<double> t;
    std::vector<std::int64_t> t_ns;
  } rows[] = {
      {H5T_IEEE_F64LE, {0.000012, 12.345678912}, {12'000, 12'345'678'912}},
      {H5T_IEEE_F64LE, {-0.5, 3e6 + 0.123456789}, {-500'000'000, 3'000'000'123'456'789}},
      {H5T_IEEE_F64LE,  // steps of 240 ns, the resolution of doubles at these times
       {1.5e9 + 0.000001, 1'500'000'001.123456},
       {1'500'000'000'000'001'000, 1'500'000'001'123'456'000}},
      {H5T_IEEE_F32LE, {0.25, 10.123456}, {250'000'000, 10'123'456'000}},
  };
  const char* const names[][4] = {{"events/x", "events/y", "events/t", "events/p"},
                                  {"events/xs", "events/ys", "events/ts", "events/ps"},
                                  {"a/col", "a/row", "b/stamps", "a/sign"}};
  for (const auto& row : rows) {
    for (const auto& [x, y, t, p] : names) {
      {
        Writing writing(file());
        writing.add(x, H5T_STD_U16LE, pixels);
        writing.add(y, H5T_STD_U16LE, Numbers{3, 4});
        writing.add(t, row.type, row.t);
        writing.add(p, H5T_STD_I8LE, Numbers{1, -1});
      }
      ReaderOptions options;
      if (*x == 'a') options.columns = "t=b/stamps x=/a/col y=a/row p=a/sign";
      const RecordingParts parts = openHdf5({file()}, options);
      EXPECT_THAT(readStream(*parts.cameras.at(0)),
                  ElementsAre(Event{row.t_ns[0], 1, 3, true}, Event{row.t_ns[1], 2, 4, false}))
          << x;
    }
  }
}

TEST_F(Hdf5Events, TheUnitOfTimesIsToldOrFoundWhereTheLayoutDoesNotSayIt) {
  const Numbers many(2000, 1);
  Numbers whole;
  for (int i = 0; i < 2000; ++i) whole.push_back(5'000'000 + 10 * i);
  const std::vector<double> real(whole.begin(), whole.end());
  const auto first_of = [&](const char* t, hid_t type, const auto& times,
                            const ReaderOptions& options) {
    {
      Writing writing(file());
      for (const char* name : {"x", "y", "p"}) {
        const std::string path = std::string("events/") + name + (t[8] == 's' ? "s" : "");
        writing.add(path.c_str(), H5T_STD_U16LE, many);
      }
      writing.add(t, type, times);
    }
    return readStream(*openHdf5({file()}, options).cameras.at(0)).at(1).t_ns;
  };
  ReaderOptions ms;
  ms.time_unit = "ms";
  EXPECT_EQ(first_of("events/t", H5T_STD_I64LE, whole, {}), 5'000'010'000);
  EXPECT_EQ(first_of("events/t", H5T_STD_I64LE, whole, ms), 5'000'010'000) << "DSEC's are us";
  EXPECT_EQ(first_of("events/t", H5T_IEEE_F64LE, real, ms), 5'000'010'000'000);
  EXPECT_EQ(first_of("events/ts", H5T_STD_I64LE, whole, ms), 5'000'010'000'000);
  const std::string expected = ": all times are whole numbers, of an unknown unit: probably us";
  EXPECT_THAT(errorOf([&] { first_of("events/ts", H5T_STD_I64LE, whole, {}); }),
              HasSubstr(":/events/ts" + expected));
  EXPECT_THAT(errorOf([&] { first_of("events/t", H5T_IEEE_F64LE, real, {}); }),
              HasSubstr(":/events/t" + expected));
  for (long long& t_us : whole) t_us += 1'700'000'000'000'000;  // in the present era
  EXPECT_EQ(first_of("events/ts", H5T_STD_I64LE, whole, {}), 1'700'000'005'000'010'000);
  EXPECT_EQ(openHdf5({file()}, {}).cameras[0]->warnings().at(0).name, "time-unit");
  {
    Writing writing(file());  // MVSEC's times are seconds
    writing.add("davis/left/events", H5T_IEEE_F64LE, std::vector<double>{1, 2, 5, 1, 3, 4, 15, -1},
                {2, 4});
  }
  EXPECT_THAT(readStream(*openHdf5({file()}, ms).cameras.at(0)),
              ElementsAre(Event{5'000'000'000, 1, 2, true}, Event{15'000'000'000, 3, 4, false}));
}

TEST_F(Hdf5Events, AChunkMayHoldAPartOfItsRows) {
  std::vector<double> matrices;  // rotations by 90 degrees around x, at (k, 2, 3)
  for (double k = 0; k < 5; ++k) {
    for (const double number : {1., 0., 0., k, 0., 0., -1., 2., 0., 1., 0., 3., 0., 0., 0., 1.}) {
      matrices.push_back(number);
    }
  }
  const std::vector<hsize_t> chunks[] = {{2, 3, 3}, {3, 1, 4}, {5, 4, 4}, {2, 4, 1}};
  for (const std::vector<hsize_t>& chunk : chunks) {
    {
      Writing writing(file());
      const Hdf5Id creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
      H5Pset_chunk(creation.get(), 3, chunk.data());
      H5Pset_shuffle(creation.get());
      H5Pset_deflate(creation.get(), 1);
      writing.add("davis/left/pose", H5T_IEEE_F64LE, matrices, {5, 4, 4}, creation.get());
      writing.add("davis/left/pose_ts", H5T_IEEE_F64LE, std::vector<double>{0, 1, 2, 3, 4.5});
    }
    const std::vector<StampedPose> poses = openHdf5({file()}, {}).poses;
    ASSERT_EQ(poses.size(), 5U);
    EXPECT_EQ(poses[4].t_ns, 4'500'000'000);
    for (std::size_t k = 0; k < 5; ++k) {
      const Eigen::Vector3d moved = poses[k].T_world_rig * Eigen::Vector3d(0, 0, -1);
      EXPECT_LT((moved - Eigen::Vector3d(static_cast<double>(k), 3, 3)).norm(), 1e-12) << chunk[0];
    }
  }
}

TEST_F(Hdf5Events, NamesOfTheOptionAreDataSetsOrFields) {
  ASSERT_EQ(std::system(("/usr/bin/python3 -c 'import h5py, numpy as np; "
                         "h5py.File(\"" +
                         file().string() +
                         "\", \"w\")[\"a/list\"] = "
                         "np.array([(5, 1, 7, 8)], dtype=[(\"time_us\", \"i8\"), (\"on\", \"?\"), "
                         "(\"u\", \"u2\"), (\"v\", \"u2\")])'")
                            .c_str()),
            0);
  ReaderOptions options;
  options.columns = "t=a/list/time_us x=a/list/u y=a/list/v p=a/list/on";
  EXPECT_THAT(readStream(*openHdf5({file()}, options).cameras.at(0)),
              ElementsAre(Event{5'000, 7, 8, true}));
  options.time_unit = "ms";
  EXPECT_EQ(readStream(*openHdf5({file()}, options).cameras.at(0)).at(0).t_ns, 5'000'000)
      << "before that of the name";
  std::string bytes = readBytes(file());
  bytes.at(bytes.find("time_us") + sizeof("time_us") + 2) = 1;  // third byte of time_us's offset
  writeFile(file(), bytes);
  EXPECT_THAT(
      errorOf([&] { openHdf5({file()}, options); }),
      HasSubstr(":/a/list: field time_us at byte 65536: expected a field inside a row of 13"));
  options.columns = "t=a/list/t x=a/list/u y=a/list/v p=a/list/on";
  EXPECT_THAT(errorOf([&] { openHdf5({file()}, options); }), HasSubstr("with a field t"));
  options.columns = "t=b/list/time_us x=a/list/u y=a/list/v p=a/list/on";
  EXPECT_THAT(errorOf([&] { openHdf5({file()}, options); }),
              HasSubstr(":/b/list/time_us: expected a field of /a/list"));
  write({});
  EXPECT_THAT(errorOf([&] { openHdf5({file()}, options); }),
              HasSubstr("events.h5:/a/list/u: no such data set (--event-columns)"));
}

TEST_F(Hdf5Events, AnOrderOfTheOptionIsThatOfAnNByFourDataSet) {
  ASSERT_EQ(std::system(("/usr/bin/python3 -c 'import h5py, numpy as np; "
                         "h5py.File(\"" +
                         file().string() +
                         "\", \"w\")[\"events\"] = np.array([[5, 7, 8, 1], [6, 9, 8, 0]])'")
                            .c_str()),
            0);
  ReaderOptions options;
  options.columns = "t x y p";
  options.time_unit = "us";
  EXPECT_THAT(readStream(*openHdf5({file()}, options).cameras.at(0)),
              ElementsAre(Event{5'000, 7, 8, true}, Event{6'000, 9, 8, false}));
  options.columns = "t=events x=events y=events p=events";
  EXPECT_THAT(errorOf([&] { openHdf5({file()}, options); }),
              HasSubstr(":/events: N x 4 numbers: expected a list; for an N x 4 data set /events"));
  options.columns = "p t y x";
  EXPECT_NE(errorOf([&] { readStream(*openHdf5({file()}, options).cameras.at(0)); }), "no error");
}

TEST(Hdf5CrashNote, EndsAProgramWithTheNameOfTheFileAndNoHost) {
  const auto call = [](bool in_program, const std::function<void()>& library) {
    if (in_program) Hdf5CrashNote::enable();
    const Hdf5CrashNote note("a.h5", 1);
    { const Hdf5CrashNote inner("b.h5"); }
    library();
  };
  const auto overflow = [] {
    while (true) *static_cast<volatile char*>(alloca(4096)) = 1;
  };
  const testing::ExitedWithCode noted(1);
  const std::string crashes =
      "^event-fusion: error: a.h5: the HDF5 library crashes on it: expected a file without "
      "damage\n$";
  EXPECT_EXIT(call(true, std::abort), noted, crashes);
  EXPECT_EXIT(call(true, overflow), noted, crashes);
  EXPECT_EXIT(call(true, pause), noted, "the HDF5 library does not come back from it within 1 s: ");
  const testing::KilledBySignal aborted(SIGABRT);
  EXPECT_EXIT(call(true, [] { std::thread(std::abort).join(); }), aborted, "^$");
  EXPECT_EXIT((call(true, [] {}), std::abort()), aborted, "^$") << "after the note";
  EXPECT_EXIT(call(false, std::abort), aborted, "^$");
}

TEST_F(Hdf5Events, AFileThatCannotBeReadNamesTheDataSetAndWhatIsExpected) {
  struct DataSet {
    const char* path;
    hid_t type;
    std::vector<double> numbers;
    std::vector<hsize_t> sides{};
    std::optional<H5Z_filter_t> filter{};  ///< If set, chunks of three; 0: no filter.
  };
  const std::vector<double> three = {1, 2, 3};
  const std::vector<double> sixteen(16, 0.5);
  const char* const mvsec = "davis/left/events";
  const auto with_rest = [&](const DataSet& x) {
    return std::vector<DataSet>{x,
                                {"events/y", H5T_STD_U16LE, three},
                                {"events/t", H5T_STD_I64LE, three},
                                {"events/p", H5T_STD_U8LE, three}};
  };
  const std::pair<std::vector<DataSet>, std::vector<std::string>> cases[] = {
      {{{"rectify_map", H5T_IEEE_F32LE, three}},
       {"without events or poses", "/events/x (DSEC", "/CD/events (Metavision)", "/Cn_T_C0"}},
      {{{"events/x", H5T_STD_U16LE, three}},
       {":/events/y: cannot be opened", "expected a data set"}},
      {with_rest({"events/x", H5T_STD_U16LE, {1, 2}}),
       {":/events/y: 3 numbers: expected 2, as many as /events/x has"}},
      {{{"events/x", H5T_STD_U16BE, three}},
       {":/events/x: expected whole numbers", "little-endian"}},
      {{{"CD/events", H5T_STD_U16LE, three, {}, 0x8ECF}},
       {":/CD/events: it is compressed with Prophesee's ECF (0x8ECF)", "hdf5_ecf"}},
      {{{"events/x", H5T_STD_U16LE, three, {}, 32004}},
       {":/events/x: it is compressed with filter 32004", "HDF5_PLUGIN_PATH"}},
      {{{"CD/events", H5T_STD_U16LE, three}},
       {":/CD/events: expected a list of compound values with a field x"}},
      {with_rest({"events/x", H5T_STD_U16LE, {}, {3}, 0}),
       {":/events/x[0]: the chunk is missing: expected a complete file"}},
      {{{mvsec, H5T_IEEE_F64LE, three, {1, 3}}},
       {":/davis/left/events: 3 columns: expected 4 or more"}},
      {{{mvsec, H5T_IEEE_F64LE, {1, 2, std::nan(""), 1}, {1, 4}}},
       {":/davis/left/events[0]: t = 'nan': expected a time"}},
      {{{"Cn_T_C0", H5T_IEEE_F64LE, sixteen, {1, 4, 4}}, {"ts", H5T_STD_I64LE, {1}}},
       {":/Cn_T_C0[0]: expected a 4x4 matrix of a rotation and a translation"}},
      {{{"Cn_T_C0", H5T_IEEE_F64LE, sixteen, {1, 4, 4}}, {"ts", H5T_STD_I64LE, three}},
       {":/Cn_T_C0: 1 rows of 16 numbers: expected 3 matrices of 4x4 numbers, as many as /ts has"}},
  };
  for (const auto& [sets, parts] : cases) {
    {
      Writing writing(file());
      for (const DataSet& set : sets) {
        const Hdf5Id creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
        const hsize_t side = 3;
        if (set.filter) H5Pset_chunk(creation.get(), 1, &side);
        if (set.filter.value_or(0) != 0) {
          H5Pset_filter(creation.get(), *set.filter, H5Z_FLAG_OPTIONAL, 0, nullptr);
        }
        writing.add(set.path, set.type, set.numbers, set.sides, creation.get());
      }
    }
    const std::string error = errorOfFile();
    EXPECT_THAT(error, StartsWith(file().string()));
    for (const std::string& part : parts) EXPECT_THAT(error, HasSubstr(part));
  }
  writeFile(file(), "x y t p\n");
  EXPECT_EQ(errorOfFile(), file().string() +
                               ": cannot be opened as HDF5 (file signature not found): "
                               "expected a complete HDF5 file");
}

/// Calibration of a camera in M3ED's format.
struct Calib {
  std::vector<double> resolution = {640, 480};
  std::vector<double> intrinsics = {500, 501, 320, 240};
  std::string model = "radtan";
  std::vector<double> coefficients = {0.1, 0.2, 0.3, 0.4};
  std::vector<double> T_rig_cam = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
};

TEST_F(Hdf5Events, ACalibrationIsOfTheFirstCamerasRigAndItsErrorsNameTheDataSet) {
  int files = 0;
  const auto opened = [&](const std::vector<std::pair<std::string, Calib>>& cameras) {
    const fs::path calibrated = folder() / (std::to_string(++files) + ".h5");
    {
      Writing writing(calibrated);
      for (const auto& [side, calib] : cameras) {
        const std::string group = "prophesee/" + side;
        for (const char* column : {"/x", "/y", "/t", "/p"}) {
          writing.add((group + column).c_str(), H5T_STD_I32LE, Numbers{1});
        }
        const auto add = [&](const char* name, const std::vector<double>& numbers) {
          writing.add((group + "/calib/" + name).c_str(), H5T_IEEE_F64LE, numbers);
        };
        add("resolution", calib.resolution);
        add("intrinsics", calib.intrinsics);
        add("distortion_coeffs", calib.coefficients);
        add("T_to_prophesee_left", calib.T_rig_cam);
        writing.addText(group + "/calib/distortion_model", calib.model);
      }
    }
    return openHdf5({calibrated}, {});
  };
  Calib right;
  right.resolution = {65'535, 1};
  right.model = "none";
  right.T_rig_cam = {0, -1, 0, 0.1, 1, 0, 0, 0.2, 0, 0, 1, 0.3, 0, 0, 0, 1};
  const RecordingParts both = opened({{"left", {}}, {"right", right}});
  const Rig rig = both.calibration.value().rig;
  ASSERT_EQ(rig.cameras.size(), 2U);
  CameraModel left{640, 480, 500, 501, 320, 240, DistortionModel::kRadtan, {}};
  left.coefficients = {0.1, 0.2, 0.3, 0.4};
  EXPECT_EQ(rig.cameras[0].model, left);
  EXPECT_EQ(rig.cameras[1].model,
            (CameraModel{65'535, 1, 500, 501, 320, 240, DistortionModel::kNone, {}}));
  EXPECT_LT((rig.cameras[1].T_rig_cam * Eigen::Vector3d(1, 2, 3) - Eigen::Vector3d(-1.9, 1.2, 3.3))
                .norm(),
            1e-12);
  EXPECT_EQ(both.cameras[1]->size().value().width, 65'535);
  EXPECT_FALSE(opened({{"right", right}}).calibration) << "without the rig's first camera";
  const std::tuple<std::vector<double> Calib::*, std::vector<double>, const char*> rows[] = {
      {&Calib::resolution, {640}, "calib/resolution: expected 2 numbers, width and height"},
      {&Calib::resolution, {0, 480}, "calib/resolution: 0: expected whole numbers from 1 to 65535"},
      {&Calib::resolution, {640, 65'536}, "calib/resolution: 65536: expected whole numbers"},
      {&Calib::resolution, {640, 4.5}, "calib/resolution: 4.5: expected whole numbers"},
      {&Calib::intrinsics, {1, 2, std::nan(""), 4}, "calib/intrinsics: nan: expected fx fy cx cy"},
      {&Calib::intrinsics, {-1, 2, 3, 4}, "prophesee/left/calib: fx = -1"},
      {&Calib::coefficients, {1, 2, 3}, "calib/distortion_coeffs: expected 4 numbers"},
      {&Calib::T_rig_cam, std::vector<double>(16, 0.5), "T_to_prophesee_left: expected a 4x4 matr"},
  };
  for (const auto& [field, numbers, error] : rows) {
    Calib wrong;
    wrong.*field = numbers;
    EXPECT_THAT(errorOf([&, &wrong = wrong] { opened({{"left", wrong}}); }), HasSubstr(error));
  }
  Calib fov;
  fov.model = "fov";
  EXPECT_THAT(errorOf([&] {
                opened({{"left", fov}});
              }),
              HasSubstr("calib/distortion_model: 'fov': expected radtan, equidistant or none"));
}

TEST_F(Hdf5Events, FilesOfAFolderAreInTheOrderOfTheirCameras) {
  write({});
  const fs::path in = folder() / "in";
  for (const char* name : {"events/right/events.h5", "events/left/events.h5",
                           "events/cam2/events.h5", "a_events/b.hdf5", "c.h5", "c.txt", "d/left.h5",
                           "rectify_map.h5", "events/left/deep_events/e.h5"}) {
    fs::create_directories((in / name).parent_path());
    fs::copy_file(file(), in / name);
  }
  writeFile(in / "events/left/none.h5", "no HDF5");
  std::vector<std::string> found;
  for (const auto& [camera, path] : hdf5FilesIn(in)) {
    found.push_back(camera + ": " + path.lexically_relative(in).string());
  }
  EXPECT_THAT(found, ElementsAre("left: events/left/events.h5", "right: events/right/events.h5",
                                 ": a_events/b.hdf5", ": c.h5", "cam2: events/cam2/events.h5"));
  EXPECT_THAT(errorOf([&] { openHdf5({in}, {}); }),
              AllOf(StartsWith((in / "c.h5").string()), HasSubstr("a second recording"),
                    HasSubstr("a_events/b.hdf5")));
  EXPECT_TRUE(looksLikeHdf5(in / "c.txt")) << "by its first bytes";
  EXPECT_FALSE(looksLikeHdf5(in / "events/left/none.h5"));
  fs::remove(in / "events/left/events.h5");
  fs::remove_all(in / "events/left/deep_events");
  EXPECT_FALSE(looksLikeHdf5(in / "events/left"));
  EXPECT_FALSE(looksLikeHdf5(in / "missing"));
}

}  // namespace
}  // namespace efm
