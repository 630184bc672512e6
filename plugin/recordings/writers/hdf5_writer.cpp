// SPDX-License-Identifier: BSD-3-Clause
#include <blosc.h>
#include <fmt/format.h>

#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "mapping/geometry/timestamp.h"
#include "plugin/recordings/columns/hdf5_file.h"
#include "plugin/recordings/writers/recording_writer.h"

namespace efm {
namespace {

namespace fs = std::filesystem;

constexpr hsize_t kChunkNumbers = 65'536;
constexpr int kBloscLevel = 1;

void require(bool done, const char* what) {
  if (!done) throw std::runtime_error(what + hdf5Cause());
}

/// Calls `write`, and adds the name of the file to its errors.
template <typename Write>
void naming(const fs::path& file, const Write& write) {
  try {
    write();
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(fmt::format("{}: {}", file.string(), error.what()));
  }
}

/// Returns the chunk properties of DSEC's files: Blosc with shuffled bytes and Zstandard.
Hdf5Id chunkProperties(std::size_t number_bytes) {
  constexpr H5Z_filter_t kBlosc = 32001;
  constexpr unsigned kFilterVersion = 2;
  Hdf5Id properties(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  H5Pset_chunk(properties.get(), 1, &kChunkNumbers);
  H5Pset_fill_time(properties.get(), H5D_FILL_TIME_NEVER);
  const unsigned values[] = {kFilterVersion,
                             BLOSC_VERSION_FORMAT,
                             static_cast<unsigned>(number_bytes),
                             static_cast<unsigned>(number_bytes * kChunkNumbers),
                             kBloscLevel,
                             BLOSC_SHUFFLE,
                             BLOSC_ZSTD};
  // Chunks are compressed here: the library need not have the filter.
  H5Pset_filter(properties.get(), kBlosc, H5Z_FLAG_OPTIONAL, std::size(values), values);
  return properties;
}

std::string cameraName(std::size_t camera) {
  if (camera < 2) return camera == 0 ? "left" : "right";
  return fmt::format("cam{}", camera);
}

/// A growing list of whole numbers in an HDF5 file. Blosc with Zstandard compresses the chunks.
/// Memory holds one chunk.
class Hdf5List {
 public:
  /// @param type little-endian type of the numbers in the file, with the size of added numbers.
  Hdf5List(hid_t file, const char* path, hid_t type)
      : number_bytes_(H5Tget_size(type)), chunk_bytes_(number_bytes_ * kChunkNumbers) {
    const hsize_t none = 0;
    const hsize_t any = H5S_UNLIMITED;
    const Hdf5Id space(H5Screate_simple(1, &none, &any), H5Sclose);
    const Hdf5Id properties = chunkProperties(number_bytes_);
    set_ = Hdf5Id(
        H5Dcreate2(file, path, type, space.get(), H5P_DEFAULT, properties.get(), H5P_DEFAULT),
        H5Dclose);
    require(set_.valid(), path);
    chunk_.reserve(chunk_bytes_);
    compressed_.resize(chunk_bytes_ + BLOSC_MAX_OVERHEAD);
  }

  template <typename Number>
  void add(Number number) {
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(&number);
    chunk_.insert(chunk_.end(), bytes, bytes + sizeof(Number));
    ++count_;
    if (chunk_.size() == chunk_bytes_) writeChunk();
  }
  /// Writes the rest. @throws std::runtime_error, as `add`, without the name of the file.
  void close() {
    if (!chunk_.empty()) {
      chunk_.resize(chunk_bytes_);
      writeChunk();
    }
    set_ = {};
  }

 private:
  void writeChunk() {
    const int bytes =
        blosc_compress_ctx(kBloscLevel, BLOSC_SHUFFLE, number_bytes_, chunk_.size(), chunk_.data(),
                           compressed_.data(), compressed_.size(), BLOSC_ZSTD_COMPNAME, 0, 1);
    require(bytes > 0, "Blosc cannot compress it");
    const hsize_t size = count_;
    const hsize_t offset = written_;
    require(H5Dset_extent(set_.get(), &size) >= 0 &&
                H5Dwrite_chunk(set_.get(), H5P_DEFAULT, 0, &offset, static_cast<std::size_t>(bytes),
                               compressed_.data()) >= 0,
            "cannot be written");
    written_ = count_;
    chunk_.clear();
  }

  Hdf5Id set_;
  std::size_t number_bytes_;
  std::size_t chunk_bytes_;
  std::vector<std::uint8_t> chunk_;
  std::vector<char> compressed_;
  std::uint64_t count_ = 0;    // numbers
  std::uint64_t written_ = 0;  // numbers
};

class Hdf5Camera {
 public:
  explicit Hdf5Camera(fs::path path)
      : path_(std::move(path)),
        file_(H5Fcreate(path_.c_str(), H5F_ACC_EXCL, H5P_DEFAULT, H5P_DEFAULT), H5Fclose),
        group_(H5Gcreate2(file_.get(), "events", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose),
        x_(file_.get(), "events/x", H5T_STD_U16LE),
        y_(file_.get(), "events/y", H5T_STD_U16LE),
        p_(file_.get(), "events/p", H5T_STD_U8LE),
        t_(file_.get(), "events/t", H5T_STD_U32LE),
        index_(file_.get(), "ms_to_idx", H5T_STD_U64LE) {}

  void add(const Event& event) {
    constexpr std::int64_t kMillisecondUs = 1'000;
    const auto fail = [&](const char* expected) {
      return std::runtime_error(fmt::format("event {} at {} s: expected {}", events_,
                                            formatSeconds(event.t_ns), expected));
    };
    if (event.t_ns % kNanosecondsPerMicrosecond != 0) {
      throw fail("a time in whole microseconds, which is what DSEC's layout can hold");
    }
    const std::int64_t t_us = event.t_ns / kNanosecondsPerMicrosecond;
    if (!first_us_) first_us_ = t_us;
    const std::int64_t since_us = t_us - *first_us_;
    if (since_us < 0 || since_us > std::numeric_limits<std::uint32_t>::max()) {
      throw fail(
          "a time within 71 minutes after the camera's first event, which is what DSEC's layout "
          "can hold");
    }
    while (static_cast<std::int64_t>(milliseconds_) * kMillisecondUs <= since_us) {
      index_.add(events_);
      ++milliseconds_;
    }
    x_.add(event.x);
    y_.add(event.y);
    p_.add(static_cast<std::uint8_t>(event.polarity ? 1 : 0));
    t_.add(static_cast<std::uint32_t>(since_us));
    ++events_;
  }

  void close() {
    for (Hdf5List* list : {&x_, &y_, &p_, &t_, &index_}) list->close();
    const std::int64_t offset = first_us_.value_or(0);
    {
      const Hdf5Id space(H5Screate(H5S_SCALAR), H5Sclose);
      const Hdf5Id set(H5Dcreate2(file_.get(), "t_offset", H5T_STD_I64LE, space.get(), H5P_DEFAULT,
                                  H5P_DEFAULT, H5P_DEFAULT),
                       H5Dclose);
      require(H5Dwrite(set.get(), H5T_NATIVE_INT64, H5S_ALL, H5S_ALL, H5P_DEFAULT, &offset) >= 0,
              "cannot be written");
    }
    group_ = {};
    require(H5Fflush(file_.get(), H5F_SCOPE_GLOBAL) >= 0, "cannot be written");
    file_ = {};
  }

  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
  Hdf5Id file_;
  Hdf5Id group_;
  Hdf5List x_, y_, p_, t_, index_;
  std::optional<std::int64_t> first_us_;
  std::uint64_t events_ = 0;
  std::uint64_t milliseconds_ = 0;  // number of milliseconds in the index
};

class Hdf5Writer : public RecordingWriter {
 public:
  Hdf5Writer(const fs::path& folder, const Rig& rig)
      : folder_(folder), poses_(folder_.temporary() / "poses.txt") {
    writeCamchain(folder_.temporary(), rig);
    for (std::size_t camera = 0; camera < rig.cameras.size(); ++camera) {
      const fs::path file = folder_.temporary() / "events" / cameraName(camera) / "events.h5";
      fs::create_directories(file.parent_path());
      naming(file, [&] { cameras_.emplace_back(file); });
    }
  }

  void addEvents(std::size_t camera, const std::vector<Event>& events) override {
    Hdf5Camera& file = cameras_.at(camera);
    naming(file.path(), [&] {
      for (const Event& event : events) file.add(event);
    });
  }

  void addPose(const StampedPose& pose) override { poses_.add(pose); }

  void close() override {
    for (Hdf5Camera& camera : cameras_) naming(camera.path(), [&] { camera.close(); });
    poses_.close();
    folder_.finish();
  }

 private:
  NewFolder folder_;
  Hdf5Quiet quiet_;  // also while the cameras' files are closed
  std::vector<Hdf5Camera> cameras_;
  PoseTextFile poses_;
};

}  // namespace

std::unique_ptr<RecordingWriter> openHdf5Writer(const std::filesystem::path& folder,
                                                const Rig& rig) {
  return std::make_unique<Hdf5Writer>(folder, rig);
}

}  // namespace efm
