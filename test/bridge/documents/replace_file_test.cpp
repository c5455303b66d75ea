#include "bridge/documents/replace_file.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <sys/file.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "bridge/documents/document.hpp"

namespace trestle::documents {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class ReplaceFile : public testing::TestWithParam<Outlives> {
 protected:
  ReplaceFile() { fs::create_directories(folder_); }
  ~ReplaceFile() override { fs::remove_all(folder_); }

  /// Empty: it was replaced.
  static std::string fault(const fs::path& file, std::string_view text) {
    const auto done = replace_file(file, text, GetParam());
    return done ? std::string{} : done.error();
  }
  [[nodiscard]] std::vector<std::string> names() const {
    std::vector<std::string> all;
    for (const fs::directory_entry& one : fs::directory_iterator{folder_}) {
      all.push_back(one.path().filename());
    }
    return all;
  }

  const fs::path folder_ = testing::TempDir() + "trestle-replace-" + std::to_string(getpid());
};

TEST_P(ReplaceFile, KeepsRightsAndLinks) {
  std::ofstream{folder_ / "real"} << "old and longer";
  constexpr auto rights = fs::perms::owner_read | fs::perms::owner_write | fs::perms::group_read;
  fs::permissions(folder_ / "real", rights);
  fs::create_symlink("real", folder_ / "link");
  EXPECT_EQ(fault(folder_ / "link", "new"), "");
  EXPECT_TRUE(fs::is_symlink(folder_ / "link"));
  EXPECT_EQ(read_text_file(folder_ / "real"), "new");
  EXPECT_EQ(fs::status(folder_ / "real").permissions(), rights);
  EXPECT_THAT(names(), testing::UnorderedElementsAre("link", "real"));
}

TEST_P(ReplaceFile, TakesNamesAsLongAsTheyMayBe) {
  const std::string name(255, 'n');
  EXPECT_EQ(fault(folder_ / name, "new"), "");
  EXPECT_EQ(read_text_file(folder_ / name), "new");
  EXPECT_THAT(names(), testing::ElementsAre(name));
}

TEST_P(ReplaceFile, LeavesWhatIsNoFileAndWhatAnotherProcessIsWriting) {
  ASSERT_EQ(::mkfifo((folder_ / "pipe").c_str(), 0600), 0);
  EXPECT_EQ(fault(folder_ / "pipe", "new"),
            (folder_ / "pipe").string() + " cannot be written: it is no file");
  EXPECT_TRUE(fs::is_fifo(folder_ / "pipe"));
  EXPECT_THAT(fault(folder_ / "none" / "file", "new"), HasSubstr(".file.new: No such file or directory"));
  std::ofstream{folder_ / "file"} << "old";
  const int other = ::open((folder_ / ".file.new").c_str(), O_CREAT | O_WRONLY, 0600);  // NOLINT(*-vararg)
  ASSERT_EQ(::flock(other, LOCK_EX), 0);
  ASSERT_EQ(::write(other, "theirs", 6), 6);
  EXPECT_THAT(fault(folder_ / "file", "new"), HasSubstr(".file.new: Resource temporarily unavailable"));
  EXPECT_EQ(read_text_file(folder_ / ".file.new"), "theirs");
  EXPECT_EQ(read_text_file(folder_ / "file"), "old");
  ::close(other);  // killed, and what it has left is no harm
  EXPECT_EQ(fault(folder_ / "file", "new"), "");
  EXPECT_EQ(read_text_file(folder_ / "file"), "new");
}

INSTANTIATE_TEST_SUITE_P(Both, ReplaceFile,
                         testing::Values(Outlives::the_program, Outlives::a_power_failure));

TEST(ReadTextFile, ReadsOneByteMoreThanItMay) {
  EXPECT_EQ(read_text_file("/dev/zero", 10'000), std::string(10'001, '\0'));
  EXPECT_EQ(read_text_file("/dev/zero", 0), std::string(1, '\0'));
  EXPECT_EQ(read_text_file("/dev/null", 10), "");
}

}  // namespace
}  // namespace trestle::documents
