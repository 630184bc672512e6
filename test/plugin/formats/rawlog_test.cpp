// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <mrpt/obs/CActionCollection.h>
#include <mrpt/obs/CActionRobotMovement2D.h>
#include <mrpt/obs/CObservationGPS.h>
#include <mrpt/obs/CRawlog.h>
#include <mrpt/obs/CSensoryFrame.h>
#include <mrpt/serialization/CArchive.h>
#include <sys/stat.h>

#include <fstream>
#include <iterator>

#include "plugin/formats/gz_stream.h"
#include "plugin/formats/rawlog_recording.h"
#include "plugin/formats/rawlog_writer.h"
#include "plugin/mrpt/pose_observation.h"
#include "plugin/mrpt/registration.h"
#include "test/plugin/mrpt/observations.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using mrpt::obs::CObservation;
using testing::AllOf;
using testing::EndsWith;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;
using Observations = std::vector<CObservation::Ptr>;

/// The observations of a recording and its error, if there is one.
struct Delivery {
  Observations observations;
  std::string error;
};

Delivery read(const std::filesystem::path& file) {
  Delivery delivery;
  try {
    RawlogRecording recording(file);
    while (auto observation = recording.next()) delivery.observations.push_back(observation);
  } catch (const std::exception& error) {
    delivery.error = error.what();
  }
  return delivery;
}

void expectSame(const CObservation& a, const CObservation& b) {
  EXPECT_EQ(a.GetRuntimeClass(), b.GetRuntimeClass());
  EXPECT_EQ(a.sensorLabel, b.sensorLabel);
  EXPECT_EQ(a.timestamp, b.timestamp);
  if (const auto* events = dynamic_cast<const CObservationEvents*>(&a)) {
    EXPECT_TRUE(events->events == dynamic_cast<const CObservationEvents&>(b).events);
  }
}

void expectBeginningOf(const Observations& all, const Observations& some) {
  ASSERT_LE(some.size(), all.size());
  for (std::size_t i = 0; i < some.size(); ++i) expectSame(*all[i], *some[i]);
}

std::string contentOf(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return std::string(std::istreambuf_iterator<char>(file), {});
}

/// One line without MRPT's decoration.
testing::Matcher<std::string> isPlain() {
  return AllOf(Not(HasSubstr("xception")), Not(HasSubstr("Location")), Not(HasSubstr("Message")),
               Not(HasSubstr("\n")), Not(EndsWith("unreadable")));
}

class Rawlog : public TemporaryFolder {
 protected:
  Rawlog() { registerClasses(); }

  std::filesystem::path file() const { return folder() / "r.rawlog"; }

  void write(const Observations& observations) const {
    RawlogWriter writer(file());
    for (const auto& observation : observations) writer.write(*observation);
    writer.close();
  }

  void writeBytes(const std::string& bytes) const {
    std::ofstream(file(), std::ios::binary | std::ios::trunc) << bytes;
  }

  /// The uncompressed content.
  std::string plainContent() const {
    GzInputStream stream(file());
    std::string plain;
    char byte = 0;
    while (stream.Read(&byte, 1) == 1) plain += byte;
    return plain;
  }

  /// Any objects, as other programs may store them.
  template <typename... Objects>
  void writeObjects(const Objects&... objects) const {
    GzOutputStream stream(file());
    auto archive = mrpt::serialization::archiveFrom<mrpt::io::CStream>(stream);
    (archive << ... << objects);
    stream.close();
  }

  const Observations recorded = observationsOf(SyntheticRecording(0.2));
};

TEST_F(Rawlog, ReadsBackTheWrittenObservations) {
  write(recorded);
  const Delivery delivery = read(file());
  EXPECT_EQ(delivery.error, "");
  EXPECT_EQ(delivery.observations.size(), recorded.size());
  expectBeginningOf(recorded, delivery.observations);
}

TEST_F(Rawlog, IsReadByMrpt) {
  write(recorded);
  mrpt::obs::CRawlog rawlog;
  ASSERT_TRUE(rawlog.loadFromRawLogFile(file().string()));
  ASSERT_EQ(rawlog.size(), recorded.size());
  expectSame(*rawlog.getAsObservation(0), *recorded[0]);
}

TEST_F(Rawlog, ProgressGoesFromTheBeginningToOne) {
  write(recorded);
  RawlogRecording recording(file());
  double last = 0;
  while (recording.next()) {
    EXPECT_GE(recording.progress(), last);
    last = recording.progress();
  }
  EXPECT_EQ(last, 1);
}

TEST_F(Rawlog, MayBeStoredWithoutCompression) {
  write(recorded);
  mrpt::obs::CRawlog rawlog;
  rawlog.loadFromRawLogFile(file().string());
  const std::string plain = plainContent();
  writeBytes(plain);
  const Delivery delivery = read(file());
  EXPECT_EQ(delivery.error, "");
  EXPECT_EQ(delivery.observations.size(), recorded.size());

  writeBytes(plain.substr(0, plain.size() - 1));
  const Delivery cut = read(file());
  EXPECT_THAT(cut.error,
              AllOf(StartsWith("stopped at entry " + std::to_string(recorded.size() - 1)),
                    EndsWith("r.rawlog: the file ends in the middle of its data")));
  EXPECT_EQ(cut.observations.size(), recorded.size() - 1);
}

TEST_F(Rawlog, ObservationsOfFramesComeOneByOneWithoutActions) {
  mrpt::obs::CSensoryFrame frame;
  frame.insert(recorded[0]);
  frame.insert(recorded[1]);
  writeObjects(mrpt::obs::CActionCollection(), frame, mrpt::obs::CActionCollection(), frame);
  const Delivery delivery = read(file());
  EXPECT_EQ(delivery.error, "");
  ASSERT_EQ(delivery.observations.size(), 4);
  expectSame(*delivery.observations[2], *recorded[0]);
  expectSame(*delivery.observations[3], *recorded[1]);
}

TEST_F(Rawlog, OfMovementsWithoutATimeTheLastPoseIsThatOfTheFrame) {
  mrpt::obs::CActionRobotMovement2D movement;
  movement.timestamp = INVALID_TIMESTAMP;
  movement.computeFromOdometry(mrpt::poses::CPose2D(1, 0, 0), {});
  const mrpt::obs::CActionCollection action(movement);
  mrpt::obs::CSensoryFrame frame;
  frame.insert(recorded[0]);
  mrpt::obs::CSensoryFrame later;
  later.insert(recorded[30]);
  writeObjects(action, action, action, frame, action, later);

  const Delivery delivery = read(file());
  EXPECT_EQ(delivery.error, "");
  ASSERT_EQ(delivery.observations.size(), 4);
  const auto first = poseIn(*delivery.observations[0]);
  ASSERT_TRUE(first);
  EXPECT_EQ(delivery.observations[0]->timestamp, recorded[0]->timestamp);
  EXPECT_NEAR(first->T_world_body.translation.x(), 3, 1e-12);
  const auto second = poseIn(*delivery.observations[2]);
  ASSERT_TRUE(second);
  EXPECT_EQ(delivery.observations[2]->timestamp, recorded[30]->timestamp);
  EXPECT_NEAR(second->T_world_body.translation.x(), 4, 1e-12);
}

TEST_F(Rawlog, OtherObservationsPassThrough) {
  writeObjects(mrpt::obs::CObservationGPS(), *recorded[0]);
  EXPECT_EQ(read(file()).observations.size(), 2);
}

// --- Damage ------------------------------------------------------------------------------------

TEST_F(Rawlog, TruncatedAnywhereIsAnErrorThatNamesTheEntryAfterAllEntriesBeforeIt) {
  write(recorded);
  const std::string bytes = contentOf(file());
  std::size_t most = 0;
  for (std::size_t size = 0; size < bytes.size(); size += 1 + bytes.size() / 50) {
    writeBytes(bytes.substr(0, size));
    const Delivery delivery = read(file());
    EXPECT_THAT(
        delivery.error,
        AllOf(
            StartsWith("stopped at entry " + std::to_string(delivery.observations.size()) + " of "),
            HasSubstr("r.rawlog: "), isPlain(),
            EndsWith(size == 0 ? "the file is empty" : "the file ends in the middle of its data")))
        << "cut to " << size << " of " << bytes.size() << " bytes";
    expectBeginningOf(recorded, delivery.observations);
    most = std::max(most, delivery.observations.size());
  }
  EXPECT_GT(most, recorded.size() / 2);
}

TEST_F(Rawlog, TruncatedInItsLastBytesIsAnErrorAfterAllEntries) {
  write(recorded);
  const std::string bytes = contentOf(file());
  for (std::size_t missing = 1; missing <= 8; ++missing) {  // gzip's checksum and size
    writeBytes(bytes.substr(0, bytes.size() - missing));
    const Delivery delivery = read(file());
    EXPECT_THAT(delivery.error, EndsWith("the file ends in the middle of its data"));
    EXPECT_EQ(delivery.observations.size(), recorded.size());
  }
}

TEST_F(Rawlog, AChangedByteIsAnErrorAfterCorrectEntries) {
  write(recorded);
  const std::string bytes = contentOf(file());
  for (std::size_t at = 20; at < bytes.size(); at += 1 + bytes.size() / 40) {
    std::string damaged = bytes;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x08);
    writeBytes(damaged);
    const Delivery delivery = read(file());
    EXPECT_THAT(delivery.error, AllOf(StartsWith("stopped at entry "), isPlain())) << "byte " << at;
    expectBeginningOf(recorded, delivery.observations);
  }
}

TEST_F(Rawlog, APacketWithAChangedByteIsAnErrorThatSaysSo) {
  CObservationEvents packet;
  packet.camera = SyntheticRecording().cameras[0].model;
  packet.events = SyntheticRecording().events[0];
  writeObjects(packet);
  std::string plain = plainContent();
  plain[plain.size() / 2] = static_cast<char>(plain[plain.size() / 2] ^ 0x08);
  writeBytes(plain);
  EXPECT_THAT(read(file()).error,
              EndsWith("r.rawlog: a packet of events is damaged: its checksum is wrong"));
}

TEST_F(Rawlog, AnEmptyFileIsAnError) {
  writeBytes("");
  EXPECT_THAT(read(file()).error, HasSubstr("the file is empty"));
}

TEST_F(Rawlog, ATextFileIsAnError) {
  writeBytes("0.1 2 3 1\n0.2 2 3 1\n");
  EXPECT_THAT(read(file()).error, AllOf(StartsWith("stopped at entry 0 of"), isPlain()));
}

TEST_F(Rawlog, AFolderAndADeviceAreErrorsThatSaySo) {
  EXPECT_THAT(read(folder()).error, EndsWith(": a folder: expected a file"));
  EXPECT_THAT(read("/dev/null").error, EndsWith(": not a regular file"));
  EXPECT_THAT(read(folder() / "nowhere").error, EndsWith(": no such file"));
}

TEST_F(Rawlog, AnUnknownClassIsAnErrorThatNamesIt) {
  // An entry begins with the length of its class's name, with the top bit set.
  const std::string name = "CObservationOfTheFuture";
  writeBytes(std::string(1, static_cast<char>(0x80 | name.size())) + name + std::string(1, '\0'));
  EXPECT_THAT(read(file()).error, AllOf(StartsWith("stopped at entry 0 of"),
                                        HasSubstr("CObservationOfTheFuture"), isPlain()));
}

TEST_F(Rawlog, ControlCharactersOfAClassNameAreEscaped) {
  const std::string name = "C\x1b[2J";
  writeBytes(std::string(1, static_cast<char>(0x80 | name.size())) + name + std::string(1, '\0'));
  EXPECT_THAT(read(file()).error, AllOf(HasSubstr("C\\x1b[2J"), Not(HasSubstr("\x1b"))));
}

TEST_F(Rawlog, AnErrorIsThrownAgain) {
  write(recorded);
  const std::string bytes = contentOf(file());
  writeBytes(bytes.substr(0, bytes.size() / 2));
  RawlogRecording recording(file());
  const auto read_on = [&] {
    while (recording.next()) {
    }
  };
  EXPECT_THROW(read_on(), std::runtime_error);
  EXPECT_THROW(read_on(), std::runtime_error);
}

// --- Writing -----------------------------------------------------------------------------------

TEST_F(Rawlog, AppearsOnlyWhenComplete) {
  {
    RawlogWriter writer(file());
    writer.write(*recorded[0]);
    EXPECT_FALSE(std::filesystem::exists(file()));
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder())) << "something stayed of the one not closed";
}

TEST_F(Rawlog, AFileThatCannotBeWrittenIsNamed) {
  try {
    RawlogWriter writer(folder() / "nowhere" / "r.rawlog");
    FAIL() << "no error";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("nowhere"), HasSubstr("No such file")));
  }
}

TEST_F(Rawlog, ReplacesFilesOnly) {
  const auto error_of = [](const std::filesystem::path& path) -> std::string {
    try {
      RawlogWriter writer(path);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_THAT(error_of(""), HasSubstr("'': expected the name of a file"));
  EXPECT_THAT(error_of(folder()), EndsWith("it is a folder"));
  ASSERT_EQ(mkfifo((folder() / "pipe").c_str(), 0600), 0);
  EXPECT_THAT(error_of(folder() / "pipe"), EndsWith("not a regular file"));
  EXPECT_TRUE(std::filesystem::is_fifo(folder() / "pipe"));
}

TEST_F(Rawlog, ReplacesTheTargetOfALink) {
  std::filesystem::create_directory(folder() / "real");
  std::ofstream(folder() / "real" / "one.rawlog") << "an earlier one";
  std::filesystem::create_symlink("real/one.rawlog", file());
  write(recorded);
  EXPECT_TRUE(std::filesystem::is_symlink(file()));
  EXPECT_EQ(read(folder() / "real" / "one.rawlog").observations.size(), recorded.size());
}

}  // namespace
}  // namespace efm
