#include "bridge/generate/capture_model.hpp"

#include <gmock/gmock.h>

#include <cstdlib>
#include <filesystem>

#include "bridge/describe/model_json.hpp"
#include "bridge/describe/system.hpp"

namespace trestle::generate {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

std::string capture(const std::string& name) {
  return TRESTLE_CAPTURES "/" + name;
}

template <typename Element>
std::vector<std::string> names(const std::vector<Element>& elements) {
  std::vector<std::string> names;
  for (const Element& element : elements) {
    names.push_back(element.name);
  }
  return names;
}

TEST(ReadCapture, FindsServicesMembersAndEndpoints) {
  const describe::Reading reading = read_capture(capture("field_getter_setter_notifier.pcap"));
  ASSERT_THAT(reading.problems, IsEmpty());
  ASSERT_THAT(reading.model.services, SizeIs(1));
  const describe::Service& service = reading.model.services.front();
  EXPECT_EQ(service.name, "service_1234");
  EXPECT_THAT(names(service.methods),
              ElementsAre("method_0010", "method_0011", "method_0012", "method_0013"));
  EXPECT_THAT(names(service.events), ElementsAre("event_8010", "event_8011"));
  ASSERT_THAT(reading.model.instances, SizeIs(1));
  EXPECT_TRUE(reading.model.instances.front().address);
  EXPECT_TRUE(reading.model.instances.front().udp_port);
}

TEST(ReadCapture, PutsSegmentsTogether) {
  const describe::Reading reading = read_capture(capture("tp_event_1mib_plus.pcap"));
  ASSERT_THAT(reading.model.services, SizeIs(1));
  ASSERT_THAT(reading.model.services.front().events, SizeIs(1));
  EXPECT_GT(reading.model.services.front().events.front().observed_bytes, 1U << 20U);
}

TEST(ReadCapture, KnowsWhatHasNoAnswer) {
  const describe::Reading reading = read_capture(capture("fire_and_forget_udp_tcp.pcap"));
  ASSERT_FALSE(reading.model.services.empty());
  bool forgets = false;
  for (const describe::Method& method : reading.model.services.front().methods) {
    forgets = forgets || method.fire_and_forget;
  }
  EXPECT_TRUE(forgets);
}

TEST(CaptureModel, KeepsOfAMethodAndAnEventOfOneIdTheOneWithMoreMessages) {
  CaptureModel sink;
  const auto send = [&](std::uint16_t id, someip::MessageType type) {
    someip::Message message{};
    message.header.service = someip::ServiceId{0x3000};
    message.header.method = someip::MethodId{id};
    message.header.type = type;
    sink.message({}, 0, message);
  };
  for (const std::uint16_t id : {std::uint16_t{1}, std::uint16_t{2}}) {
    send(id, someip::MessageType::request);
    send(id, someip::MessageType::response);
    send(id, someip::MessageType::notification);
  }
  send(2, someip::MessageType::notification);
  send(2, someip::MessageType::notification);
  const describe::Reading reading = sink.reading("a.pcap");
  EXPECT_TRUE(reading.ok());
  ASSERT_THAT(reading.model.services, SizeIs(1));
  EXPECT_THAT(names(reading.model.services.front().methods), ElementsAre("method_0001"));
  EXPECT_THAT(names(reading.model.services.front().events), ElementsAre("event_0002"));
  ASSERT_THAT(reading.problems, SizeIs(2));
  EXPECT_THAT(
      to_string(reading.problems[1]),
      HasSubstr("service_3000 has a method and an event of the id 0x0002: 2 messages are of the method, 3 "
                "of the event; the method is left out"));
}

/// Other people's captures, which are not part of this project.
TEST(ReadCapture, DescribesEveryCaptureThatIsThere) {
  const char* const given = std::getenv("TRESTLE_PCAPS");
  const std::filesystem::path folder = given != nullptr ? given : TRESTLE_SOURCE_DIR "/../shared/pcaps";
  if (!std::filesystem::is_directory(folder)) {
    GTEST_SKIP() << "the captures are not here";
  }
  std::size_t read = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator{folder}) {
    const std::string ending = entry.path().extension().string();
    if (ending != ".pcap" && ending != ".pcapng") {
      continue;
    }
    describe::Reading reading = read_capture(entry.path().string());
    if (reading.model.services.empty()) {
      continue;  // none of SOME/IP, or cut: the problem tells
    }
    ++read;
    describe::IdLock lock;
    const describe::System system = make_system(std::move(reading), lock);
    for (const documents::Problem& problem : system.problems) {
      EXPECT_TRUE(problem.severity != documents::Problem::Severity::error ||
                  problem.text.find("cannot be read to its end") != std::string::npos)
          << to_string(problem);
    }
    EXPECT_FALSE(describe::to_json_text(system.model).empty()) << entry.path();
  }
  EXPECT_GT(read, 0U);
}

TEST(ReadCapture, SaysThatThereIsNoCapture) {
  const describe::Reading reading = read_capture("/nowhere/at/all.pcap");
  ASSERT_THAT(reading.problems, SizeIs(1));
  EXPECT_EQ(reading.problems.front().file, "/nowhere/at/all.pcap");
  EXPECT_FALSE(reading.ok());
}

}  // namespace
}  // namespace trestle::generate
