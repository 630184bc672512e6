// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <hdf5.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace efm {

/// Owns an identifier of the HDF5 library. The library is not thread-safe: one thread at a time
/// calls it.
class Hdf5Id {
 public:
  using Close = herr_t (*)(hid_t);
  Hdf5Id() = default;
  Hdf5Id(hid_t id, Close close) : id_(id), close_(close) {}
  ~Hdf5Id() {
    if (id_ >= 0) close_(id_);
  }
  Hdf5Id(Hdf5Id&& other) noexcept
      : id_(std::exchange(other.id_, hid_t{H5I_INVALID_HID})), close_(other.close_) {}
  Hdf5Id& operator=(Hdf5Id&& other) noexcept {
    std::swap(id_, other.id_);
    std::swap(close_, other.close_);
    return *this;
  }

  hid_t get() const { return id_; }
  bool valid() const { return id_ >= 0; }

 private:
  hid_t id_ = H5I_INVALID_HID;
  Close close_ = nullptr;
};

/// While it lives, the HDF5 library does not print its errors.
class Hdf5Quiet {
 public:
  Hdf5Quiet() {
    // At the process's end, the library would crash over a file that it could not write.
    static const herr_t no_exit_handler = H5dont_atexit();
    static_cast<void>(no_exit_handler);
    H5Eget_auto2(H5E_DEFAULT, &print_, &data_);
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  }
  ~Hdf5Quiet() { H5Eset_auto2(H5E_DEFAULT, print_, data_); }
  Hdf5Quiet(const Hdf5Quiet&) = delete;
  Hdf5Quiet& operator=(const Hdf5Quiet&) = delete;

 private:
  H5E_auto2_t print_ = nullptr;
  void* data_ = nullptr;
};

/// The cause of the last failed call as the library words it, in parentheses and with a blank in
/// front; empty if it has none.
std::string hdf5Cause();

/// An HDF5 file, open for reading. Paths of its objects begin with '/'.
class Hdf5File {
 public:
  /// @throws std::runtime_error naming the file if it cannot be opened.
  explicit Hdf5File(std::filesystem::path file);

  const std::filesystem::path& path() const { return path_; }
  hid_t id() const { return id_.get(); }
  std::uint64_t bytes() const { return bytes_; }

  bool has(const std::string& path) const;
  /// @throws std::runtime_error naming the file and the data set if there is no such data set.
  Hdf5Id dataset(const std::string& path) const;
  /// All numbers of a small data set, row by row.
  /// @param count the expected number of numbers.
  /// @throws std::runtime_error naming the file, the data set and `expected`, its meaning.
  std::vector<double> numbers(const std::string& path, std::size_t count,
                              std::string_view expected) const;
  /// A whole number. @throws std::runtime_error naming the file and the data set.
  std::int64_t integer(const std::string& path) const;
  /// The text of a data set. @throws std::runtime_error naming the file and the data set.
  std::string text(const std::string& path) const;
  /// The text of an attribute of the file, if it has this attribute.
  std::optional<std::string> attribute(const char* name) const;

  /// "FILE:PATH: …".
  std::runtime_error fail(const std::string& path, std::string_view what) const;

 private:
  std::filesystem::path path_;
  Hdf5Id id_;
  std::uint64_t bytes_ = 0;
};

}  // namespace efm
