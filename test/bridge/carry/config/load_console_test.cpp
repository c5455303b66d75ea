#include "bridge/carry/config/load_console.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include "test/bridge/carry/config/problems_of.hpp"

namespace trestle::test::load_console_test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::optional<Endpoint> read(const char* text) {
  return carry::console_address().read(text);
}

TEST(ConsoleAddress, HasAnAddressAndPerhapsAPort) {
  EXPECT_EQ(read("127.0.0.1:80"), (Endpoint{IpAddress::v4(127, 0, 0, 1), 80}));
  EXPECT_EQ(read("10.0.0.1"), (Endpoint{IpAddress::v4(10, 0, 0, 1), 9464}));
  EXPECT_TRUE(read("[::1]:80")->address.v6);
  EXPECT_EQ(read("[::1]:80")->port, 80);
  EXPECT_EQ(read("::1")->port, 9464);
  for (const char* const wrong : {"", "localhost:1", "127.0.0.1:0", "127.0.0.1:65536", "127.0.0.1:", "[::1",
                                  "[127.0.0.1]:1", "[::1]80", "224.0.0.1:80", "127.0.0.1:80:1", ":80"}) {
    EXPECT_FALSE(read(wrong)) << wrong;
  }
}

TEST(LoadConfig, HasNoConsoleUnlessTold) {
  EXPECT_FALSE(config_of(good_config).console);
}

TEST(LoadConfig, ReadsTheConsole) {
  const auto plain = config_of(std::string{good_config} + "console: {}\n").console;
  ASSERT_TRUE(plain);
  EXPECT_EQ(plain->at, (Endpoint{IpAddress::v4(127, 0, 0, 1), 9464}));
  const auto open =
      config_of(std::string{good_config} + "console: {address: 0.0.0.0:80, token_file: keys/token}\n")
          .console;
  ASSERT_TRUE(open);
  EXPECT_EQ(open->at, (Endpoint{IpAddress::v4(0, 0, 0, 0), 80}));
  EXPECT_EQ(open->token_file, "keys/token");
}

TEST(LoadConfig, ReadsWhereTheConsoleMayMakeRecords) {
  const auto records_of = [](const char* console, const char* file) {
    const auto loaded = carry::parse_config(std::string{good_config} + console, file);
    return loaded ? loaded->records : carry::ConsoleRecords{"errors"};
  };
  EXPECT_EQ(records_of("console: {}\n", "b.yaml").folder, "");
  EXPECT_EQ(records_of("console: {records: /data/records}\n", "b.yaml").folder, "/data/records");
  const carry::ConsoleRecords beside = records_of("console: {records: no/where}\n", "b.yaml");
  EXPECT_EQ(beside.folder, "no/where");
  EXPECT_EQ(beside.mark.column, 20);
  EXPECT_EQ(fault_of(beside, "b.yaml"),
            fmt::format("b.yaml:{}:20: records: 'no/where' is no folder that can be written to: No such "
                        "file or directory",
                        beside.mark.line));
  EXPECT_THAT(fault_of(carry::ConsoleRecords{"/dev/null", {}}, "b.yaml"), HasSubstr("Not a directory"));
  EXPECT_EQ(fault_of(carry::ConsoleRecords{"/", {}}, "b.yaml").empty(), ::access("/", W_OK) == 0);
  EXPECT_EQ(fault_of(carry::ConsoleRecords{}, "b.yaml"), "");
}

TEST(LoadConfig, AsksForATokenWhereOthersReachTheConsole) {
  EXPECT_THAT(
      problems_of(std::string{good_config} + "console: {address: 10.0.0.1:80}\n"),
      ElementsAre(HasSubstr("address: 10.0.0.1 is reached from other hosts: `token_file` is needed")));
  EXPECT_THAT(problems_of(std::string{good_config} + "console: {adress: 10.0.0.1:80}\n"),
              ElementsAre(HasSubstr("did you mean 'address'?")));
}

}  // namespace
}  // namespace trestle::test::load_console_test
