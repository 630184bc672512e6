// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session_file/session_file.h"

#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zstd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <stdexcept>
#include <utility>

#include "mapping/base/atomic_file.h"
#include "plugin/session_file/keyframe_record.h"

namespace efm {
namespace {

constexpr int kVersion = 1;
/// Channels, numbered as in `topics`.
enum Channel { kRun = 1, kKeyframe, kPoses, kReport, kPoints, kPose, kTransform };

std::vector<McapTopic> topics() {
  return {{"std_msgs/msg/String", ros_schema::kString, "/efm/run"},
          {"event_fusion_msgs/msg/Keyframe", keyframeSchema(), "/efm/keyframe"},
          {"nav_msgs/msg/Path", ros_schema::kPath, "/efm/poses"},
          {"std_msgs/msg/String", ros_schema::kString, "/efm/report"},
          {"sensor_msgs/msg/PointCloud2", ros_schema::kPointCloud2, "/efm/points"},
          {"geometry_msgs/msg/PoseStamped", ros_schema::kPoseStamped, "/efm/pose"},
          {"tf2_msgs/msg/TFMessage", ros_schema::kTransforms, "/tf"}};
}

std::runtime_error fileError(const std::filesystem::path& path, const char* doing, int error) {
  const std::string why = reasonNotWritten(error);
  return std::runtime_error(fmt::format("cannot {} {}: {}", doing, path.string(),
                                        why.empty() ? std::strerror(error) : why));
}

/// Returns the number of a channel in the order of `topics`; 0 for an unknown topic.
int channelOf(std::string_view topic) {
  const std::vector<McapTopic> all = topics();
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (all[i].topic == topic) return static_cast<int>(i + 1);
  }
  return 0;
}

}  // namespace

FileHandle::FileHandle(std::filesystem::path path, int flags)
    : path_(std::move(path)), file_(::open(path_.c_str(), flags | O_CLOEXEC, 0666)) {
  if (file_ < 0) throw fileError(path_, (flags & O_RDWR) != 0 ? "write" : "read", errno);
}

FileHandle::~FileHandle() { ::close(file_); }

void FileHandle::lock() {
  if (::flock(file_, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) return;
  throw std::runtime_error("cannot write " + path_.string() + ": another program writes it");
}

std::uint64_t FileHandle::size() const {
  struct stat status {};
  if (::fstat(file_, &status) != 0) throw fileError(path_, "read", errno);
  return static_cast<std::uint64_t>(status.st_size);
}

std::string FileHandle::read(std::uint64_t position, std::uint64_t size) const {
  const std::uint64_t end = this->size();
  std::string bytes(position < end ? std::min(size, end - position) : 0, '\0');
  std::size_t done = 0;
  while (done < bytes.size()) {
    const auto count = ::pread(file_, bytes.data() + done, bytes.size() - done,
                               static_cast<off_t>(position + done));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) throw fileError(path_, "read", errno);
    if (count == 0) break;
    done += static_cast<std::size_t>(count);
  }
  bytes.resize(done);
  return bytes;
}

void FileHandle::append(std::uint64_t position, const std::string& bytes) {
  const auto cut = [&] { return ::ftruncate(file_, static_cast<off_t>(position)); };
  if (size() != position && cut() != 0) throw fileError(path_, "write", errno);
  std::size_t done = 0;
  while (done < bytes.size()) {
    const auto count = ::pwrite(file_, bytes.data() + done, bytes.size() - done,
                                static_cast<off_t>(position + done));
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) {
      const int error = count < 0 ? errno : ENOSPC;
      if (cut() != 0) errno = 0;  // a torn end is found by the next reader
      throw fileError(path_, "write", error);
    }
    done += static_cast<std::size_t>(count);
  }
  if (::fdatasync(file_) != 0 && errno != EINVAL && errno != EROFS) {
    const int error = errno;
    if (cut() != 0) errno = 0;
    throw fileError(path_, "write", error);
  }
}

SessionFile::SessionFile(const std::filesystem::path& path) : file_(path, O_RDONLY) {
  const std::string magic = file_.read(0, kMcapMagic.size());
  if (magic.size() < kMcapMagic.size() && kMcapMagic.substr(0, magic.size()) == magic) {
    damage_ = fmt::format("byte {}: the file is cut off", magic.size());
    return;
  }
  if (magic != kMcapMagic) {
    throw std::runtime_error(path.string() +
                             ": no session file: expected the magic word of MCAP at its begin");
  }
  try {
    if (!readIndex()) scan();
    if (!run_chunk_) {
      if (damage_.empty()) throw std::runtime_error("no session file: expected the topic /efm/run");
      return;
    }
    run_ = nlohmann::ordered_json::parse(messageText(messageIn(chunkAt(*run_chunk_), kRun)),
                                         nullptr, false);
    if (!run_.is_object() || !run_.contains("session") || !run_.contains("options")) {
      throw std::runtime_error("/efm/run: expected JSON with the keys \"session\" and \"options\"");
    }
    if (run_["session"] != kVersion) {
      throw std::runtime_error(
          fmt::format("a session of version {}: expected version {} (a newer event-fusion wrote "
                      "it, and reads it)",
                      run_["session"].dump(), kVersion));
    }
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(path.string() + ": " + error.what());
  }
}

bool SessionFile::is(const std::filesystem::path& path) {
  constexpr std::uint64_t kBegin = 1 << 16;  // the channels come first
  try {
    const std::string begin = FileHandle(path, O_RDONLY).read(0, kBegin);
    return begin.compare(0, kMcapMagic.size(), kMcapMagic) == 0 &&
           begin.find(topics()[kKeyframe - 1].topic) != std::string::npos;
  } catch (const std::runtime_error&) {  // it cannot be read
    return false;
  }
}

std::optional<std::pair<McapOp, std::uint64_t>> SessionFile::headAt(std::uint64_t position) const {
  const std::string head = file_.read(position, kMcapRecordHead);
  if (head.size() < kMcapRecordHead) return std::nullopt;
  ByteReader bytes = readerOf(head);
  const auto op = static_cast<McapOp>(bytes.number<std::uint8_t>());
  const auto size = bytes.number<std::uint64_t>();
  if (op == McapOp() || size > file_.size() - position - kMcapRecordHead) return std::nullopt;
  return std::pair(op, kMcapRecordHead + size);
}

/// Reads the index at the end of the file. @return false if there is none.
bool SessionFile::readIndex() {
  const std::uint64_t tail = kMcapRecordHead + kMcapFooterContent + kMcapMagic.size();
  const std::uint64_t size = file_.size();
  if (size < kMcapMagic.size() + tail) return false;
  const std::string bytes = file_.read(size - tail, tail);
  ByteReader end = readerOf(bytes);
  const auto op = static_cast<McapOp>(end.number<std::uint8_t>());
  end.number<std::uint64_t>();
  const auto footer = takeMcapFields<McapFooter>(end);
  const bool is_whole = op == McapOp::kFooter && end.text(kMcapMagic.size()) == kMcapMagic;
  if (!is_whole || footer.summary == 0 || footer.summary > size - tail) return false;
  const std::string summary = file_.read(footer.summary, size - kMcapMagic.size() - footer.summary);
  const std::size_t summed = summary.size() - sizeof(footer.checksum);
  if (mcapChecksum(std::string_view(summary).substr(0, summed)) != footer.checksum) return false;
  ByteReader records = readerOf(summary);
  while (records.remaining() > 0) {
    McapRecord record = takeMcapRecord(records);
    noteChannel(record);
    if (record.op != McapOp::kChunkIndex) continue;
    const auto chunk = takeMcapFields<McapChunkIndex>(record.content);
    ByteReader indexes = readerOf(chunk.message_indexes);
    while (indexes.remaining() > 0) {
      note(channels_[indexes.number<std::uint16_t>()], chunk.chunk);
      indexes.number<std::uint64_t>();
    }
  }
  return true;
}

/// Finds the chunks without the index, until the first byte that is not whole.
void SessionFile::scan() {
  const std::uint64_t size = file_.size();
  std::uint64_t position = kMcapMagic.size();
  try {
    while (position < size) {
      const auto head = headAt(position);
      if (!head) throw std::runtime_error(fmt::format("byte {}: the file is cut off", position));
      if (head->first == McapOp::kDataEnd) return;
      const std::string bytes = head->first == McapOp::kChunk ? chunkAt(position).records
                                                              : file_.read(position, head->second);
      ByteReader records = readerOf(bytes);
      while (records.remaining() > 0) {
        McapRecord record = takeMcapRecord(records);
        noteChannel(record);
        if (record.op != McapOp::kMessage) continue;
        note(channels_[takeMcapFields<McapMessage>(record.content).channel], position);
      }
      position += head->second;
    }
    damage_ = fmt::format("byte {}: the run did not end", size);
  } catch (const std::runtime_error& error) {
    damage_ = error.what();
  }
}

void SessionFile::noteChannel(McapRecord& record) {
  if (record.op != McapOp::kChannel) return;
  const auto channel = takeMcapFields<McapChannel>(record.content);
  channels_[channel.id] = channelOf(channel.topic);
}

/// Notes a message of a chunk.
void SessionFile::note(int channel, std::uint64_t chunk) {
  if (channel == kRun) run_chunk_ = chunk;
  if (channel == kKeyframe) keyframes_.push_back(chunk);
  if (channel == kPoses) poses_.push_back(chunk);
  if (channel == kReport) report_ = chunk;
}

SessionFile::Chunk SessionFile::chunkAt(std::uint64_t position) const {
  Chunk chunk;
  chunk.position = position;
  try {
    const auto head = headAt(position);
    if (!head || head->first != McapOp::kChunk) throw std::runtime_error("expected a chunk");
    chunk.record_size = head->second;
    const std::string bytes = file_.read(position, head->second);
    ByteReader reader = readerOf(bytes);
    ByteReader content = takeMcapRecord(reader).content;
    chunk.fields = takeMcapFields<McapChunk>(content);
    chunk.fields.compression = "zstd";  // its text is in `bytes`
    constexpr std::uint64_t kMaxBytes = std::uint64_t{1} << 32;
    const std::string_view packed = content.text(chunk.fields.packed_size);
    if (chunk.fields.size > kMaxBytes ||
        ZSTD_getFrameContentSize(packed.data(), packed.size()) != chunk.fields.size) {
      throw std::runtime_error("a damaged chunk: its size does not fit");
    }
    chunk.records.resize(chunk.fields.size);
    const std::size_t size =
        ZSTD_decompress(chunk.records.data(), chunk.records.size(), packed.data(), packed.size());
    if (size != chunk.records.size() || mcapChecksum(chunk.records) != chunk.fields.checksum) {
      throw std::runtime_error("a damaged chunk: its checksum does not fit");
    }
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(fmt::format("byte {}: {}", position, error.what()));
  }
  return chunk;
}

std::string SessionFile::messageIn(const Chunk& chunk, int channel) const {
  ByteReader records = readerOf(chunk.records);
  while (records.remaining() > 0) {
    McapRecord record = takeMcapRecord(records);
    if (record.op != McapOp::kMessage) continue;
    const auto message = takeMcapFields<McapMessage>(record.content);
    const auto known = channels_.find(message.channel);
    if (known != channels_.end() && known->second == channel) {
      return std::string(record.content.text(record.content.remaining()));
    }
  }
  throw std::runtime_error("a chunk without the expected message");
}

KeyframeDepthMap SessionFile::keyframe(std::size_t number) const {
  if (number >= keyframes()) {
    throw std::runtime_error(
        fmt::format("{}: keyframe {}: it has {}", path().string(), number, keyframes()));
  }
  const std::uint64_t position = keyframes_[number];
  try {
    return keyframeOf(messageIn(chunkAt(position), kKeyframe));
  } catch (const std::exception& error) {
    throw std::runtime_error(fmt::format("{}: keyframe {} at byte {}: {}", path().string(), number,
                                         position, error.what()));
  }
}

std::vector<StampedPose> SessionFile::poses(bool refined) const {
  std::vector<StampedPose> poses;
  for (std::size_t i = 0; i < keyframes(); ++i) {
    const KeyframePoses of = posesIn(messageIn(chunkAt(keyframes_[i]), kKeyframe));
    poses.push_back({of.t_ref_ns, refined ? of.T_world_ref : of.T_odom_ref});
  }
  if (!refined || poses_.empty()) return poses;
  const std::vector<Rigid3> newest = pathOf(messageIn(chunkAt(poses_.back()), kPoses));
  if (newest.size() != poses.size()) {
    throw std::runtime_error(
        fmt::format("{}: byte {}: {} poses: expected one for each of the {} "
                    "keyframes",
                    path().string(), poses_.back(), newest.size(), poses.size()));
  }
  for (std::size_t i = 0; i < poses.size(); ++i) poses[i].T_world_rig = newest[i];
  return poses;
}

std::string SessionFile::report() const {
  return report_ ? messageText(messageIn(chunkAt(*report_), kReport)) : std::string();
}

bool SessionFile::isComplete() const {
  const auto report = nlohmann::json::parse(this->report(), nullptr, false);
  return report.is_object() && !report.contains("stopped_at") && !report.contains("error");
}

SessionWriter::SessionWriter(const std::filesystem::path& path, int flags)
    : file_(path, O_RDWR | flags),
      mcap_(topics(), [this](std::uint64_t position, const std::string& bytes) {
        file_.append(position, bytes);
      }) {
  file_.lock();
}

SessionWriter::SessionWriter(const std::filesystem::path& path, const nlohmann::ordered_json& run)
    : SessionWriter(path, O_CREAT) {  // the first bytes cut the file
  using Json = nlohmann::ordered_json;
  mcap_.begin();
  Json versioned = {{"session", kVersion}};
  versioned.update(run);
  mcap_.add(kRun, 0, textMessage(versioned.dump(-1, ' ', false, Json::error_handler_t::replace)));
  mcap_.finishChunk();
}

SessionWriter::SessionWriter(const SessionFile& earlier, std::size_t keyframes)
    : SessionWriter(earlier.path(), 0) {
  if (keyframes > earlier.keyframes()) {
    throw std::runtime_error(fmt::format("{}: {} keyframes: expected {}", earlier.path().string(),
                                         earlier.keyframes(), keyframes));
  }
  std::vector<std::uint64_t> chunks = {earlier.run_chunk_.value()};
  chunks.insert(chunks.end(), earlier.keyframes_.begin(),
                earlier.keyframes_.begin() + static_cast<std::ptrdiff_t>(keyframes));
  take(earlier, chunks);
}

/// Goes on behind some chunks of a file. What follows them is cut.
void SessionWriter::take(const SessionFile& file, const std::vector<std::uint64_t>& chunks) {
  mcap_.takeBegin();
  std::string index;
  for (const std::uint64_t position : chunks) {
    const SessionFile::Chunk chunk = file.chunkAt(position);
    if (position != mcap_.position()) {
      throw std::runtime_error(
          fmt::format("{}: byte {}: another version wrote it: expected a chunk at byte {}",
                      file.path().string(), position, mcap_.position()));
    }
    index = mcap_.takeChunk(chunk.fields, chunk.record_size, chunk.records);
  }
  file_.append(mcap_.position() - index.size(), index);  // the index of the last chunk may be torn
}

void SessionWriter::addGeneration(const std::filesystem::path& path,
                                  const std::vector<StampedPose>& T_world_ref) {
  SessionWriter writer(path, 0);
  const SessionFile file(path);
  if (T_world_ref.size() != file.keyframes()) {
    throw std::runtime_error(fmt::format("{}: {} poses: expected one for each of its {} keyframes",
                                         path.string(), T_world_ref.size(), file.keyframes()));
  }
  std::vector<std::uint64_t> chunks = {file.run_chunk_.value()};
  for (const auto* more : {&file.keyframes_, &file.poses_}) {
    chunks.insert(chunks.end(), more->begin(), more->end());
  }
  if (file.report_) chunks.push_back(*file.report_);
  std::sort(chunks.begin(), chunks.end());
  writer.take(file, chunks);
  writer.addPoses(T_world_ref);
  writer.mcap_.end();
}

void SessionWriter::add(const KeyframeDepthMap& keyframe) {
  const auto begin = std::chrono::steady_clock::now();
  const StampedPose pose{keyframe.window.t_ref_ns, keyframe.T_world_ref};
  const std::uint64_t t_ns = logTime(pose.t_ns);
  mcap_.add(kKeyframe, t_ns, keyframeMessage(keyframe));
  mcap_.add(kPoints, t_ns, pointsMessage(keyframe));
  mcap_.add(kPose, t_ns, poseMessage(pose));
  mcap_.add(kTransform, t_ns, transformMessage(pose));
  mcap_.finishChunk();
  seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

void SessionWriter::addPoses(const std::vector<StampedPose>& T_world_ref) {
  const std::uint64_t t_ns = T_world_ref.empty() ? 0 : logTime(T_world_ref.back().t_ns);
  mcap_.add(kPoses, t_ns, pathMessage(T_world_ref));
  mcap_.finishChunk();
}

void SessionWriter::finish(const std::string& report_json) {
  mcap_.add(kReport, 0, textMessage(report_json));
  mcap_.end();
}

}  // namespace efm
