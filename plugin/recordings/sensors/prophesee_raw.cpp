// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/sensors/prophesee_raw.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <fstream>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include "mapping/base/text.h"
#include "plugin/recordings/sensors/evt_decoder.h"
#include "plugin/recordings/streams/time_unit.h"

namespace efm {
namespace {

/// The values in the lines "% key value" at the beginning of a RAW file.
struct RawHeader {
  /// "% evt 3.0" or "% format EVT3;…"; "% Data file …" of DAT.
  EvtEncoding encoding = EvtEncoding::kEvt3;
  /// Size in "% geometry 1280x720" or "% format …;height=720;…"; else the size of the camera that
  /// "% plugin_name" or "% system_ID" names, as in files of 2020.
  std::optional<CameraSize> size;
  std::uint64_t bytes = 0;  ///< Size of the header; the words follow.
};

constexpr std::size_t kRawBlockBytes = std::size_t{1} << 18U;  // whole words of every encoding
constexpr std::size_t kMaxRawHeaderBytes = std::size_t{1} << 16U;
/// The EVT 3.0 clock is at most two periods ahead of a TIME_HIGH, even if the next one is late.
constexpr std::int64_t kMaxAheadNs = 2 * 4'096'000;

/// A camera that a value in the header names: by its beginning (a generation) or fully (a system).
struct KnownCamera {
  std::string_view key;
  std::string_view value;
  CameraSize size;
};
constexpr KnownCamera kKnownCameras[] = {
    {"plugin_name", "hal_plugin_gen3_", {640, 480}},
    {"plugin_name", "hal_plugin_gen31_", {640, 480}},
    {"plugin_name", "hal_plugin_gen4_", {1280, 720}},
    {"plugin_name", "hal_plugin_gen41_", {1280, 720}},
    {"system_ID", "21", {640, 480}},
    {"system_ID", "48", {1280, 720}},
};

std::optional<CameraSize> sizeOfCamera(std::string_view key, std::string_view value) {
  for (const KnownCamera& camera : kKnownCameras) {
    const bool generation = camera.value.back() == '_';
    if (key == camera.key &&
        (generation ? value.substr(0, camera.value.size()) : value) == camera.value) {
      return camera.size;
    }
  }
  return std::nullopt;
}

class RawHeaderParser {
 public:
  RawHeaderParser(const std::filesystem::path& file, std::string_view text)
      : file_(file), text_(text) {}

  RawHeader parse() {
    while (nextLine()) {
      const std::size_t blank = line_.find(' ');
      const std::string_view key = line_.substr(0, blank);
      const std::string_view value =
          blank == std::string_view::npos ? std::string_view() : trimmed(line_.substr(blank));
      if (key == "end") break;
      if (key == "evt") takeEncoding(key, value, "2.0, 2.1 or 3.0");
      if (key == "format") takeFormat(value);
      if (key == "geometry") takeGeometry(value);
      if (key == "endianness") takeOrder(value);
      if (key == "Data") encoding_ = EvtEncoding::kDat;
      const bool dat = encoding_ == EvtEncoding::kDat;
      if (dat && (key == "Width" || key == "Height")) takeSide(key, value);
      if (dat && key == "Version" && value != "2") throw fail(key, value, "2, of a DAT file");
      if (!camera_size_) camera_size_ = sizeOfCamera(key, value);
    }
    if (!header_.size && size_.width > 0 && size_.height > 0) header_.size = size_;
    if (!header_.size) header_.size = camera_size_;
    if (encoding_ == EvtEncoding::kDat) takeDatType();
    if (!encoding_) {
      throw std::runtime_error(
          fmt::format("{}: no encoding: expected a RAW file with a line '% evt 3.0', 2.0 or 2.1 in "
                      "its header, or a DAT file",
                      file_.string()));
    }
    header_.encoding =
        *encoding_ == EvtEncoding::kEvt21 && legacy_order_ ? EvtEncoding::kEvt21Legacy : *encoding_;
    return header_;
  }

 private:
  /// Takes the next line of the header: text after "% ". Event words with these bytes are no text.
  bool nextLine() {
    if (text_.substr(header_.bytes, 2) != "% ") return false;
    const std::size_t newline = text_.find('\n', header_.bytes);
    if (newline == std::string_view::npos) return false;
    line_ = trimmed(text_.substr(header_.bytes + 2, newline - header_.bytes - 2));
    const auto is_control = [](char c) { return static_cast<unsigned char>(c) < 32 && c != '\t'; };
    if (std::any_of(line_.begin(), line_.end(), is_control)) return false;
    header_.bytes = newline + 1;
    ++number_;
    return true;
  }

  /// Takes a value like "EVT3;height=720;width=1280".
  void takeFormat(std::string_view value) {
    const std::vector<std::string_view> parts = splitWords(value, ";");
    takeEncoding("format", parts.empty() ? value : parts.front(), "EVT2, EVT21 or EVT3");
    for (const std::string_view part : parts) {
      const std::size_t equal = part.find('=');
      if (equal == std::string_view::npos) continue;
      const std::string_view key = part.substr(0, equal);
      const std::string_view number = part.substr(equal + 1);
      if (key == "endianness") takeOrder(number);
      if (key == "width" || key == "height") takeSide(key, number);
    }
    if (size_.width > 0 && size_.height > 0) header_.size = size_;
  }

  void takeSide(std::string_view key, std::string_view number) {
    const int side = parseNumber<std::uint16_t>(number).value_or(0);
    if (side == 0) throw fail(key, number, "a number of pixels from 1 to 65535");
    (std::tolower(key.front()) == 'w' ? size_.width : size_.height) = side;
  }

  /// Takes the two bytes after the header of DAT: the type of the events (CD) and their size.
  void takeDatType() {
    const std::string_view type = text_.substr(header_.bytes, 2);
    header_.bytes += 2;
    if (type == "\x0c\x08" || type == std::string_view("\0\x08", 2)) return;
    throw std::runtime_error(
        fmt::format("{}: the bytes {} after the header: expected CD events (12 or 0) of 8 bytes",
                    file_.string(), inQuotes(type)));
  }

  void takeGeometry(std::string_view value) {
    header_.size = cameraSizeOf(value);
    if (!header_.size) throw fail("geometry", value, "WIDTHxHEIGHT in pixels");
  }

  void takeOrder(std::string_view value) {
    if (value != "little" && value != "legacy") {
      throw fail("endianness", value, "little or legacy");
    }
    legacy_order_ = value == "legacy";
  }

  void takeEncoding(std::string_view key, std::string_view value, const char* expected) {
    constexpr struct {
      std::string_view version;  // value of "evt"
      std::string_view format;
      EvtEncoding encoding;
    } kEncodings[] = {{"2.0", "EVT2", EvtEncoding::kEvt2},
                      {"2.1", "EVT21", EvtEncoding::kEvt21},
                      {"3.0", "EVT3", EvtEncoding::kEvt3}};
    for (const auto& [version, format, encoding] : kEncodings) {
      if (value != (key == "evt" ? version : format)) continue;
      encoding_ = encoding;
      return;
    }
    throw fail(key, value, expected);
  }

  std::runtime_error fail(std::string_view key, std::string_view value,
                          const char* expected) const {
    return std::runtime_error(fmt::format("{}:{}: {} = {}: expected {}", file_.string(), number_,
                                          key, inQuotes(value), expected));
  }

  const std::filesystem::path& file_;
  std::string_view text_;
  RawHeader header_;
  std::string_view line_;
  int number_ = 0;
  std::optional<EvtEncoding> encoding_;
  bool legacy_order_ = false;
  CameraSize size_;                        // sides that the header names one by one
  std::optional<CameraSize> camera_size_;  // size of a camera that the header names
};

std::ifstream openRaw(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream || !isFile(file)) {
    throw std::runtime_error(file.string() + ": cannot be opened for reading");
  }
  return stream;
}

/// The events of a RAW file of a Prophesee camera. Times are those of the sensor's clock, see
/// EvtDecoder.
class PropheseeRawStream : public EventStream {
 public:
  explicit PropheseeRawStream(std::filesystem::path file)
      : file_(std::move(file)),
        stream_(openRaw(file_)),
        bytes_total_(std::filesystem::file_size(file_)),
        header_(RawHeaderParser(file_, firstBytesOf(file_, kMaxRawHeaderBytes)).parse()),
        decoder_(header_.encoding),
        at_block_(decoder_),
        block_byte_(header_.bytes) {
    stream_.seekg(static_cast<std::streamoff>(header_.bytes));
  }

  bool decode(std::vector<Event>& events) override {
    events.clear();
    at_block_ = decoder_;
    if (readBlock()) {
      decoder_.decode(block_.data(), block_.size(), events);
      return true;
    }
    if (decoder_.incompleteBytes() > 0) {
      throw std::runtime_error(
          fmt::format("{}{} bytes of a word: expected all {}, but the file ends within it",
                      place(block_byte_ - decoder_.incompleteBytes()), decoder_.incompleteBytes(),
                      decoder_.wordBytes()));
    }
    if (!decoder_.hasTime() && decoder_.undatedEvents() > 0) {
      throw std::runtime_error(
          fmt::format("{}{} events without a time: expected words TIME_HIGH before them",
                      place(block_byte_), decoder_.undatedEvents()));
    }
    return false;
  }
  /// Reads only the TIME_HIGH words up to the time (some GB/s): in EVT 3.0, nothing else shows how
  /// often the clock wrapped.
  void seek(std::int64_t t_ns) override {
    if (header_.encoding == EvtEncoding::kDat) return;  // few enough bytes to read them all
    // `scan` reaches the time in the current block. Decoding starts one block earlier, to find the
    // other values of its events, for instance the row.
    EvtDecoder scan(header_.encoding);
    EvtDecoder at_last = scan;
    std::uint64_t last_byte = header_.bytes;
    std::uint64_t start_byte = header_.bytes;
    while (readBlock()) {
      decoder_ = std::exchange(at_last, scan);
      start_byte = std::exchange(last_byte, block_byte_);
      scan.scanTime(block_.data(), block_.size());
      if (scan.timeHighNs() + kMaxAheadNs >= t_ns) break;
    }
    from_beginning_ = false;
    stream_.clear();
    stream_.seekg(static_cast<std::streamoff>(start_byte));
    block_.clear();
    block_byte_ = start_byte;
  }
  std::string positionOf(std::size_t index) const override {
    // Many words at once, then the word.
    std::size_t at = 0;
    EvtDecoder at_word = at_block_;
    std::size_t events_before = 0;
    for (const std::size_t words : {std::size_t{4096}, std::size_t{1}}) {
      EvtDecoder decoder = at_word;
      std::vector<Event> events;
      while (at < block_.size()) {
        const std::size_t bytes = std::min(words * decoder.wordBytes(), block_.size() - at);
        decoder.decode(block_.data() + at, bytes, events);
        if (events_before + events.size() > index) break;
        events_before += events.size();
        events.clear();
        at_word = decoder;
        at += bytes;
      }
    }
    return fmt::format("{}: byte {}", file_.string(), block_byte_ + at);
  }
  std::string name() const override { return file_.string(); }
  double progress() const override {
    if (bytes_total_ == 0) return 0;
    return static_cast<double>(block_byte_ + block_.size()) / static_cast<double>(bytes_total_);
  }
  std::optional<CameraSize> size() const override { return header_.size; }
  /// The file has no gaps: only events at its beginning have no time.
  std::uint64_t undatedEvents() const override {
    return from_beginning_ ? decoder_.undatedEvents() : 0;
  }

 private:
  /// Reads the next block. @return false at the end.
  bool readBlock() {
    block_byte_ += block_.size();
    block_.resize(std::min<std::uint64_t>(kRawBlockBytes,
                                          bytes_total_ - std::min(block_byte_, bytes_total_)));
    stream_.read(reinterpret_cast<char*>(block_.data()),
                 static_cast<std::streamsize>(block_.size()));
    block_.resize(static_cast<std::size_t>(stream_.gcount()));
    if (stream_.bad()) throw std::runtime_error(file_.string() + ": cannot be read to its end");
    return !block_.empty();
  }
  std::string place(std::uint64_t byte) const {
    return fmt::format("{}: byte {}: ", file_.string(), byte);
  }

  std::filesystem::path file_;
  std::ifstream stream_;
  std::uint64_t bytes_total_ = 0;
  RawHeader header_;
  EvtDecoder decoder_;
  bool from_beginning_ = true;
  EvtDecoder at_block_;  // state of the decoder before the block
  std::vector<std::uint8_t> block_;
  std::uint64_t block_byte_ = 0;  // the position of the block in the file
};

}  // namespace

bool looksLikePropheseeRaw(const std::filesystem::path& file) {
  if (!isFile(file)) return false;
  const std::string text = firstBytesOf(file, kMaxRawHeaderBytes);
  const std::size_t lines_end = text.rfind('\n');
  const std::string_view lines = std::string_view(text).substr(0, lines_end);
  return lines.substr(0, 2) == "% " &&
         (lines.find("% evt ") != std::string_view::npos || lines.find("% Data file") == 0 ||
          lines.find("% format EVT") != std::string_view::npos);
}

RecordingParts openPropheseeRaw(const std::vector<std::filesystem::path>& files,
                                const ReaderOptions&) {
  RecordingParts parts;
  for (const std::filesystem::path& file : files) {
    parts.cameras.push_back(std::make_unique<PropheseeRawStream>(file));
  }
  return parts;
}

}  // namespace efm
