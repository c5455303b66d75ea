#include "bridge/generate/folder_lock.hpp"

#include <gmock/gmock.h>
#include <unistd.h>

#include <fstream>

namespace trestle::generate {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using testing::EndsWith;

class FolderLocks : public testing::Test {
 protected:
  ~FolderLocks() override { fs::remove_all(folder_); }
  /// Of one that does not wait; empty: it has got the folder.
  static std::string fault(const fs::path& folder) {
    try {
      const FolderLock lock{folder, 0s};
      return {};
    } catch (const std::runtime_error& error) {
      return error.what();
    }
  }
  const fs::path folder_ = testing::TempDir() + "trestle-folder-" + std::to_string(getpid());
};

TEST_F(FolderLocks, AreHadByOneAtATime) {
  {
    const FolderLock lock{folder_};
    std::ofstream{folder_ / "file"} << "text";
    EXPECT_EQ(fault(folder_),
              folder_.string() +
                  " has been used by another `trestle generate` for 0 s: let that one end, and "
                  "run this one again");
    EXPECT_EQ(fault(folder_ / "inner"), "") << "another folder";
  }
  EXPECT_EQ(fault(folder_), "");
  EXPECT_TRUE(fs::exists(folder_ / "file"));
}

TEST_F(FolderLocks, RemoveTheFoldersThatTheyMadeForNothing) {
  fs::create_directories(folder_);
  EXPECT_EQ(fault(folder_ / "a" / "b" / ""), "");
  EXPECT_TRUE(fs::is_empty(folder_));
  {
    const FolderLock lock{folder_ / "a" / "b"};
    std::ofstream{folder_ / "a" / "file"} << "text";
  }
  EXPECT_TRUE(fs::exists(folder_ / "a" / "file"));
  EXPECT_FALSE(fs::exists(folder_ / "a" / "b"));
  EXPECT_THAT(fault(folder_ / "a" / "file"), EndsWith("/a/file is no folder"));
  EXPECT_THAT(fault(folder_ / "a" / "file" / "b"), EndsWith("/a/file/b cannot be made: Not a directory"));
}

}  // namespace
}  // namespace trestle::generate
