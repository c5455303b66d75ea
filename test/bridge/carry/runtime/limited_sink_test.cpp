#include "bridge/carry/runtime/limited_sink.hpp"

#include <gmock/gmock.h>
#include <spdlog/logger.h>
#include <spdlog/sinks/ostream_sink.h>

#include <memory>
#include <sstream>

namespace trestle::carry::limited_sink_test {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(LimitedSink, LeavesLinesOutWhileTheyWouldHaveToWaitAndSaysHowMany) {
  std::ostringstream text;
  bool takes = true;
  spdlog::logger logger{"test",
                        std::make_shared<LimitedSink>(std::make_shared<spdlog::sinks::ostream_sink_mt>(text),
                                                      [&takes] { return takes; })};
  logger.info("first");
  takes = false;
  logger.info("second");
  logger.info("third");
  logger.flush();
  EXPECT_THAT(text.str(), HasSubstr("first"));
  EXPECT_THAT(text.str(), Not(HasSubstr("left out")));
  takes = true;
  logger.info("fourth");
  EXPECT_THAT(text.str(), Not(HasSubstr("second")));
  EXPECT_THAT(text.str(), HasSubstr("2 lines of the log were left out here"));
  EXPECT_THAT(text.str(), HasSubstr("fourth"));
}

}  // namespace
}  // namespace trestle::carry::limited_sink_test
