// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/results/output/result_folder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <climits>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <utility>

#include "mapping/base/atomic_file.h"
#include "mapping/geometry/timestamp.h"

namespace efm {
namespace {

namespace fs = std::filesystem;

constexpr const char* kReport = "report.json";
constexpr const char* kKeyframesFolder = "keyframes";
constexpr const char* kLock = "run.lock";
constexpr const char* kStatus = "status.json";  // of a shard or a join
constexpr const char* kNewStatus = "status.json.new";
constexpr const char* kSession = "session.mcap";
constexpr std::array<std::string_view, 9> kMapFiles = {
    "map.html",      "map.pcd",      "map.png",        "map.ply",
    "map.simplemap", "overview.png", "trajectory.txt", "trajectory_tracker.txt",
    kSession};
constexpr std::array<std::string_view, 2> kDepthFiles = {"points.pcd", "dsi.npy"};
/// The images of one depth map.
constexpr std::array<std::string_view, 5> kImages = {
    "depth.tiff", "confidence.tiff", "probability.tiff", "depth.png", "confidence.png"};
constexpr std::string_view kEventImage = "events.png";

template <typename Names>
bool isIn(const Names& names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

bool isCameraFolder(const std::string& name) {
  return name.size() > 3 && name.rfind("cam", 0) == 0 &&
         name.find_first_not_of("0123456789", 3) == std::string::npos;
}

bool isKeyframeFolder(const std::string& name) {
  const std::optional<std::int64_t> t_ns = parseSeconds(name);
  return t_ns && formatSeconds(*t_ns) == name;
}

/// The kinds of results whose files are meant.
struct Kinds {
  bool map = true;
  bool depth = true;
};

Kinds kindsOf(OutputKind kind) { return {kind == OutputKind::kMap, kind == OutputKind::kDepth}; }

/// The folders of a result, by what they may hold.
enum class Level { kResult, kKeyframes, kKeyframe, kCamera };

bool isFileOf(Level level, const std::string& name, Kinds kinds) {
  switch (level) {
    case Level::kResult:
      return (kinds.map && isIn(kMapFiles, name)) ||
             (kinds.depth && (isIn(kDepthFiles, name) || isIn(kImages, name))) || name == kReport ||
             name == kLock || name == kStatus || name == kNewStatus;
    case Level::kKeyframes:
      return false;
    case Level::kKeyframe:
      return isIn(kImages, name);
    case Level::kCamera:
      return isIn(kImages, name) || name == kEventImage;
  }
  return false;
}

std::optional<Level> folderOf(Level level, const std::string& name, Kinds kinds) {
  if (level == Level::kResult && kinds.map && name == kKeyframesFolder) return Level::kKeyframes;
  if (level == Level::kKeyframes && isKeyframeFolder(name)) return Level::kKeyframe;
  const bool has_cameras = level == Level::kKeyframe || (level == Level::kResult && kinds.depth);
  if (has_cameras && isCameraFolder(name)) return Level::kCamera;
  return std::nullopt;
}

/// What belongs to a result below a folder: paths relative to it.
struct ResultFiles {
  std::vector<fs::path> files;    // the report last
  std::vector<fs::path> folders;  // those within others first
  std::vector<fs::path> others;   // what does not belong to it
};

void collect(const fs::path& folder, const fs::path& below, Level level, Kinds kinds,
             ResultFiles& found) {
  for (const auto& entry : fs::directory_iterator(folder / below)) {
    const std::string name = entry.path().filename().string();
    const fs::file_status status = entry.symlink_status();
    if (fs::is_regular_file(status) && isFileOf(level, name, kinds)) {
      found.files.push_back(below / name);
    } else if (const auto inner = folderOf(level, name, kinds); inner && fs::is_directory(status)) {
      collect(folder, below / name, *inner, kinds, found);
      found.folders.push_back(below / name);
    } else {
      found.others.push_back(below / name);
    }
  }
}

ResultFiles filesIn(const fs::path& folder, Kinds kinds = {}) {
  ResultFiles found;
  if (!fs::is_directory(folder)) return found;
  collect(folder, {}, Level::kResult, kinds, found);
  std::stable_partition(found.files.begin(), found.files.end(),
                        [](const fs::path& file) { return file != kReport; });
  return found;
}

/// Returns the kinds whose files a new result replaces: without an earlier result its own alone.
Kinds replacedIn(const fs::path& target, OutputKind kind) {
  if (ResultFolder::earlierResult(target)) return {};
  return kindsOf(kind);
}

/// Removes the empty ones among the folders of a result.
void removeEmpty(const fs::path& folder, const ResultFiles& of) {
  for (const fs::path& inner : of.folders) ::rmdir((folder / inner).c_str());
}

/// Marks a folder as one that a run has made: other folders of such a name are not touched.
void mark(const fs::path& folder) {
  fs::create_directories(folder);
  std::ofstream(folder / kLock, std::ios::app);
}

/// Moves the files of a result. A folder with a report is whole: the report is the last one, or the
/// first one if the result is moved away.
void moveResult(const fs::path& from, const fs::path& to, Kinds kinds = {}, bool away = false) {
  ResultFiles found = filesIn(from, kinds);
  if (away) std::reverse(found.files.begin(), found.files.end());
  mark(to);
  for (const fs::path& file : found.files) {
    if (file == kLock) continue;
    if (file == kReport && !away) {  // the others are on the disk before it
      for (const fs::path& folder : found.folders) syncToDisk(to / folder);
      syncToDisk(to);
    }
    fs::create_directories((to / file).parent_path());
    fs::rename(from / file, to / file);
  }
  removeEmpty(from, found);
  syncToDisk(to);
}

/// Removes the files of a result, the report first and the mark last, and the folder if it is empty
/// then.
void removeResult(const fs::path& folder) {
  ResultFiles found = filesIn(folder);
  std::reverse(found.files.begin(), found.files.end());
  for (const fs::path& file : found.files) {
    if (file != kLock) ::unlink((folder / file).c_str());
  }
  removeEmpty(folder, found);
  ::unlink((folder / kLock).c_str());
  ::rmdir(folder.c_str());
}

/// Moves what does not belong to a result, and is not there yet.
void moveOthers(const fs::path& from, const fs::path& to) {
  for (const fs::path& other : filesIn(from).others) {
    std::error_code ignored;  // it stays where it is
    if (fs::exists(fs::symlink_status(to / other, ignored))) continue;
    fs::create_directories((to / other).parent_path(), ignored);
    fs::rename(from / other, to / other, ignored);
  }
}

bool hasReport(const fs::path& folder) { return fs::exists(folder / kReport); }

/// Returns the kind of the run that wrote a folder.
Kinds kindsOf(const fs::path& partial) {
  std::string name;
  std::ifstream(partial / kLock) >> name;
  return kindsOf(name == "depth" ? OutputKind::kDepth : OutputKind::kMap);
}

/// Gives an earlier result its place back, if a run ended while it replaced the result.
void recover(const ResultFolder::Places& places) {
  const fs::path other = places.left.string() + ".other";  // see takeStored
  if (fs::exists(other) && !fs::exists(places.left)) fs::rename(other, places.left);
  if (fs::exists(places.moving)) {  // the run was moving the earlier result away
    moveResult(places.moving, places.target);
    removeResult(places.moving);
  } else if (!places.in_place && fs::exists(places.earlier) && !fs::exists(places.target)) {
    fs::rename(places.earlier, places.target);
  } else if (fs::exists(places.earlier)) {
    if (places.in_place && !hasReport(places.target)) {  // the run was moving its own result here
      moveResult(places.target, places.partial, kindsOf(places.partial));
      moveResult(places.earlier, places.target);
    }
    removeResult(places.earlier);
  }
  if (hasReport(places.target)) ::unlink((places.target / kLock).c_str());
}

/// Rejects folders and files of others that have the names of a run's folders.
void rejectForeign(const ResultFolder::Places& places) {
  for (const fs::path& path : {places.partial, places.left, places.earlier, places.moving}) {
    const fs::file_status status = fs::symlink_status(path);
    if (!fs::exists(status) || (path == places.moving && !places.in_place)) continue;
    if (fs::is_directory(status) && (fs::exists(path / kLock) || fs::is_empty(path))) continue;
    throw std::runtime_error(path.string() + ": a run for " + places.target.string() +
                             " needs this name: expected no such folder or file (rename it)");
  }
}

/// Returns a lock of the whole file. The lock belongs to the open file, not to the process, so it
/// also excludes another run in the same process.
flock wholeFile() {
  flock lock{};
  lock.l_type = F_WRLCK;
  lock.l_whence = SEEK_SET;
  return lock;
}

/// Rejects what has the name of a result's file, but is none.
void rejectInTheWay(const fs::path& target, Kinds kinds) {
  for (const auto& entry : fs::directory_iterator(target)) {
    const std::string name = entry.path().filename().string();
    const fs::file_status status = entry.symlink_status();
    const bool is_file = isFileOf(Level::kResult, name, kinds);
    if (is_file ? fs::is_regular_file(status)
                : !folderOf(Level::kResult, name, kinds) || fs::is_directory(status)) {
      continue;
    }
    throw std::runtime_error(entry.path().string() + ": has the name of a " +
                             (is_file ? "file" : "folder") +
                             " of the result: expected another folder for the result");
  }
}

/// The run that is at work in a folder.
struct Worker {
  std::string name = "another run";  // "process 42 on HOST"
  bool is_locked = true;             // false: its file was touched in the last minute
};

/// Returns the age of a file in seconds, by the clock of its file system.
std::int64_t ageOf(const fs::path& file) {
  struct stat status {};
  if (::stat(file.c_str(), &status) != 0) return 0;
  std::int64_t now_s = ::time(nullptr);
  std::string probe = (file.parent_path() / "run.probe-XXXXXX").string();
  struct stat probed {};
  if (const int made = ::mkstemp(probe.data()); made >= 0) {
    if (::fstat(made, &probed) == 0) now_s = probed.st_mtim.tv_sec;
    ::close(made);
    ::unlink(probe.c_str());
  }
  return now_s - status.st_mtim.tv_sec;
}

std::optional<Worker> workerIn(const fs::path& partial) {
  constexpr std::int64_t kSilentS = 60;
  std::string kind, host;
  int process = 0;
  std::ifstream(partial / kLock) >> kind >> process >> host;
  const int file = ::open((partial / kLock).c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return std::nullopt;
  flock lock = wholeFile();
  const bool asked = ::fcntl(file, F_OFD_GETLK, &lock) == 0;
  ::close(file);
  Worker worker;
  worker.is_locked = asked && lock.l_type != F_UNLCK;
  if (!host.empty()) worker.name = fmt::format("process {} on {}", process, host);
  if (worker.is_locked) return worker;
  const bool is_here = host == hostName();
  const bool is_dead = is_here && (asked || (::kill(process, 0) != 0 && errno == ESRCH));
  if (host.empty() || is_dead || ageOf(partial / kLock) >= kSilentS) return std::nullopt;
  return worker;
}

std::runtime_error atWork(const fs::path& out, const fs::path& partial) {
  const Worker worker = workerIn(partial).value_or(Worker());
  return std::runtime_error(
      fmt::format("{}: {} is writing its result there ({}): expected another folder, or {}",
                  out.string(), worker.name, (partial / kLock).string(),
                  worker.is_locked ? "the end of that run" : "60 s without a sign of that run"));
}

/// Rejects a folder that another run is writing for, also if it writes in another place.
void rejectAtWork(const ResultFolder::Places& places, const fs::path& out) {
  const fs::path& target = places.target;
  for (const fs::path& partial : {places.partial, target, fs::path(target.string() + ".partial"),
                                  target / "result.partial"}) {
    if (workerIn(partial)) throw atWork(out, partial);
  }
}

std::runtime_error cannotMake(const fs::path& folder, const std::string& why) {
  return std::runtime_error("cannot make the folder " + folder.string() + ": " + why);
}

bool isMountPoint(const fs::path& folder) {
  struct statx status {};
  return ::statx(AT_FDCWD, folder.c_str(), 0, 0, &status) == 0 &&
         (status.stx_attributes & STATX_ATTR_MOUNT_ROOT) != 0;
}

/// Returns whether a folder can be renamed in its parent folder.
bool canBeRenamed(const fs::path& folder) {
  if (isMountPoint(folder) || folder == folder.root_path()) return false;
  if (::access(folder.parent_path().c_str(), W_OK | X_OK) != 0) return false;
  std::error_code ignored;
  const fs::path working = fs::current_path(ignored);  // it would go with the earlier result
  return std::mismatch(folder.begin(), folder.end(), working.begin(), working.end()).first !=
         folder.end();
}

}  // namespace

std::string hostName() {
  std::array<char, HOST_NAME_MAX + 1> name{};
  ::gethostname(name.data(), HOST_NAME_MAX);
  return name.data();
}

void writeStatus(const fs::path& out, const std::string& json) {
  fs::create_directories(out);
  // Not on the disk at once: after a crash of the machine, it says nothing that matters.
  std::ofstream(out / kNewStatus) << json << '\n';
  fs::rename(out / kNewStatus, out / kStatus);
}

void makeFolder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (fs::is_directory(folder)) return;
  throw cannotMake(folder, error ? error.message() : "a file of that name is there");
}

bool EarlierResult::isOf(const std::vector<std::string>& files) const {
  const auto text = [](const std::vector<std::string>& names) {
    return nlohmann::json(names).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  };
  return text(recording) == text(files);
}

ResultFolder::Places::Places(const fs::path& out, OutputKind kind) {
  if (out.empty()) throw std::runtime_error("'': expected the name of the folder to write");
  const fs::path named = out.has_filename() ? out : out.parent_path();  // without a slash
  target = fs::absolute(named);
  if (fs::is_symlink(named) && !fs::exists(named)) {
    target = target.parent_path() / fs::read_symlink(named);
    if (!fs::exists(target.string() + ".earlier")) {
      throw cannotMake(out, "it is a link to a folder that does not exist");
    }
  }
  target = fs::weakly_canonical(target);
  if (!target.has_filename()) target = target.parent_path();
  if (fs::exists(target) && !fs::is_directory(target)) {
    throw cannotMake(out, "a file of that name is there");
  }
  const Places inner = within(target);
  const bool is_long = target.filename().native().size() + std::strlen(".partial") > NAME_MAX;
  if (is_long || (fs::exists(target) &&
                  (!canBeRenamed(target) || fs::exists(inner.earlier) || fs::exists(inner.moving) ||
                   !filesIn(target, replacedIn(target, kind)).others.empty()))) {
    *this = inner;
  } else {
    setNames(target.string());
  }
}

void ResultFolder::Places::setNames(const std::string& base) {
  partial = base + ".partial";
  left = base + ".left";
  earlier = base + ".earlier";
  moving = base + ".moving";
}

ResultFolder::Places ResultFolder::Places::within(const fs::path& target) {
  Places inner;
  inner.target = target;
  inner.in_place = true;
  inner.setNames((target / "result").string());
  return inner;
}

std::optional<EarlierResult> ResultFolder::earlierResult(const fs::path& out) {
  const fs::path file = out / kReport;
  if (!fs::is_regular_file(file)) return std::nullopt;
  std::ifstream stream(file);
  const auto report = nlohmann::json::parse(stream, nullptr, false);
  if (!report.is_object() || !report.contains("version") || !report.contains("options") ||
      !report.contains("keyframes")) {
    return std::nullopt;
  }
  try {
    return EarlierResult{report.value("recording", std::vector<std::string>()),
                         report["keyframes"].get<std::uint64_t>()};
  } catch (const nlohmann::json::exception&) {
    return std::nullopt;
  }
}

bool ResultFolder::hasPartial(const fs::path& out) {
  if (out.empty() || (fs::exists(fs::symlink_status(out)) && !fs::is_directory(out))) return false;
  return fs::exists(out / kLock) || fs::exists(Places(out, OutputKind::kMap).partial / kLock);
}

void ResultFolder::require(const fs::path& out, OutputKind kind, bool force) {
  const Places places(out, kind);
  rejectAtWork(places, out);
  rejectForeign(places);
  recover(places);
  if (!fs::exists(places.target)) return;
  if (::access(places.target.c_str(), W_OK | X_OK) != 0) {
    throw std::runtime_error("cannot write into " + out.string() + ": " + std::strerror(errno));
  }
  rejectInTheWay(places.target, kindsOf(kind));
  if (force) return;
  const auto has = [&](std::string_view name) { return fs::exists(places.target / name); };
  const bool has_map =
      has(kKeyframesFolder) || std::any_of(kMapFiles.begin(), kMapFiles.end(), has);
  const bool has_depth = std::any_of(kDepthFiles.begin(), kDepthFiles.end(), has) ||
                         std::any_of(kImages.begin(), kImages.end(), has);
  if (!earlierResult(places.target)) {
    const auto is_left = [&](const fs::path& path) {
      return path == places.partial || path == places.left || path == places.target / kStatus ||
             path == places.target / kNewStatus;
    };
    const fs::directory_iterator entries(places.target);
    if (std::all_of(begin(entries), end(entries), is_left)) return;
    throw std::runtime_error(out.string() +
                             ": holds other files than a map's: expected a new folder, an empty "
                             "one, one of an earlier result, or --force");
  }
  const bool is_map = kind == OutputKind::kMap;
  if (is_map ? has_depth : has_map) {
    throw std::runtime_error(fmt::format(
        "{}: holds the result of `{}`: expected another folder, or --force to replace it",
        out.string(), is_map ? "depth" : "map"));
  }
}

std::vector<fs::path> ResultFolder::storedIn(const fs::path& out) {
  const Places places(out, OutputKind::kMap);
  return {places.target, places.partial, places.left};
}

ResultFolder::ResultFolder(fs::path out, OutputKind kind, const fs::path& resume)
    : out_(std::move(out)), kind_(kind), places_(out_, kind) {
  rejectAtWork(places_, out_);
  rejectForeign(places_);
  makeFolder(places_.partial);
  lock();
  recover(places_);
  if (resume.empty()) {
    setAside();
  } else if (resume != places_.partial) {
    takeStored(resume);
  }
  stays_ = !resume.empty();
  if (fs::exists(places_.left)) left_ = places_.left;
}

/// Renames the files of a killed run to OUT.left. Removes them if OUT.left has more keyframes.
void ResultFolder::setAside() {
  const std::uint64_t keyframes = countKeyframes(places_.partial);
  if (keyframes > 0 && keyframes >= countKeyframes(places_.left)) {
    removeResult(places_.left);
    if (fs::exists(places_.left)) {  // with files of others
      moveResult(places_.partial, places_.left);
    } else {
      fs::rename(places_.partial, places_.left);
      makeFolder(places_.partial);
      lock();
    }
  }
  const ResultFiles useless = filesIn(places_.partial);
  for (const fs::path& file : useless.files) {
    if (file != kLock) ::unlink((places_.partial / file).c_str());
  }
  removeEmpty(places_.partial, useless);
}

/// Makes the files of an earlier run those of this one. Those of OUT stay: its session is copied,
/// and its images have a second name.
void ResultFolder::takeStored(const fs::path& from) {
  if (from == places_.left) {
    const fs::path other = from.string() + ".other";
    if (countKeyframes(places_.partial) == 0) {
      removeResult(places_.partial);
      fs::rename(from, places_.partial);
    } else if (::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, places_.partial.c_str(),
                           RENAME_EXCHANGE) != 0) {  // the file system cannot exchange names
      fs::rename(places_.partial, other);
      fs::rename(from, places_.partial);
      fs::rename(other, from);
    }
    return lock();
  }
  setAside();
  fs::copy_file(from / kSession, places_.partial / kSession);
  for (const fs::path& file : filesIn(from, kindsOf(kind_)).files) {
    if (file.begin()->string() != kKeyframesFolder) continue;
    fs::create_directories((places_.partial / file).parent_path());
    std::error_code error;
    fs::create_hard_link(from / file, places_.partial / file, error);
    if (error) fs::copy_file(from / file, places_.partial / file);
  }
}

bool ResultFolder::Lock::take(const fs::path& path, const std::string& kind) {
  struct stat status {};
  do {  // again, if a run that ended meanwhile has removed the file
    release();
    file_ = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0666);
    if (file_ < 0) {
      const std::string why = reasonNotWritten(errno);
      throw std::runtime_error("cannot write " + path.string() + ": " +
                               (why.empty() ? std::strerror(errno) : why));
    }
    flock lock = wholeFile();
    if (::fcntl(file_, F_OFD_SETLK, &lock) != 0 && (errno == EAGAIN || errno == EACCES)) {
      return false;
    }  // on a file system without locks, the time of the file tells another run
  } while (::fstat(file_, &status) == 0 && status.st_nlink == 0);
  kind_ = kind;
  std::ofstream(path) << fmt::format("{} {} {}\n", kind, ::getpid(), hostName());
  ending_ = false;
  thread_ = std::thread([this] {
    constexpr std::chrono::seconds kPeriod(10);
    std::unique_lock<std::mutex> lock(mutex_);
    while (!ends_.wait_for(lock, kPeriod, [this] { return ending_; })) ::futimens(file_, nullptr);
  });
  return true;
}

void ResultFolder::Lock::release() {
  if (thread_.joinable()) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      ending_ = true;
    }
    ends_.notify_all();
    thread_.join();
    if (::ftruncate(file_, 0) != 0 ||
        ::pwrite(file_, kind_.data(), kind_.size(), 0) < 0) {  // no worker any more
      errno = 0;
    }
  }
  if (file_ >= 0) ::close(std::exchange(file_, -1));
}

/// Locks the folder. @throws std::runtime_error if another run has it.
void ResultFolder::lock() {
  if (!lock_.take(places_.partial / kLock, kind_ == OutputKind::kDepth ? "depth" : "map")) {
    throw atWork(out_, places_.partial);
  }
}

ResultFolder::~ResultFolder() {
  if (stays_) return;
  try {
    removeResult(places_.partial);
  } catch (const fs::filesystem_error&) {  // the files stay
  }
}

void ResultFolder::commit(bool is_whole) {
  try {
    replace(is_whole);
  } catch (const fs::filesystem_error& error) {
    throw std::runtime_error(fmt::format("cannot replace {}: {} ({}); the new result is in {}",
                                         out_.string(), error.code().message(),
                                         error.path1().string(), places_.partial.string()));
  }
}

void ResultFolder::replace(bool is_whole) {
  const auto& [target, in_place, partial, left, earlier, moving] = places_;
  stays_ = replaces_ = true;
  const ResultFiles found = filesIn(partial);
  for (const fs::path& file : found.files) {
    // A file with a second name is that of an earlier result, or of a shard: it is on the disk.
    if (fs::hard_link_count(partial / file) == 1) syncToDisk(partial / file);
  }
  for (const fs::path& folder : found.folders) syncToDisk(partial / folder);
  syncToDisk(partial);
  Places used = places_;
  try {
    if (!in_place && !fs::exists(target)) {
      fs::rename(partial, target);
    } else if (in_place || !exchange()) {
      used = Places::within(target);  // also if the folder cannot be renamed
      used.partial = partial;
      moveResult(target, used.moving, replacedIn(target, kind_), true);
      fs::rename(used.moving, used.earlier);
      moveResult(partial, target);
      removeResult(partial);
    }
  } catch (...) {
    recover(used);
    throw;
  }
  ::unlink((target / kLock).c_str());
  syncToDisk(target.parent_path());
  moveOthers(used.earlier, target);  // they came meanwhile
  removeResult(used.earlier);
  if (is_whole) removeResult(left);
}

/// Exchanges the names of the new result and of the folder that is there. @return false if it
/// cannot be renamed.
bool ResultFolder::exchange() {
  const auto& [target, in_place, partial, left, earlier, moving] = places_;
  struct stat status {};
  if (::stat(target.c_str(), &status) == 0) {
    if (::chown(partial.c_str(), status.st_uid, status.st_gid) != 0) errno = 0;  // not allowed
    ::chmod(partial.c_str(), status.st_mode);
  }
  mark(target);
  if (::renameat2(AT_FDCWD, partial.c_str(), AT_FDCWD, target.c_str(), RENAME_EXCHANGE) == 0) {
    std::error_code error;
    fs::rename(partial, earlier, error);
    if (error) removeResult(partial);
    return true;
  }
  if (errno != EINVAL && errno != ENOSYS && errno != EOPNOTSUPP) return false;
  std::error_code error;  // the file system cannot exchange names
  fs::rename(target, earlier, error);
  if (error) return false;
  fs::rename(partial, target);
  return true;
}

std::string ResultFolder::abandon() {
  if (replaces_) return {};  // the error of `commit` says what is where
  const std::string earlier =
      hasEarlier() ? fmt::format("; the earlier result in {} stays", out_.string()) : "";
  try {
    const std::uint64_t keyframes = countKeyframes(places_.partial);
    const bool can_go_on = fs::exists(places_.partial / kSession);
    stays_ = keyframes > 0 && (can_go_on || earlier.empty());
    if (!stays_) return earlier;
    return earlier + fmt::format("; the keyframes before it ({}) are in {}{}", keyframes,
                                 places_.partial.string(),
                                 can_go_on ? ": run again with --resume to go on with them" : "");
  } catch (const fs::filesystem_error&) {  // the disk cannot be read
    return earlier;
  }
}

std::uint64_t countKeyframes(const fs::path& folder) {
  const ResultFiles found = filesIn(folder);
  return static_cast<std::uint64_t>(
      std::count_if(found.files.begin(), found.files.end(), [](const fs::path& file) {
        return file.filename() == "depth.tiff" && !isCameraFolder(file.parent_path().filename());
      }));
}

}  // namespace efm
