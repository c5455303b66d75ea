#include "bridge/carry/config/lock_file.hpp"

#include <gmock/gmock.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>

#include "bridge/documents/replace_file.hpp"
#include "test/bridge/carry/config/problems_of.hpp"

namespace trestle::test::lock_file_test {
namespace {

namespace fs = std::filesystem;
using carry::LockedTopic;
using carry::LockFile;
using someip::ServiceId;
using testing::ElementsAre;
using testing::HasSubstr;

const LockedTopic imu{"/sensing/imu", "sensor_msgs/msg/Imu", ServiceId{0x61ac}};
const LockedTopic points{"/sensing/points", "sensor_msgs/msg/PointCloud2", ServiceId{0x000a}};
const LockedTopic early{"/a", "std_msgs/msg/String", ServiceId{0x6fff}};

class LockFiles : public testing::Test {
 protected:
  LockFiles() { fs::create_directories(folder_); }
  ~LockFiles() override { fs::remove_all(folder_); }

  [[nodiscard]] std::string file(const std::string& name = "trestle.lock") const { return folder_ + name; }
  void write(const std::string& text) const { std::ofstream{file()} << text; }
  [[nodiscard]] std::string text() const {
    std::ifstream in{file()};
    return {std::istreambuf_iterator<char>{in}, {}};
  }
  [[nodiscard]] LockFile read() const {
    auto lock = LockFile::read(file());
    return lock ? std::move(*lock) : throw std::runtime_error{to_string(lock.error().front())};
  }
  /// What is wrong with this text, without the name of the folder.
  [[nodiscard]] std::vector<std::string> problems(const std::string& text) const {
    write(text);
    const auto lock = LockFile::read(file());
    std::vector<std::string> result = lock ? std::vector<std::string>{"no errors"} : lines(lock.error());
    for (std::string& line : result) {
      line = line.starts_with(folder_) ? line.substr(folder_.size()) : line;
    }
    return result;
  }
  [[nodiscard]] std::size_t files() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator{folder_}, {}));
  }

  const std::string folder_ = testing::TempDir() + "trestle-lock-" + std::to_string(getpid()) + "/";
};

std::vector<std::tuple<std::string, std::string, int>> told(const std::vector<LockedTopic>& topics) {
  std::vector<std::tuple<std::string, std::string, int>> result;
  for (const LockedTopic& one : topics) {
    result.emplace_back(one.topic, one.type, someip::value(one.service));
  }
  return result;
}

TEST_F(LockFiles, AreMadeWithTheFirstTopic) {
  LockFile lock = read();
  EXPECT_THAT(lock.topics(), testing::IsEmpty());
  EXPECT_EQ(files(), 0U) << "reading makes nothing";
  ASSERT_TRUE(lock.add({points, imu}));
  EXPECT_EQ(
      text(),
      "# The ids of topics that `trestle bridge` discovered (`patterns` in its configuration): it adds "
      "what is\n"
      "# new, and never changes or removes a line. Keep this file together with the configuration, and "
      "copy it\n"
      "# to bridges at the other end. To give an id up, remove its line and send SIGHUP to the bridge.\n"
      "version: 1\n"
      "topics:\n"
      "  - {service: 0x61ac, topic: /sensing/imu, type: sensor_msgs/msg/Imu}\n"
      "  - {service: 0x000a, topic: /sensing/points, type: sensor_msgs/msg/PointCloud2}\n");
  EXPECT_EQ(files(), 1U) << "and nothing is left beside it";
}

TEST_F(LockFiles, ComeBackAsTheyWere) {
  LockFile lock = read();
  ASSERT_TRUE(lock.add({points, imu}));
  ASSERT_TRUE(lock.add({early}));
  for (const LockFile& one : {lock, read()}) {
    EXPECT_EQ(told(one.topics()), told({early, imu, points}));
    ASSERT_NE(one.find("/sensing/imu"), nullptr);
    EXPECT_EQ(one.find("/sensing/imu")->service, ServiceId{0x61ac});
    EXPECT_EQ(one.find("/sensing"), nullptr);
    EXPECT_EQ(one.find("/zzz"), nullptr);
    EXPECT_TRUE(one.has(ServiceId{0x6fff}));
    EXPECT_FALSE(one.has(ServiceId{0x6000}));
  }
  EXPECT_EQ(read().find("/sensing/imu")->mark, (documents::Mark{7, 5}));
}

TEST_F(LockFiles, MayBeWrittenByHand) {
  write(
      "topics:\n- type: std_msgs/msg/String\n  topic: /b\n  service: 24577\n- {topic: /a, service: 0x1, "
      "type: "
      "std_msgs/msg/String}\nversion: 1\n");
  EXPECT_EQ(told(read().topics()),
            (std::vector<std::tuple<std::string, std::string, int>>{{"/a", "std_msgs/msg/String", 1},
                                                                    {"/b", "std_msgs/msg/String", 0x6001}}));
}

TEST_F(LockFiles, KeepWhichTopicsAreLatched) {
  LockFile lock = read();
  ASSERT_TRUE(lock.add({{"/map", "nav_msgs/msg/OccupancyGrid", ServiceId{0x6002}, true}, imu}));
  EXPECT_THAT(text(), HasSubstr("topics:\n"
                                "  - {service: 0x6002, topic: /map, type: nav_msgs/msg/OccupancyGrid, "
                                "durability: transient_local}\n"
                                "  - {service: 0x61ac, topic: /sensing/imu, type: sensor_msgs/msg/Imu}\n"));
  LockFile again = read();
  ASSERT_TRUE(again.add({points}));
  EXPECT_TRUE(read().find("/map")->transient_local);
  EXPECT_FALSE(read().find("/sensing/imu")->transient_local);
  const std::string head = "version: 1\ntopics:\n  - {service: 1, topic: /a, type: a/msg/A, durability: ";
  EXPECT_THAT(problems(head + "volatile}\n"), ElementsAre("no errors"));
  EXPECT_THAT(problems(head + "latched}\n"),
              ElementsAre("trestle.lock:3:56: error: durability: expected one of volatile, transient_local, "
                          "found 'latched'"));
}

TEST_F(LockFiles, AreRefusedWithThePlaceWhenTheyAreDamaged) {
  const std::string head = "version: 1\ntopics:\n";
  const std::string good = "  - {service: 0x6001, topic: /a, type: std_msgs/msg/String}\n";
  EXPECT_THAT(problems(head + good), ElementsAre("no errors"));
  EXPECT_THAT(problems(""), ElementsAre("trestle.lock:1:1: error: the file is empty: expected 'version' and "
                                        "'topics' (remove the file to begin anew)"));
  EXPECT_THAT(problems(head),
              ElementsAre(HasSubstr("trestle.lock:2:1: error: topics: expected a list of topics "
                                    "(remove the file to begin anew), found nothing")));
  EXPECT_THAT(problems("topics:\n" + good), ElementsAre(HasSubstr("'version' is missing")));
  EXPECT_THAT(problems("version: 2\ntopics:\n" + good),
              ElementsAre("trestle.lock:1:10: error: version: expected 1, the only one that this program "
                          "knows, found '2'"));
  EXPECT_THAT(problems(head + "  - {service: 0x60"), ElementsAre(HasSubstr("error: not valid YAML")));
  EXPECT_THAT(
      problems(head + "  - {service: 0x0, topic: a b, type: String, x: 1}\n"),
      ElementsAre(HasSubstr("trestle.lock:3:15: error: service: expected an id from 0x0001 to 0xfffd"),
                  HasSubstr("trestle.lock:3:27: error: topic: expected a topic such as"),
                  HasSubstr("trestle.lock:3:38: error: type: expected a message type such as"),
                  HasSubstr("trestle.lock:3:46: error: unknown key 'x' in topic")));
  EXPECT_THAT(problems(head + "  - {topic: /a, type: std_msgs/msg/String}\n"),
              ElementsAre(HasSubstr("trestle.lock:3:5: error: topic: 'service' is missing")));
  EXPECT_THAT(problems(head + good + "  - {service: 0x6002, topic: /a, type: std_msgs/msg/String}\n"),
              ElementsAre("trestle.lock:4:5: error: topic: /a stands here twice, first in line 3: remove the "
                          "line whose id nobody uses"));
  EXPECT_THAT(
      problems(head + good + "  - {service: 0x6001, topic: /b, type: std_msgs/msg/String}\n"),
      ElementsAre("trestle.lock:4:5: error: service: 0x6001 is that of /a in line 3: remove one of the "
                  "two lines"));
  EXPECT_THAT(problems(std::string((1U << 20U) + 1, '#')), ElementsAre(HasSubstr("larger than 1 MiB")));
}

TEST_F(LockFiles, AreNotReadFromAFolder) {
  fs::create_directory(file());
  const auto lock = LockFile::read(file());
  ASSERT_FALSE(lock.has_value());
  EXPECT_THAT(lines(lock.error()), ElementsAre(file() + ": error: cannot be read: it is a folder"));
}

TEST_F(LockFiles, StayAsTheyWereWhenTheDiskIsFull) {
  LockFile lock = read();
  ASSERT_TRUE(lock.add({imu}));
  const std::string before = text();
  // A file may grow to some bytes, and then no more, as on a full disk.
  struct rlimit usual {};
  getrlimit(RLIMIT_FSIZE, &usual);
  const auto usual_action = std::signal(SIGXFSZ, SIG_IGN);
  const struct rlimit small { before.size() / 2, usual.rlim_max };
  setrlimit(RLIMIT_FSIZE, &small);
  const auto written = lock.add({points});
  setrlimit(RLIMIT_FSIZE, &usual);
  std::signal(SIGXFSZ, usual_action);
  ASSERT_FALSE(written.has_value());
  EXPECT_EQ(written.error(), file() + " cannot be written: " + folder_ + ".trestle.lock.new: File too large");
  EXPECT_EQ(text(), before);
  EXPECT_EQ(files(), 1U) << "nothing half-written is left";
  EXPECT_EQ(lock.find("/sensing/points"), nullptr);
  EXPECT_TRUE(lock.add({points})) << "when there is room again";
  EXPECT_EQ(told(read().topics()), told({imu, points}));
}

TEST_F(LockFiles, SayWhereTheyCannotBeWritten) {
  LockFile lock = read();
  fs::remove_all(folder_);
  const auto gone = lock.add({imu});
  ASSERT_FALSE(gone.has_value());
  EXPECT_EQ(gone.error(),
            file() + " cannot be written: " + folder_ + ".trestle.lock.new: No such file or directory");
  fs::create_directories(folder_ + ".trestle.lock.new");
  const auto in_the_way = lock.add({imu});
  ASSERT_FALSE(in_the_way.has_value());
  EXPECT_EQ(in_the_way.error(),
            file() + " cannot be written: " + folder_ + ".trestle.lock.new: Is a directory");
  EXPECT_EQ(documents::replace_file("/proc/trestle.lock", "x", documents::Outlives::a_power_failure)
                .error()
                .substr(0, 37),
            "/proc/trestle.lock cannot be written:");
  EXPECT_TRUE(lock.topics().empty());
}

TEST_F(LockFiles, AreNotWrittenOverWhatSomebodyElseWrote) {
  LockFile ours = read();
  LockFile theirs = read();
  ASSERT_TRUE(theirs.add({imu}));
  const auto written = ours.add({points});
  ASSERT_FALSE(written.has_value());
  EXPECT_EQ(written.error(),
            file() + " was changed or removed since this bridge read it; send SIGHUP to read it again");
  EXPECT_EQ(told(read().topics()), told({imu}));
  fs::remove(file());
  EXPECT_FALSE(theirs.add({points}));
  EXPECT_EQ(files(), 0U);
}

TEST_F(LockFiles, MayBeSymbolicLinks) {
  fs::create_directory(folder_ + "elsewhere");
  std::ofstream{folder_ + "elsewhere/real.lock"}
      << "version: 1\ntopics:\n  - {service: 0x6001, topic: /b, type: std_msgs/msg/String}\n";
  fs::create_symlink("elsewhere/real.lock", file());
  LockFile lock = read();
  ASSERT_TRUE(lock.add({imu}));
  EXPECT_TRUE(fs::is_symlink(file()));
  EXPECT_FALSE(fs::is_symlink(folder_ + "elsewhere/real.lock"));
  EXPECT_EQ(LockFile::read(folder_ + "elsewhere/real.lock")->topics().size(), 2U);
}

}  // namespace
}  // namespace trestle::test::lock_file_test
