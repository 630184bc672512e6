// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace efm {

/// The kind of files in a folder. A folder holds one kind.
enum class OutputKind {
  /// map.pcd, map.ply, map.simplemap, map.html, map.png, overview.png, trajectory.txt,
  /// session.mcap,
  /// report.json, keyframes/<t_ref>/ with images
  kMap,
  kDepth,  ///< The images of one keyframe, points.pcd, dsi.npy, report.json.
};

/// The complete result of an earlier run in a folder.
struct EarlierResult {
  std::vector<std::string> recording;  ///< The files of the recording. Empty: unknown.
  std::uint64_t keyframes = 0;

  /// Returns whether the result is of these files. Bytes that are not UTF-8 are not compared.
  bool isOf(const std::vector<std::string>& files) const;
};

/// The folder OUT of a result, which appears there whole or not at all.
///
/// The files are written to OUT.partial. At the end both folders exchange their names, and the
/// earlier result is removed. If the file system cannot exchange names, the earlier result is
/// OUT.earlier for a moment; after a crash in that moment, the next run gives it its name back. The
/// files of a run that was killed stay in OUT.partial. The next run goes on with them, or renames
/// that folder to OUT.left (if that exists, the folder with more keyframes stays), and removes it
/// when its own result is whole.
///
/// The file run.lock in OUT.partial names the run's host and process, is locked, and is touched
/// every 10 s. Where another host's lock is not seen (some network file systems), a file that was
/// touched in the last minute is a run at work.
///
/// Where OUT cannot be renamed (a mount point, the working folder, a parent that cannot be written)
/// or holds other files, which stay, the folders lie within OUT: result.partial, result.left,
/// result.earlier. At the end the earlier files are moved one by one to result.moving, which is
/// then renamed to result.earlier. Then the new files are moved to OUT, report.json last. If OUT is
/// a symbolic link, this applies to its target.
///
/// A file status.json in OUT, of a shard or a join at work, is removed with the earlier result.
class ResultFolder {
 public:
  /// Rejects a folder that is not for a result: another run is at work there, or, without `force`,
  /// it holds other files and no earlier result, or one of another kind. Gives an earlier result
  /// its name back after a crash.
  /// @throws std::runtime_error naming the folder.
  static void require(const std::filesystem::path& out, OutputKind kind, bool force);
  /// Returns the result of either kind in a folder.
  static std::optional<EarlierResult> earlierResult(const std::filesystem::path& out);
  /// Returns whether a run is writing a result for this folder or into it, or left one there.
  static bool hasPartial(const std::filesystem::path& out);

  /// Returns the folders where an earlier run for OUT may have stored keyframes: OUT, then those of
  /// runs that were killed.
  static std::vector<std::filesystem::path> storedIn(const std::filesystem::path& out);

  /// Makes the folder that is written to. No other run can do so until this object is destroyed.
  /// @param resume the folder to go on with, one of `storedIn`; empty: begin anew. Its files are
  /// moved here; those of OUT are copied.
  /// @throws std::runtime_error naming the folder if it cannot be made, or another run is at work.
  ResultFolder(std::filesystem::path out, OutputKind kind,
               const std::filesystem::path& resume = {});
  /// Removes the files, unless `commit` or `abandon` was called, or the run goes on with others.
  ~ResultFolder();
  ResultFolder(const ResultFolder&) = delete;
  ResultFolder& operator=(const ResultFolder&) = delete;

  /// Returns OUT, as the user gave it.
  const std::filesystem::path& out() const { return out_; }
  /// Returns the folder to write to.
  const std::filesystem::path& path() const { return places_.partial; }
  /// Returns the folder with the keyframes of killed runs; empty if there is none.
  const std::filesystem::path& left() const { return left_; }
  /// Returns whether OUT has a result, which the commit replaces.
  bool hasEarlier() const { return earlierResult(out_).has_value(); }

  /// Waits until all files are on the disk, and replaces the earlier result.
  /// @param is_whole false: the run was stopped; the files of killed runs stay.
  /// @throws std::runtime_error. Then the earlier result is there, and the files stay in `path`.
  void commit(bool is_whole = true);
  /// Ends without a result. The keyframes so far stay in `path`.
  /// @return what stays where, to add to an error; may be empty.
  std::string abandon();

  /// The places of a result.
  struct Places {
    Places(const std::filesystem::path& out, OutputKind kind);
    /// Returns the places within OUT.
    static Places within(const std::filesystem::path& target);

    std::filesystem::path target;  ///< OUT without links.
    bool in_place = false;         ///< The others lie within the target.
    std::filesystem::path partial, left, earlier;
    std::filesystem::path moving;  ///< In place: a part of the earlier result.

   private:
    Places() = default;
    void setNames(const std::string& base);
  };

 private:
  /// The locked file run.lock. A thread touches it.
  class Lock {
   public:
    Lock() = default;
    ~Lock() { release(); }
    Lock(const Lock&) = delete;
    Lock& operator=(const Lock&) = delete;

    /// @param path its first word is `kind`. @return false if another run has it.
    bool take(const std::filesystem::path& path, const std::string& kind);
    void release();

   private:
    int file_ = -1;
    std::string kind_;
    std::mutex mutex_;
    std::condition_variable ends_;
    bool ending_ = false;
    std::thread thread_;
  };

  void lock();
  void setAside();
  void takeStored(const std::filesystem::path& from);
  void replace(bool is_whole);
  bool exchange();

  std::filesystem::path out_;
  OutputKind kind_;
  Places places_;
  std::filesystem::path left_;
  Lock lock_;
  bool stays_ = false;
  bool replaces_ = false;  ///< `commit` was called.
};

/// Returns the name of this machine.
std::string hostName();

/// Replaces status.json in the folder OUT of a result; the folder need not exist.
void writeStatus(const std::filesystem::path& out, const std::string& json);

/// Makes a folder and those above it. @throws std::runtime_error naming the folder.
void makeFolder(const std::filesystem::path& folder);

/// Returns the number of keyframes in the files of a run.
std::uint64_t countKeyframes(const std::filesystem::path& folder);

}  // namespace efm
