#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>

#include "bridge/carry/config/load.hpp"
#include "test/source_dir.hpp"

/// The configurations that users copy from must be good ones.
namespace trestle::test::documents_test {
namespace {

using namespace carry;

std::string problems(const tl::expected<Loaded, std::vector<documents::Problem>>& loaded) {
  std::string text;
  for (const documents::Problem& problem : loaded ? loaded->warnings : loaded.error()) {
    text += to_string(problem) + "\n";
  }
  return text;
}

// As it stands inside a route.
std::string indented(const std::string& block) {
  std::istringstream in{block};
  std::string text;
  for (std::string line; std::getline(in, line);) {
    text += "    " + line + "\n";
  }
  return text;
}

/// A block of a document is a whole file when it says where SOME/IP is and what is routed; else it is a part
/// of one, and what is missing around it is added.
std::string completed(const std::string& block) {
  const std::string someip = "someip: {address: 127.0.0.1}\n";
  const std::string route =
      "routes:\n  - topic: /a\n    type: std_msgs/msg/String\n    direction: dds_to_someip\n    service: 1\n"
      "    instance: 1\n    eventgroup: 1\n    event: 0x8001\n    port: 40000\n";
  if (block.starts_with("wire:") || block.starts_with("tp:") || block.starts_with("qos:") ||
      block.starts_with("multicast:")) {
    return someip + route + indented(block);
  }
  if (block.starts_with("e2e:")) {  // with keys of receivers
    std::string receiving = route;
    receiving.replace(receiving.find("dds_to_someip"), 13, "someip_to_dds");
    return someip + receiving + indented(block);
  }
  const bool has_someip = block.find("someip:") != std::string::npos;
  const bool has_routes = block.find("routes:") != std::string::npos;
  return (has_someip ? "" : someip) + block + (has_routes ? "" : route);
}

TEST(Examples, AreGood) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator{test::source_dir() + "/examples"}) {
    if (entry.path().extension() == ".yaml") {
      EXPECT_EQ(problems(load_config(entry.path().string())), "");
      ++count;
    }
  }
  EXPECT_GE(count, 3);
}

TEST(Documents, ShowGoodConfigurations) {
  int count = 0;
  for (const char* name : {"docs/configuration.md", "docs/cli.md", "README.md"}) {
    std::ifstream in{test::source_dir() + "/" + name};
    const std::string text{std::istreambuf_iterator<char>{in}, {}};
    ASSERT_FALSE(text.empty()) << name;
    for (std::size_t begin = 0; (begin = text.find("```yaml\n", begin)) != std::string::npos;) {
      begin += 8;
      const std::size_t end = text.find("```", begin);
      const std::string block = text.substr(begin, end - begin);
      begin = end;
      EXPECT_EQ(problems(parse_config(completed(block), test::source_dir() + "/docs/block.yaml")), "")
          << name << ":\n"
          << block;
      ++count;
    }
  }
  EXPECT_GE(count, 6);
}

TEST(Documents, NameEveryKey) {
  std::ifstream in{test::source_dir() + "/docs/configuration.md"};
  const std::string text{std::istreambuf_iterator<char>{in}, {}};
  // An unknown key makes the reader list those it knows.
  const auto loaded = parse_config(
      "zzzzzzzzz: 1\nsomeip: {zzzzzzzzz: 1, sd: {zzzzzzzzz: 1}, access: {zzzzzzzzz: 1, rules: [{zzzzzzzzz: "
      "1}]}, tls: {zzzzzzzzz: 1}}\ndds: {zzzzzzzzz: 1, security: {zzzzzzzzz: "
      "1}}\ntypes: {zzzzzzzzz: 1}\n"
      "routes:\n  - {zzzzzzzzz: 1, wire: {zzzzzzzzz: 1, types: {a/msg/B: {zzzzzzzzz: 1}}}, tp: {zzzzzzzzz: "
      "1}, qos: {zzzzzzzzz: 1}, multicast: {zzzzzzzzz: 1}}\nmethods:\n  - {zzzzzzzzz: 1}\n"
      "fields:\n  - {zzzzzzzzz: 1, e2e: {zzzzzzzzz: 1}}\nactions:\n  - {zzzzzzzzz: 1, e2e: {zzzzzzzzz: 1}}\n"
      "patterns:\n  - {zzzzzzzzz: 1, direction: dds_to_someip}\n  - {zzzzzzzzz: "
      "1, direction: "
      "someip_to_dds}\n",
      "b.yaml");
  ASSERT_FALSE(loaded.has_value());
  int sections = 0;
  for (const documents::Problem& problem : loaded.error()) {
    const std::size_t list = problem.text.find("known here: ");
    if (list == std::string::npos) {
      continue;
    }
    ++sections;
    const std::string keys = problem.text.substr(list + 12);
    std::istringstream words{keys};
    for (std::string key; std::getline(words >> std::ws, key, ',');) {
      EXPECT_NE(text.find("`" + key + "`"), std::string::npos) << key << " is not documented";
    }
  }
  EXPECT_EQ(sections, 22);
}

}  // namespace
}  // namespace trestle::test::documents_test
