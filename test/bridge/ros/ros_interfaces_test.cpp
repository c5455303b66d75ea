// What the bridge makes of ROS 2's interfaces, beside what ROS 2 itself makes of them.
#include <gmock/gmock.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

#include "bridge/messages/types/literals.hpp"
#include "bridge/messages/types/number_text.hpp"
#include "bridge/messages/types/type_hash.hpp"
#include "bridge/messages/values/message_values.hpp"
#include "test/bridge/messages/convert/profiles.hpp"
#include "test/bridge/messages/convert/support.hpp"
#include "test/bridge/ros/random_values.hpp"
#include "test/source_dir.hpp"

namespace trestle::ros_interfaces_test {
namespace {

using namespace trestle::messages;
using namespace trestle::test;
namespace fs = std::filesystem;

const fs::path folder = test::source_dir() + "/test/bridge/ros";

/// A line of golden.txt.
struct Golden {
  std::string type;
  std::string hash;
  std::vector<std::byte> sample;  ///< empty: a service, an action, or of a package without type support
  std::string json;
};

const std::vector<Golden>& goldens() {
  static const std::vector<Golden> all = [] {
    std::vector<Golden> result;
    std::ifstream in{folder / "golden.txt"};
    for (std::string line; std::getline(in, line);) {
      std::istringstream words{line};
      Golden golden;
      std::string sample;
      words >> golden.type >> golden.hash >> sample >> std::ws;
      std::getline(words, golden.json);
      golden.sample = hex(sample);
      result.push_back(std::move(golden));
    }
    return result;
  }();
  return all;
}

TypeLibrary library() {
  return TypeLibrary{{folder / "interfaces"}};
}

/// The interfaces that are files below a folder: "pkg/msg/Type", "pkg/srv/Name".
std::vector<std::string> interfaces_in(const fs::path& root, std::string_view extension = {}) {
  std::vector<std::string> names;
  for (const auto& file : fs::recursive_directory_iterator{root}) {
    const std::string name = file.path().lexically_relative(root).replace_extension().generic_string();
    const auto parts = interface_name(name);
    if (file.is_regular_file() && parts && parts->full() == name &&
        (extension.empty() || file.path().extension() == extension)) {
      names.push_back(name);
    }
  }
  return names;
}

std::vector<std::string> messages_of(const std::vector<std::string>& interfaces) {
  std::vector<std::string> names;
  for (const std::string& interface : interfaces) {
    const auto kind = interface_name(interface)->kind;
    if (kind == InterfaceKind::message) {
      names.push_back(interface);
    } else if (kind == InterfaceKind::service) {
      for (const char* const part : {"_Request", "_Response", "_Event"}) {
        names.push_back(interface + part);
      }
    } else {
      for (const char* const part :
           {"_SendGoal_Request", "_SendGoal_Response", "_SendGoal_Event", "_GetResult_Request",
            "_GetResult_Response", "_GetResult_Event", "_FeedbackMessage", "_Goal", "_Result", "_Feedback"}) {
        names.push_back(interface + part);
      }
    }
  }
  return names;
}

/// Every message of every interface that is built in or stands in interfaces/.
std::vector<std::string> all_messages() {
  std::vector<std::string> interfaces = TypeLibrary::builtin_names();
  const auto more = interfaces_in(folder / "interfaces");
  interfaces.insert(interfaces.end(), more.begin(), more.end());
  return messages_of(interfaces);
}

/// A number in one of the ways to write it.
std::string plain_value(const FieldType& type, const DefaultElement& element) {
  if (type.primitive == Primitive::float32 || type.primitive == Primitive::float64) {
    return shortest(read_float<double>(element.text).value_or(0));
  }
  const auto whole = width(*type.primitive) == 0 ? std::nullopt : read_signed(element.text);
  return whole ? (whole->negative ? "-" : "") + std::to_string(whole->magnitude) : element.text;
}

/// What a message says, whether an .msg or an .idl file says it: in IDL a char of .msg is a uint8.
std::string described(const MessageDefinition& message) {
  std::ostringstream text;
  const auto name_of = [](Primitive type) {
    return to_string(type == Primitive::character ? Primitive::uint8 : type);
  };
  for (const Field& field : message.fields) {
    text << field.name << ' '
         << (field.type.primitive ? name_of(*field.type.primitive) : field.type.message.c_str()) << '<'
         << field.type.string_bound << '[' << static_cast<int>(field.type.array) << ' '
         << field.type.array_size;
    for (const DefaultElement& element : default_elements(field)) {
      text << " = " << plain_value(field.type, element);
    }
    text << '\n';
  }
  for (const Constant& constant : message.constants) {
    Field as_field;
    as_field.type.primitive = constant.type;
    as_field.default_value = constant.value;
    text << constant.name << ' ' << name_of(constant.type) << " = "
         << plain_value(as_field.type, default_elements(as_field).at(0)) << '\n';
  }
  return text.str();
}

/// The sample in hexadecimal. rmw_serialize() gives it the size that it estimated, which is too large for
/// some messages; what goes over the network is not.
/// @param size  of our sample.
std::string without_surplus(ByteView sample, std::size_t size) {
  const auto is_zero = [](std::byte one) { return one == std::byte{0}; };
  const bool surplus = size < sample.size() && std::ranges::all_of(sample.subspan(size), is_zero);
  return to_hex(surplus ? sample.first(size) : sample);
}

/// Every member has a tag: its place in the message.
MessageRules tagged(const TypeTree& tree) {
  MessageRules rules;
  rules.payload.struct_length = someip::FieldWidth::bits32;
  for (const MessageDefinition& message : tree.messages) {
    std::uint16_t id = 0;
    for (const Field& field : message.fields) {
      rules.types[message.name].tags[field.name] = someip::DataId{id++};
    }
  }
  return rules;
}

std::vector<std::pair<std::string, MessageRules>> profiles(const TypeTree& tree) {
  std::vector<std::pair<std::string, MessageRules>> all;
  for (const char* const name : {"commonapi", "autosar", "commonapi_little", "little", "short", "utf16le",
                                 "utf16be_plain", "aligned4", "aligned32"}) {
    all.emplace_back(name, profile(name));
  }
  MessageRules legacy = profile("legacy_strings");
  legacy.payload.string_length = someip::FieldWidth::bits16;
  all.emplace_back("legacy strings", legacy);
  legacy.payload.string_encoding = someip::StringEncoding::utf16be;
  all.emplace_back("legacy strings in UTF-16", legacy);
  all.emplace_back("tags", tagged(tree));
  all.emplace_back("tags, smallest lengths", tagged(tree));
  all.back().second.payload.smallest_tagged_length = true;
  all.back().second.payload.byte_order = std::endian::little;
  return all;
}

void expect_round_trip(const TypeTree& tree, ByteView sample) {
  for (const auto& [name, rules] : profiles(tree)) {
    SCOPED_TRACE(name);
    const auto plan = ConversionPlan::compile(tree, rules);
    ASSERT_TRUE(plan) << plan.error();
    ConversionScratch scratch;
    const auto payload = plan->cdr_to_someip(sample, scratch);
    ASSERT_TRUE(payload) << to_string(payload.error());
    EXPECT_EQ(to_cdr(*plan, joined(*payload)), to_hex(sample));
  }
}

TEST(RosInterfaces, AreAllThere) {
  std::set<std::string> hashed;
  for (const Golden& golden : goldens()) {
    hashed.insert(golden.type);
  }
  EXPECT_EQ(hashed.size(), 461U);
  EXPECT_EQ(std::ranges::count_if(goldens(), [](const Golden& one) { return !one.sample.empty(); }), 408);
  // 161 built in, 13 of test_msgs, 71 of Autoware, 1 that these need; (29 + 3 + 12) services; (1 + 2) actions
  const auto messages = all_messages();
  EXPECT_EQ(messages.size(), 161 + 13 + 71 + 1 + 3 * (29 + 3 + 12) + 10 * (1 + 2));
  for (const std::string& name : messages) {
    EXPECT_TRUE(hashed.contains(name)) << name;
  }
}

TEST(RosInterfaces, HaveTheHashesOfRosidl) {
  TypeLibrary types = library();
  for (const Golden& golden : goldens()) {
    const auto hash = type_hash(types, golden.type);
    EXPECT_EQ(hash ? *hash : to_string(hash.error()), golden.hash) << golden.type;
  }
}

TEST(RosInterfaces, AreSerializedAsByRosidl) {
  TypeLibrary types = library();
  for (const Golden& golden : goldens()) {
    if (golden.sample.empty()) {
      continue;
    }
    SCOPED_TRACE(golden.type + " " + golden.json.substr(0, 500));
    const auto tree = types.resolve(golden.type);
    ASSERT_TRUE(tree) << to_string(tree.error());
    const auto values = MessageValues::make(*tree);
    ASSERT_TRUE(values) << values.error();
    const auto sample = values->parse_sample(golden.json, ValueForm::json);
    ASSERT_TRUE(sample) << to_string(sample.error());
    EXPECT_EQ(to_hex(*sample), without_surplus(golden.sample, sample->size()));
    const auto printed = values->print_sample(golden.sample, ValueForm::json);
    ASSERT_TRUE(printed) << printed.error();
    EXPECT_EQ(values->parse_sample(*printed, ValueForm::json), *sample);
    expect_round_trip(*tree, *sample);
    // Its own one, too, with its surplus.
    ConversionScratch scratch;
    const auto payload = ConversionPlan::compile(*tree, {})->cdr_to_someip(golden.sample, scratch);
    EXPECT_TRUE(payload) << to_string(payload.error());
  }
}

TEST(RosInterfaces, SayTheSameInIdl) {
  TypeLibrary as_msg = library();
  TypeLibrary as_idl{{folder / "idl"}};
  const auto interfaces = interfaces_in(folder / "idl");
  ASSERT_EQ(interfaces.size(), 18U);
  for (const std::string& name : messages_of(interfaces)) {
    SCOPED_TRACE(name);
    const auto one = as_msg.resolve(name);
    const auto other = as_idl.resolve(name);
    ASSERT_TRUE(one) << to_string(one.error());
    ASSERT_TRUE(other) << to_string(other.error());
    EXPECT_TRUE(other->root().file.ends_with(".idl")) << other->root().file;
    EXPECT_EQ(described(other->root()), described(one->root()));
    EXPECT_EQ(type_hash(as_idl, name).value_or("none"), type_hash(as_msg, name).value_or("no hash"));
  }
}

/// The folder share/ of a ROS 2 installation in TRESTLE_ROS_SHARE.
TEST(InstalledInterfaces, SayTheSameInIdl) {
  const char* const variable = std::getenv("TRESTLE_ROS_SHARE");  // NOLINT(concurrency-mt-unsafe)
  if (variable == nullptr) {
    GTEST_SKIP() << "no ROS 2 to compare with";
  }
  const fs::path share = variable;
  const fs::path only_idl = fs::path{testing::TempDir()} / ("trestle_only_idl_" + std::to_string(getpid()));
  fs::remove_all(only_idl);
  const auto interfaces = interfaces_in(share, ".idl");
  EXPECT_GT(interfaces.size(), 190U);
  for (const std::string& name : interfaces) {
    fs::create_directories((only_idl / name).parent_path());
    fs::copy(share / (name + ".idl"), only_idl / (name + ".idl"));
  }
  TypeLibrary as_msg{{share}};
  TypeLibrary as_idl{{only_idl}};
  for (const std::string& name : messages_of(interfaces)) {
    SCOPED_TRACE(name);
    const auto one = as_msg.resolve(name);
    const auto other = as_idl.resolve(name);
    ASSERT_TRUE(one) << to_string(one.error());
    ASSERT_TRUE(other) << to_string(other.error());
    EXPECT_EQ(described(other->root()), described(one->root()));
    EXPECT_EQ(type_hash(as_idl, name).value_or("none"), type_hash(as_msg, name).value_or("no hash"));
  }
  fs::remove_all(only_idl);
}

TEST(RosInterfaces, SurviveEveryProfile) {
  TypeLibrary types = library();
  for (const std::string& name : all_messages()) {
    SCOPED_TRACE(name);
    const auto tree = types.resolve(name);
    ASSERT_TRUE(tree) << to_string(tree.error());
    const auto values = MessageValues::make(*tree);
    ASSERT_TRUE(values) << values.error();
    std::mt19937 random{20};  // NOLINT(*-msc51-cpp): the same numbers each time
    for (int round = 0; round < 4; ++round) {
      const std::string json = random_values(*tree, random).dump();
      SCOPED_TRACE(json);
      const auto sample = values->parse_sample(json, ValueForm::json);
      ASSERT_TRUE(sample) << to_string(sample.error());
      expect_round_trip(*tree, *sample);
    }
    if (HasFailure()) {
      return;  // one is enough to read
    }
  }
}

}  // namespace
}  // namespace trestle::ros_interfaces_test
