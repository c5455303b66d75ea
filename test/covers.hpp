#pragma once
#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <initializer_list>
#include <string>

namespace trestle::test {

/// When a test passes that called `covers`, adds the line "suite.test<TAB>ids" to the file that the
/// environment variable TRESTLE_COVERED names. Test programs share that file: each line is one write, so
/// programs side by side do no harm.
class CoveredLog : public testing::EmptyTestEventListener {
 public:
  void OnTestEnd(const testing::TestInfo& test) override {
    const char* const file = std::getenv("TRESTLE_COVERED");
    const testing::TestResult& result = *test.result();
    for (int i = 0; file != nullptr && result.Passed() && i < result.test_property_count(); ++i) {
      if (result.GetTestProperty(i).key() == std::string{"covers"}) {
        write_line(file, std::string{test.test_suite_name()} + "." + test.name() + "\t" +
                             result.GetTestProperty(i).value() + "\n");
      }
    }
  }

 private:
  static void write_line(const char* file, const std::string& line) {
    const int log = ::open(file, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
    if (log < 0 || ::write(log, line.data(), line.size()) != static_cast<ssize_t>(line.size())) {
      ADD_FAILURE() << "cannot write to " << file << ", named by TRESTLE_COVERED";
    }
    ::close(log);
  }
};

/// Present once in each test program that includes this file.
inline const bool covered_log_listens = [] {
  testing::UnitTest::GetInstance()->listeners().Append(new CoveredLog);  // NOLINT: gtest deletes it
  return true;
}();

/// Records which requirements of the Open SOME/IP Specification the running test covers: in the XML report,
/// and in the log that docs/coverage.md is made from. Call it once in a test, and write the ids out:
/// coverage.py finds them in the source too.
inline void covers(std::initializer_list<const char*> requirement_ids) {
  std::string joined;
  for (const char* id : requirement_ids) {
    joined += joined.empty() ? "" : " ";
    joined += id;
  }
  testing::Test::RecordProperty("covers", joined);
}

}  // namespace trestle::test
