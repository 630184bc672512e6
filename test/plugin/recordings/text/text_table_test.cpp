// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/text/text_table.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "mapping/geometry/trajectory.h"
#include "plugin/recordings/open/recording_formats.h"
#include "plugin/recordings/text/event_text.h"
#include "test/plugin/recordings/columns/zip_file.h"
#include "test/plugin/recordings/streams/reading.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using testing::AllOf;
using testing::HasSubstr;

TEST(HeaderWord, HasANameAndAUnit) {
  constexpr int kNone = 1;
  const struct {
    const char* text;
    const char* name;
    const char* unit;
    int exponent;
  } rows[] = {
      {"#timestamp [ns]", "timestamp", "ns", -9},
      {" \"T_us\" ", "t", "us", -6},
      {"microseconds", "t", "microseconds", -6},
      {"x_mm", "x", "mm", kNone},
      {"Time (MS", "time", "ms", -3},
      {"x [px]", "x", "px", kNone},
      {"s", "s", "", kNone},
      {"ns", "t", "ns", -9},
      {"time_stamp", "time_stamp", "", kNone},
      {"pos_x_cm", "pos_x", "cm", kNone},
      {"[s]", "", "s", 0},
      {"'p'", "p", "", kNone},
      {"%time", "time", "", kNone},
      {"field.header.stamp", "field.header.stamp", "ns", -9},
      {"/a/header/stamp/nanosec", "/a/header/stamp/t", "nanosec", -9},
      {"Time (Seconds)", "time", "seconds", 0},
  };
  for (const auto& row : rows) {
    const HeaderWord word = headerWord(row.text);
    EXPECT_EQ(word.name, row.name) << row.text;
    EXPECT_EQ(word.unit, row.unit) << row.text;
    EXPECT_EQ(word.time_exponent.value_or(kNone), row.exponent) << row.text;
  }
}

class PoseTable : public TemporaryFolder {
 protected:
  std::vector<StampedPose> read(const std::string& text, const ReaderOptions& options = {}) const {
    writeFile(folder() / "poses.txt", text);
    return readPoses(folder() / "poses.txt", options);
  }
  std::string errorOfText(const std::string& text) const {
    return errorOf([&] { read(text); });
  }
};

/// Poses at 1.2 s and on, 20 ms apart: the position is (0.1, 0.2, 0.3) s^-1 * (t - 1 s), and the
/// rotation turns.
StampedPose poseAt(int i) {
  const double s = 0.2 + 0.02 * i;
  StampedPose pose;
  pose.t_ns = 1'200'000'000 + 20'000'000LL * i;
  pose.T_world_rig = {rotationBy({0, 0.1 * s, 0.3}), {0.1 * s, 0.2 * s, 0.3 * s}};
  return pose;
}

/// Formats a row of a pose. @param format has the fields {s}, {ns}, {part}, {ms}, {x} … {qw}, {i}.
std::string rowOf(const std::string& format, int i, double metre = 1) {
  const StampedPose pose = poseAt(i);
  const Eigen::Vector3d p = metre * pose.T_world_rig.translation;
  const Eigen::Quaterniond& q = pose.T_world_rig.rotation;
  const auto text = [](double value) { return fmt::format("{:.12f}", value); };
  return fmt::format(
      format + "\n", fmt::arg("s", fmt::format("{:.9f}", 1e-9 * double(pose.t_ns))),
      fmt::arg("ns", pose.t_ns), fmt::arg("whole", pose.t_ns / 1'000'000'000),
      fmt::arg("part", pose.t_ns % 1'000'000'000), fmt::arg("micro", pose.t_ns / 1000 % 1'000'000),
      fmt::arg("ms", pose.t_ns / 1'000'000), fmt::arg("x", text(p.x())), fmt::arg("y", text(p.y())),
      fmt::arg("z", text(p.z())), fmt::arg("qx", text(q.x())), fmt::arg("qy", text(q.y())),
      fmt::arg("qz", text(q.z())), fmt::arg("qw", text(q.w())), fmt::arg("i", i));
}

std::string tableOf(const std::string& header, const std::string& format, double metre = 1) {
  std::string text = header;
  for (int i = 0; i < 20; ++i) text += rowOf(format, i, metre);
  return text;
}

void expectAll(const std::vector<StampedPose>& poses, const std::string& what) {
  ASSERT_EQ(poses.size(), 20U) << what;
  for (int i = 0; i < 20; ++i) {
    const StampedPose& pose = poses[static_cast<std::size_t>(i)];
    EXPECT_EQ(pose.t_ns, poseAt(i).t_ns) << what;
    EXPECT_LT(differenceOf(pose.T_world_rig.inverse() * poseAt(i).T_world_rig).norm(), 1e-9)
        << what;
  }
}

TEST_F(PoseTable, ReadsTheHeadersOfOtherPrograms) {
  const std::string ros = "{s},{i},{ns},world,{x},{y},{z},{qx},{qy},{qz},{qw}";
  const std::string motive = "{i},{s},{qx},{qy},{qz},{qw},{x},{y},{z}";
  const struct {
    const char* program;
    std::string text;
  } rows[] = {
      {"rostopic echo -p",
       tableOf("%time,field.header.seq,field.header.stamp,field.header.frame_id,"
               "field.pose.position.x,field.pose.position.y,field.pose.position.z,"
               "field.pose.orientation.x,field.pose.orientation.y,field.pose.orientation.z,"
               "field.pose.orientation.w\n",
               ros)},
      {"seconds and nanoseconds", tableOf("sec,nanosec,frame_id,x,y,z,qx,qy,qz,qw\n",
                                          "{whole},{part},world,{x},{y},{z},{qx},{qy},{qz},{qw}")},
      {"bagpy",
       tableOf(
           "Time,header.seq,header.stamp.secs,header.stamp.nsecs,header.frame_id,child_frame_id,"
           "pose.pose.position.x,pose.pose.position.y,pose.pose.position.z,"
           "pose.pose.orientation.x,pose.pose.orientation.y,pose.pose.orientation.z,"
           "pose.pose.orientation.w,pose.covariance_0,twist.twist.linear.x\n",
           "9.5,{i},{whole},{part},map,base,{x},{y},{z},{qx},{qy},{qz},{qw},0,7")},
      {"PlotJuggler",
       tableOf("__time,/odom/header/stamp,/odom/pose/position/x,/odom/pose/position/y,"
               "/odom/pose/position/z,/odom/pose/orientation/x,/odom/pose/orientation/y,"
               "/odom/pose/orientation/z,/odom/pose/orientation/w,/odom/twist/angular/x\n",
               "77,{s},{x},{y},{z},{qx},{qy},{qz},{qw},5")},
      {"pandas",
       tableOf(",timestamp,x,y,z,qx,qy,qz,qw\n", "{i},{s},{x},{y},{z},{qx},{qy},{qz},{qw}")},
      {"AirSim",
       tableOf("VehicleName\tTimeStamp [ms]\tPOS_X\tPOS_Y\tPOS_Z\tQ_W\tQ_X\tQ_Y\tQ_Z\tImageFile\n",
               "Drone1\t{ms}\t{x}\t{y}\t{z}\t{qw}\t{qx}\t{qy}\t{qz}\timg_{i}.png")},
      {"a name with a blank, between tabs",
       tableOf("name\tt\tx\ty\tz\tqx\tqy\tqz\tqw\n",
               "My drone\t{s}\t{x}\t{y}\t{z}\t{qx}\t{qy}\t{qz}\t{qw}")},
      {"Motive",
       tableOf(
           "Format Version,1.23,Take Name,Take 1,Rotation Type,Quaternion,Length "
           "Units,Millimeters,Coordinate Space,Global\n\n"
           ",Type,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body\n"
           ",Name,cam,cam,cam,cam,cam,cam,cam\n,ID,1,1,1,1,1,1,1\n"
           ",,Rotation,Rotation,Rotation,Rotation,Position,Position,Position\n"
           "Frame,Time (Seconds),X,Y,Z,W,X,Y,Z\n",
           motive, 1000)},
      {"a line of units", tableOf("time;pos x;pos y;pos z;quat x;quat y;quat z;quat "
                                  "w;state\n(s);(mm);(mm);(mm);-;-;-;-;-\n",
                                  "{s};{x};{y};{z};{qx};{qy};{qz};{qw};ok", 1000)},
      {"a body's name before all",
       tableOf("t,cam_x,cam_y,cam_z,cam_qx,cam_qy,cam_qz,cam_qw,v_x,v_y,v_z\n",
               "{s},{x},{y},{z},{qx},{qy},{qz},{qw},1,2,3")},
      {"axes before the words",
       tableOf("timestamp,x position,y position,z position,x rotation,y rotation,z rotation,w "
               "rotation\n",
               "{s},{x},{y},{z},{qx},{qy},{qz},{qw}")},
      {"EuRoC",
       tableOf("#timestamp [ns], p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], "
               "q_RS_y [], q_RS_z [], v_RS_R_x [m s^-1], v_RS_R_y [m s^-1], v_RS_R_z [m s^-1], "
               "b_w_RS_S_x [rad s^-1]\n",
               "{ns},{x},{y},{z},{qw},{qx},{qy},{qz},1,2,3,4")},
      {"quotes", tableOf("\"t\",\"name\",\"x\",\"y\",\"z\",\"qx\",\"qy\",\"qz\",\"qw\"\n",
                         "\"{s}\",\"a, b\",\"{x}\",\"{y}\",{z},\"{qx}\",{qy},{qz},{qw}")},
      {"seconds and microseconds",
       tableOf("sec,usec,x,y,z,qx,qy,qz,qw\n", "{whole},{micro},{x},{y},{z},{qx},{qy},{qz},{qw}")},
      {"units with empty cells, and a text column",
       tableOf("time,x,y,z,qx,qy,qz,qw,name\nms,mm,mm,mm,,,,\n",
               "{ms},{x},{y},{z},{qx},{qy},{qz},{qw},a", 1000)},
      {"Euler angles before the quaternion",
       tableOf("time,x,y,z,rot_x,rot_y,rot_z,qx,qy,qz,qw\n",
               "{s},{x},{y},{z},0.01,0.02,0.03,{qx},{qy},{qz},{qw}")},
      {"pixels before the position",
       tableOf("time,px,py,p_x,p_y,p_z,qx,qy,qz,qw\n", "{s},9,9,{x},{y},{z},{qx},{qy},{qz},{qw}")},
      {"a time of receipt before the stamp",
       tableOf("timestamp,header.stamp.sec,header.stamp.nanosec,pose.position.x,pose.position.y,"
               "pose.position.z,pose.orientation.x,pose.orientation.y,pose.orientation.z,"
               "pose.orientation.w\n",
               "9,{whole},{part},{x},{y},{z},{qx},{qy},{qz},{qw}")},
      {"a column without a name at the end",
       tableOf(",,Rotation,Rotation,Rotation,Rotation,Position,Position,Position,Error\n"
               "Frame,Time (Seconds),X,Y,Z,W,X,Y,Z,\n",
               "{i},{s},{qx},{qy},{qz},{qw},{x},{y},{z},")},
      {"empty fields between tabs, and semicolons in a text",
       tableOf("\tt\tx\ty\tz\tqx\tqy\tqz\tqw\tfile\tflag\n",
               "\t{s}\t{x}\t{y}\t{z}\t{qx}\t{qy}\t{qz}\t{qw}\ta;b\t")},
      {"two times, in seconds and in nanoseconds",
       tableOf("time_s,time_ns,x,y,z,qx,qy,qz,qw\n", "{s},{ns},{x},{y},{z},{qx},{qy},{qz},{qw}")},
  };
  for (const auto& row : rows) expectAll(read(row.text), row.program);
  // In other words: what is missing, and no word of a missing header.
  const std::pair<std::string, const char*> errors[] = {
      {"x,y,z,qx,qy,qz,qw\n1,2,3,0,0,0,1\n",
       "poses.txt:1: 'x,y,z,qx,qy,qz,qw': there is no column t"},
      {"t,x,y,qx,qy,qz,qw\n1,2,3,0,0,0,1\n", "there is no column tz"},
      {"%time,field.position.x,field.position.y,field.position.z\n1,2,3,0\n",
       "poses.txt:1: '%time,field.position.x,field.position.y,…': there is no column qx"},
      {"t,x,y,z,roll,pitch,yaw\n1,2,3,0,0,0,1\n", "angles are not read"},
      {"time,lat,lon,alt\n1,2,3,4\n",
       "poses.txt:1: 'time,lat,lon,alt': expected t tx ty tz qx qy qz qw, or columns with these"},
      {"t,tx,ty,tz_mm,qx,qy,qz,qw\n1,2,3,4,0,0,0,1\n",
       "poses.txt:1: the units of tx, ty and tz are '', '' and 'mm': expected one at each"},
      {"# t tx ty tz [mm] qx qy qz qw\n1.5 1 2 3 0 0 0 1\n", "are '', '' and 'mm'"},
      {"time [min],x,y,z,qx,qy,qz,qw\n1.5,2,3,4,0,0,0,1\n",
       "the unit 'min' of t: expected s, ms, us"},
      {"t,x,y,z,qx,qy,qz,qw\ns,in,in,mm,,,,\n1,2,3,4,0,0,0,1\n", "the unit 'in' of tx: expected m"},
      {"t,x,y,z,qx,qy,qz,qw\nnone of these is a unit,,,,,,,\n1,2,3,4,0,0,0,1\n",
       "poses.txt:2: t = 'none of these is a unit': expected a decimal time"},
      {"t,x,y,z,pos_x,pos_y,pos_z,qx,qy,qz,qw\n1,2,3,4,2,3,4,0,0,0,1\n",
       "column 5, 'pos_x', is of a second position or rotation of this body: expected one"},
      {"t,x,y,z,qx,qy,qz,qw\n1,5,2,0,3,0,4,0,0,0,0,0,0,0,1,0\n",
       "16 fields: expected 8; decimal commas? Then semicolons or quotes between the fields"},
      {"t,x [mm],y [m],z [ft],qx,qy,qz,qw\n1,2,3,4,0,0,0,1\n", "the unit 'ft' of tz: expected m,"},
  };
  for (const auto& [text, error] : errors) EXPECT_THAT(errorOfText(text), HasSubstr(error)) << text;
}

TEST_F(PoseTable, TakesOneOfSeveralBodiesByTheCommandInItsError) {
  const std::string row = "{i},{s},{qx},{qy},{qz},{qw},{x},{y},{z},0.1,0,0,0,1,5,6,7,8,9,10";
  const std::string header =
      "Format Version,1.23,Length Units,Millimeters\n\n"
      ",Type,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid "
      "Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Marker,"
      "Marker,Marker\n"
      ",Name,cam,cam,cam,cam,cam,cam,cam,cam,hand,hand,hand,hand,hand,hand,hand,m,m,m\n"
      ",ID,1,1,1,1,1,1,1,1,2,2,2,2,2,2,2,3,3,3\n"
      ",,Rotation,Rotation,Rotation,Rotation,Position,Position,Position,Mean Marker "
      "Error,Rotation,Rotation,Rotation,Rotation,Position,Position,Position,Position,Position,"
      "Position\n"
      "Frame,Time (Seconds),X,Y,Z,W,X,Y,Z,,X,Y,Z,W,X,Y,Z,X,Y,Z\n";
  const std::string juggler =
      "__time,/a/pose/position/x,/a/pose/position/y,/a/pose/position/z,/a/pose/orientation/x,"
      "/a/pose/orientation/y,/a/pose/orientation/z,/a/pose/orientation/w,/b/pose/position/x,"
      "/b/pose/position/y,/b/pose/position/z,/b/pose/orientation/x,/b/pose/orientation/y,"
      "/b/pose/orientation/z,/b/pose/orientation/w\n";
  for (const auto& [name, text] :
       {std::pair("'rigid body cam 1' (columns 3 to 9), 'rigid body hand 2' (columns 11 to 17)",
                  tableOf(header, row, 1000)),
        {"'a pose' (columns 2 to 8), 'b pose' (columns 9 to 15)",
         tableOf(juggler, "{s},{x},{y},{z},{qx},{qy},{qz},{qw},9,9,9,0,0,0,1")},
        {"'a pose' (columns 3 to 9), 'b pose' (columns 10 to 16)",
         tableOf("sec,nanosec" + juggler.substr(6),
                 "{whole},{part},{x},{y},{z},{qx},{qy},{qz},{qw},9,9,9,0,0,0,1")}}) {
    std::string command = errorOfText(text);
    EXPECT_THAT(command, AllOf(HasSubstr("poses of 2 bodies"), HasSubstr(name)));
    command.erase(0, command.find("alone: ") + 7);
    command.replace(command.find("FILE"), 4, (folder() / "poses.txt").string());
    command.replace(command.find("NEW"), 3, (folder() / "one.csv").string());
    ASSERT_EQ(std::system(command.c_str()), 0) << command;
    expectAll(readPoses(folder() / "one.csv"), command);
  }
}

TEST_F(PoseTable, RowsNameOneBody) {
  std::string text = "time,frame_id,child_frame_id,x,y,z,qx,qy,qz,qw\n";
  for (int i = 0; i < 20; ++i) {
    text += rowOf("{s},odom,base,{x},{y},{z},{qx},{qy},{qz},{qw}", i) +
            rowOf("{s},map,odom,0,0,0,0,0,0,1", i);
  }
  // A row without a pose has no body.
  expectAll(read(tableOf("time,child_frame_id,x,y,z,qx,qy,qz,qw\n1.0,,,,,,,,\n",
                         "{s},base,{x},{y},{z},{qx},{qy},{qz},{qw}")),
            "an empty row");
  std::string command = errorOfText(text);
  EXPECT_THAT(command,
              HasSubstr("poses.txt:3: child_frame_id = 'odom', after 'base': poses of several"));
  command.erase(0, command.find("awk"));
  command.replace(command.find("FILE"), 4, (folder() / "poses.txt").string());
  command.replace(command.find("NEW)"), 4, (folder() / "one.csv").string());
  ASSERT_EQ(std::system(command.c_str()), 0) << command;
  expectAll(readPoses(folder() / "one.csv"), command);
}

TEST_F(PoseTable, LeavesOutPosesThatATrackerLostAndSaysSo) {
  std::string text = tableOf("t,x,y,z,qx,qy,qz,qw\n", "{s},{x},{y},{z},{qx},{qy},{qz},{qw}");
  text.insert(text.find('\n') + 1, "1.1,,,,,,,\n");
  text += "1.7,,,,,,,\n1.8,nan,nan,nan,nan,nan,nan,nan\n1.9,,,,,,,\n";
  expectAll(read(text), "lost");
  const RecordingParts parts = readPoseParts(folder() / "poses.txt", {});
  ASSERT_EQ(parts.notes.size(), 1U);
  EXPECT_THAT(parts.notes[0].text, HasSubstr("poses.txt: 4 rows have no pose"));
  EXPECT_THAT(errorOfText("t,x,y,z,qx,qy,qz,qw\n1.5,,,,,,,\n"), HasSubstr("no poses"));
  EXPECT_THAT(errorOfText(text + "2.0,1,2,,0,0,0,1\n"), HasSubstr(":26: tz = '': expected"));
}

/// Writes points as decimal commas.
std::string withCommas(std::string text) {
  std::replace(text.begin(), text.end(), '.', ',');
  return text;
}

TEST_F(PoseTable, ReadsDecimalCommasBetweenAllSeparators) {
  const std::string rows[] = {
      tableOf("t;x;y;z;qx;qy;qz;qw\n", "{s};{x};{y};{z};{qx};{qy};{qz};{qw}"),
      tableOf("t\tx\ty\tz\tqx\tqy\tqz\tqw\n", "{s}\t{x}\t{y}\t{z}\t{qx}\t{qy}\t{qz}\t{qw}"),
      tableOf("# t x y z qx qy qz qw\n", "{s} {x} {y} {z} {qx} {qy} {qz} {qw}"),
      tableOf("", "{s} {x} {y} {z} {qx} {qy} {qz} {qw}"),
      tableOf("t, x, y, z, qx, qy, qz, qw\n", "{s}, {x}, {y}, {z}, {qx}, {qy}, {qz}, {qw}"),
      tableOf("t,x,y,z,qx,qy,qz,qw\n",
              "\"{s}\",\"{x}\",\"{y}\",\"{z}\",\"{qx}\",\"{qy}\",\"{qz}\",\"{qw}\""),
  };
  for (const std::string& text : rows) expectAll(read(withCommas(text)), text.substr(0, 200));
  // Events: the blocks of a file end anywhere, also after a comma.
  const std::pair<const char*, const char*> events[] = {{"t;x;y;p\n", "{};{};{};{}\n"},
                                                        {"", "{} {} {} {}\n"},
                                                        {"t\tx\ty\tp\n", "{}\t{}\t{}\t{}\n"},
                                                        {"t, x, y, p\n", "{}, {}, {}, {}\n"},
                                                        {"t,x,y,p\n", "\"{}\",\"{}\",{},\"{}\"\n"}};
  for (const auto& [header, format] : events) {
    std::string text = header;
    const int count = 120'000;
    for (int i = 0; i < count; ++i) {
      text += fmt::format(format, fmt::format("1,{:06}", 7 * i), i % 240, i % 180, i % 2);
    }
    writeFile(folder() / "events.csv", text);
    EventTextStream stream(folder() / "events.csv");
    const std::vector<Event> all = readStream(stream);
    ASSERT_EQ(all.size(), static_cast<std::size_t>(count)) << header << format;
    for (int i = 0; i < count; i += 997) {
      const Event expected = {1'000'000'000 + 7'000LL * i, static_cast<std::uint16_t>(i % 240),
                              static_cast<std::uint16_t>(i % 180), i % 2 == 1};
      EXPECT_EQ(all[static_cast<std::size_t>(i)], expected) << header << format << i;
    }
  }
}

TEST_F(PoseTable, EventsHaveSecondsAndNanosecondsToo) {
  std::string text = "sec,nanosec,x,y,polarity,camera_name\n";
  for (int i = 0; i < 30; ++i)
    text += fmt::format("{},{},{},2,1,left\n", 5 + i / 20, i % 20 * 50'000'000, i);
  writeFile(folder() / "events.csv", text);
  EventTextStream stream(folder() / "events.csv");
  const std::vector<Event> events = readStream(stream);
  ASSERT_EQ(events.size(), 30U);
  for (int i = 0; i < 30; ++i) {
    EXPECT_EQ(events[static_cast<std::size_t>(i)].t_ns, 5'000'000'000 + 50'000'000LL * i) << i;
  }
  const std::pair<std::string, const char*> tables[] = {
      // 1.5 s, twice
      {"t,x,y,p\nms,px,px,\n1500,1,2,1\n1500,1,2,1\n", ""},
      {"sec usec x y p\n1 500000 1 2 1\n1 500000 1 2 1\n", ""},
      {"1 500000000 1 2 1\n1 500000000 1 2 1\n", "t n x y p"},
      {"\tt_ms\tx\ty\tp\tflag\n\t1500\t1\t2\t1\t\na;b\t1500\t1\t2\t1\t\n", ""}};
  for (const auto& [table, columns] : tables) {
    writeFile(folder() / "table.csv", table);
    EventTextStream read(folder() / "table.csv", ReaderOptions{{}, columns, {}});
    EXPECT_EQ(readStream(read), (std::vector<Event>(2, {1'500'000'000, 1, 2, true}))) << table;
  }
  const std::pair<std::string, const char*> errors[] = {
      {"t [min],x,y,p\n1.5,1,2,1\n", "events.csv:1: the unit 'min' of t: expected s, ms, us or ns"},
      {"t_ms,x,y,type\n1.5,1,2,1\n", "events.csv:1: 't_ms,x,y,type': there is no one column p"}};
  for (const auto& [table, error] : errors) {
    writeFile(folder() / "events.csv", table);
    EXPECT_THAT(errorOf([&] { EventTextStream(folder() / "events.csv"); }), HasSubstr(error));
  }
  writeFile(folder() / "events.csv", text + "7,1000000000,1,2,1,left\n");
  EventTextStream wrong(folder() / "events.csv");
  EXPECT_THAT(errorOf([&] { readStream(wrong); }),
              HasSubstr("events.csv:32: part of a second = '100000"));
}

/// Damages a text by one change of a byte after `from`, and reads it. It must be read or rejected
/// with the file's name, and no pose far from the change may be another one.
void damage(const std::filesystem::path& file, const std::string& text, std::size_t from) {
  std::map<std::int64_t, Rigid3> expected;
  writeFile(file, text);
  for (const StampedPose& pose : readPoses(file)) expected[pose.t_ns] = pose.T_world_rig;
  std::mt19937 random(7);
  int read = 0;
  for (int k = 0; k < 120; ++k) {
    std::string damaged = text;
    const std::size_t at = from + random() % (text.size() - from);
    const char byte = "0123456789,;. \t\n\"#\0\xff-e"[random() % 23];
    if (k % 3 == 0) damaged[at] = byte;
    if (k % 3 == 1) damaged.erase(at, 1 + random() % 20);
    if (k % 3 == 2) damaged.insert(at, 1, byte);
    writeFile(file, damaged);
    try {
      int others = 0;
      for (const StampedPose& pose : readPoses(file)) {
        const auto found = expected.find(pose.t_ns);
        others +=
            found == expected.end() || !(found->second.translation == pose.T_world_rig.translation);
      }
      EXPECT_LE(others, 1) << damaged.substr(at < 40 ? 0 : at - 40, 80);
      ++read;
    } catch (const std::runtime_error& error) {
      EXPECT_THAT(error.what(), HasSubstr(file.filename().string()));
    }
  }
  EXPECT_GT(read, 10) << file;
}

TEST_F(PoseTable, DamagedFilesAreReadOrRejected) {
  const std::string csv = "sec,nanosec,name,x,y,z,qx,qy,qz,qw\n";
  damage(folder() / "a.csv", tableOf(csv, "{whole},{part},w,{x},{y},{z},{qx},{qy},{qz},{qw}"),
         csv.size());
  const std::string commas = "t;x;y;z;qx;qy;qz;qw\n";
  damage(folder() / "b.csv", withCommas(tableOf(commas, "{s};{x};{y};{z};{qx};{qy};{qz};{qw}")),
         commas.size());
  damage(folder() / "c.txt", tableOf("", "{s} {x} {y} {z} {qx} {qy} {qz} {qw}"), 0);
  std::string json = "{\"camera_model\": \"OPENCV\", \"frames\": [";
  for (int i = 0; i < 20; ++i) {
    const StampedPose pose = poseAt(i);
    const Eigen::Matrix3d R = pose.T_world_rig.rotation.toRotationMatrix();
    json += fmt::format("{}{{\"file_path\": \"{}.png\", \"time\": {:.3f}, \"transform_matrix\": [",
                        i == 0 ? "" : ",\n", i, 1e-9 * double(pose.t_ns));
    for (int row = 0; row < 3; ++row) {
      json += fmt::format("[{:.12f}, {:.12f}, {:.12f}, {:.12f}], ", R(row, 0), -R(row, 1),
                          -R(row, 2), pose.T_world_rig.translation[row]);
    }
    json += "[0, 0, 0, 1]]}";
  }
  json += "]}\n";
  writeFile(folder() / "transforms.json", json);
  expectAll(readPoses(folder() / "transforms.json"), "OpenGL's axes");
  damage(folder() / "transforms.json", json, 0);
}

TEST_F(PoseTable, ReadsWrittenPosesExactly) {
  StampedPose pose;
  pose.t_ns = 1'700'000'000'123'456'789;
  pose.T_world_rig.translation = {1.0 / 3, -2e-7, 12345.678901234567};
  pose.T_world_rig.rotation = Eigen::Quaterniond(0.3, -0.4, 0.5, 0.6).normalized();
  StampedPose early = pose;
  early.t_ns = -1;
  writeTumTrajectory(folder() / "poses.txt", {pose, early});
  const auto poses = readPoses(folder() / "poses.txt");
  ASSERT_EQ(poses.size(), 2U);
  EXPECT_EQ(poses[0].t_ns, pose.t_ns);
  EXPECT_EQ(poses[1].t_ns, -1);
  EXPECT_EQ(poses[0].T_world_rig.translation, pose.T_world_rig.translation);
  EXPECT_LT((poses[0].T_world_rig.rotation.coeffs() - pose.T_world_rig.rotation.coeffs()).norm(),
            1e-15);
}

TEST_F(PoseTable, SkipsCommentsAndBlankLinesAndAcceptsAnyBlanks) {
  const auto poses =
      read("# a comment\n\n  \t\r\n1.5\t1 2  3 0 0 0 1\r\n  2 1 2 3 0 0 0 1 # end\n");
  ASSERT_EQ(poses.size(), 2U);
  EXPECT_EQ(poses[0].t_ns, 1'500'000'000);
  EXPECT_EQ(poses[0].T_world_rig.translation, Eigen::Vector3d(1, 2, 3));
}

TEST_F(PoseTable, ReadsTheQuaternionAsXyzwAndNormalisesIt) {
  const auto poses = read("0.5 0 0 0 0 0 1.009 0\n1.5 0 0 0 0.991 0 0 0\n2.5 0 0 0 .71 .71 0 0\n");
  EXPECT_DOUBLE_EQ(poses[0].T_world_rig.rotation.z(), 1);
  EXPECT_DOUBLE_EQ(poses[0].T_world_rig.rotation.w(), 0);
  EXPECT_DOUBLE_EQ(poses[1].T_world_rig.rotation.x(), 1);
  EXPECT_DOUBLE_EQ(poses[2].T_world_rig.rotation.norm(), 1);
}

TEST_F(PoseTable, ErrorsNameTheLineTheFieldAndTheExpectedValue) {
  struct Row {
    const char* text;
    std::vector<const char*> parts;
  };
  const Row rows[] = {
      {"0 0 0 0 0 0 0 1\n\n1 2 3\n", {"poses.txt:3: ", "3 fields", "expected 8"}},
      {"0 0 0 0 0 0 0 1 9\n", {"poses.txt:1: ", "9 fields"}},
      {"# t\nnow 0 0 0 0 0 0 1\n", {"poses.txt:2: ", "t = 'now'", "a decimal time"}},
      {"0 0 1,5,5 0 0 0 0 1\n", {"poses.txt:1: "}},
      {"0 0 \x1b[2J 0 0 0 0 1\n", {"poses.txt:1: ty = '\\x1b[2J'"}},
      {"0 0 0 nan 0 0 0 1\n", {"tz = 'nan': expected a finite number"}},
      {"0 0 0 0 0 0 0 inf\n", {"qw = 'inf': expected a finite number"}},
      {"nan 0 0 0 0 0 0 1\n", {"t = 'nan'"}},
      {"4.7e9 0 0 0 0 0 0 1\n", {"t = '4.7e9'", "4.6e9 s"}},
      {"-4.7e9 0 0 0 0 0 0 1\n", {"t = '-4.7e9'", "4.6e9 s"}},
      {"9223372036 0 0 0 0 0 0 1\n", {"t = '9223372036'", "4.6e9 s"}},
      {"-9223372036 0 0 0 0 0 0 1\n", {"t = '-9223372036'", "4.6e9 s"}},
      {"1 0 0 0 5 5 0 0\n",
       {"poses.txt:1: qx qy qz qw = '5 5 0 0', of length 7.07107: expected a rotation, of length 1 "
        "within 1 %"}},
      {"1 0 0 0 0 0 0 0\n", {"of length 0: expected"}},
      {"1 0 0 0 0 0 0 0.98\n", {"of length 0.98: expected"}},
      {"1 0 0 0 0 0 0 1.02\n", {"of length 1.02: expected"}},
      {"1 0 0 0 1e300 1e300 0 0\n", {"of length 1.41421e+300: expected"}}};
  for (const Row& row : rows) {
    for (const char* part : row.parts) EXPECT_THAT(errorOfText(row.text), HasSubstr(part));
  }
  EXPECT_EQ(read("4.6e9 0 0 0 0 0 0 1\n").size(), 1U);
  EXPECT_THROW(writeTumTrajectory("no/such/poses.txt", {}), std::runtime_error);
}

}  // namespace

}  // namespace efm
