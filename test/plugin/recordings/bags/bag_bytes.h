// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sqlite3.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "test/plugin/recordings/sensors/evt_words.h"

namespace efm {

struct RecordedMessage {
  std::string topic;
  std::string type;  // e.g. "dvs_msgs/EventArray"
  std::int64_t log_ns;
  std::string data;
};
using RecordedMessages = std::vector<RecordedMessage>;

/// Returns the topics in the order of their first messages.
inline std::vector<std::pair<std::string, std::string>> topicsIn(const RecordedMessages& messages) {
  std::vector<std::pair<std::string, std::string>> topics;
  for (const RecordedMessage& message : messages) {
    const std::pair<std::string, std::string> topic = {message.topic, message.type};
    if (std::find(topics.begin(), topics.end(), topic) == topics.end()) topics.push_back(topic);
  }
  return topics;
}

inline std::uint32_t topicNumber(const RecordedMessages& messages, const RecordedMessage& message) {
  const auto topics = topicsIn(messages);
  const auto found =
      std::find(topics.begin(), topics.end(), std::make_pair(message.topic, message.type));
  return static_cast<std::uint32_t>(found - topics.begin());
}

inline std::string ros2TypeOf(std::string type) { return type.insert(type.find('/'), "/msg"); }

inline std::string sizedText(const std::string& text) {
  std::string bytes;
  putWord(bytes, static_cast<std::uint32_t>(text.size()));
  return bytes + text;
}

inline std::string mcapRecordOf(int op, const std::string& content) {
  std::string bytes(1, static_cast<char>(op));
  putWord(bytes, static_cast<std::uint64_t>(content.size()));
  return bytes + content;
}

/// Returns a file without chunks and without a summary, as a crashed writer leaves it.
inline std::string mcapBytes(const RecordedMessages& messages) {
  std::string file("\x89MCAP0\r\n", 8);
  file += mcapRecordOf(1, sizedText("ros2") + sizedText("test"));
  std::uint16_t id = 0;
  for (const auto& [topic, type] : topicsIn(messages)) {
    std::string number;
    putWord(number, ++id);
    file += mcapRecordOf(
        3, number + sizedText(ros2TypeOf(type)) + sizedText("ros2msg") + sizedText(""));
    file += mcapRecordOf(4, number + number + sizedText(topic) + sizedText("cdr") + sizedText(""));
  }
  for (const RecordedMessage& message : messages) {
    std::string head;
    putWord(head, static_cast<std::uint16_t>(topicNumber(messages, message) + 1));
    putWord(head, std::uint32_t{0});
    putWord(head, static_cast<std::uint64_t>(message.log_ns));
    putWord(head, static_cast<std::uint64_t>(message.log_ns));
    file += mcapRecordOf(5, head + message.data);
  }
  return file;
}

/// Returns a record: a header of fields, then data.
inline std::string ros1Record(const std::vector<std::pair<std::string, std::string>>& fields,
                              const std::string& data) {
  std::string header;
  for (const auto& [name, value] : fields) header += sizedText(name + "=" + value);
  return sizedText(header) + sizedText(data);
}

template <typename Word>
std::string wordBytes(Word word) {
  std::string bytes;
  putWord(bytes, word);
  return bytes;
}

inline std::string ros1Time(std::int64_t t_ns) {
  return wordBytes(static_cast<std::uint32_t>(t_ns / 1'000'000'000)) +
         wordBytes(static_cast<std::uint32_t>(t_ns % 1'000'000'000));
}

/// Returns a bag without compression: `per_chunk` messages per chunk, the first message alone.
inline std::string ros1BagBytes(const RecordedMessages& messages, std::size_t per_chunk = 1000) {
  const std::string magic = "#ROSBAG V2.0\n";
  const auto bag_header = [](std::uint64_t index) {
    std::string record = ros1Record({{"op", "\3"},
                                     {"index_pos", wordBytes(index)},
                                     {"conn_count", wordBytes(1U)},
                                     {"chunk_count", wordBytes(1U)}},
                                    "");
    const std::size_t padding = 4096 + 8 - record.size();
    return record.substr(0, record.size() - 4) + sizedText(std::string(padding - 8, ' '));
  };
  std::string file = magic + bag_header(0);
  std::string summary;
  std::uint32_t id = 0;
  for (const auto& [topic, type] : topicsIn(messages)) {
    summary += ros1Record({{"op", "\7"}, {"conn", wordBytes(id++)}, {"topic", topic}},
                          sizedText("topic=" + topic) + sizedText("type=" + type));
  }
  for (std::size_t i = 0, end = 0; i < messages.size(); i = end) {
    std::string chunk;
    std::string counts;
    end = std::min(messages.size(), i == 0 ? 1 : i + per_chunk);
    for (std::size_t k = i; k < end; ++k) {
      const std::string connection = wordBytes(topicNumber(messages, messages[k]));
      chunk +=
          ros1Record({{"op", "\2"}, {"conn", connection}, {"time", ros1Time(messages[k].log_ns)}},
                     messages[k].data);
      counts += connection + wordBytes(1U);
    }
    summary += ros1Record({{"op", "\6"},
                           {"ver", wordBytes(1U)},
                           {"chunk_pos", wordBytes(static_cast<std::uint64_t>(file.size()))},
                           {"start_time", ros1Time(messages[i].log_ns)},
                           {"end_time", ros1Time(messages[end - 1].log_ns)},
                           {"count", wordBytes(static_cast<std::uint32_t>(end - i))}},
                          counts);
    file += ros1Record({{"op", "\5"},
                        {"compression", "none"},
                        {"size", wordBytes(static_cast<std::uint32_t>(chunk.size()))}},
                       chunk);
  }
  const std::string header = bag_header(file.size());
  return magic + header + file.substr(magic.size() + header.size()) + summary;
}

inline void writeDb3(const std::filesystem::path& file, const RecordedMessages& messages) {
  std::filesystem::create_directories(file.parent_path());
  std::filesystem::remove(file);
  sqlite3* database = nullptr;
  sqlite3_open(file.c_str(), &database);
  std::string sql =
      "BEGIN; CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT,"
      " serialization_format TEXT);"
      "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data "
      "BLOB);"
      "CREATE INDEX timestamp_idx ON messages (timestamp ASC);";
  for (const auto& [topic, type] : topicsIn(messages)) {
    sql += "INSERT INTO topics(name, type, serialization_format) VALUES('" + topic + "','" +
           ros2TypeOf(type) + "','cdr');";
  }
  for (const RecordedMessage& message : messages) {
    sql += "INSERT INTO messages(topic_id, timestamp, data) VALUES(" +
           std::to_string(topicNumber(messages, message) + 1) + "," +
           std::to_string(message.log_ns) + ",x'";
    for (const char c : message.data) {
      constexpr const char* kDigits = "0123456789abcdef";
      sql += kDigits[static_cast<unsigned char>(c) >> 4U];
      sql += kDigits[static_cast<unsigned char>(c) & 15U];
    }
    sql += "');";
  }
  sqlite3_exec(database, (sql + "COMMIT;").c_str(), nullptr, nullptr, nullptr);
  sqlite3_close(database);
}

}  // namespace efm
