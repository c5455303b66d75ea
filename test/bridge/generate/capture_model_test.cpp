#include "bridge/generate/capture_model.hpp"

#include <gmock/gmock.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>

#include "bridge/describe/model_json.hpp"
#include "bridge/describe/system.hpp"
#include "test/source_dir.hpp"

namespace trestle::generate {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

std::string capture(const std::string& name) {
  return test::source_dir() + "/pcaps/vsomeip/" + name;
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
  EXPECT_EQ(reading.model.instances.front().observed_ttl_s, 3U);
  // And who uses it.
  ASSERT_THAT(reading.model.observed_uses, SizeIs(2));
  EXPECT_EQ(reading.model.observed_uses[0].eventgroup, someip::EventgroupId{0x4470});
  EXPECT_TRUE(reading.model.observed_uses[0].udp);
  EXPECT_TRUE(reading.model.observed_uses[1].tcp);
  // By UDP to the endpoint of the subscription of 0x4470, by TCP to that of 0x4471.
  EXPECT_THAT(service.events[0].eventgroups, ElementsAre(someip::EventgroupId{0x4470}));
  EXPECT_THAT(service.events[1].eventgroups, ElementsAre(someip::EventgroupId{0x4471}));
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
  ASSERT_THAT(reading.problems, SizeIs(3));  // the last: no subscription was seen
  EXPECT_THAT(
      to_string(reading.problems[1]),
      HasSubstr("service_3000 has a method and an event of the id 0x0002: 2 messages are of the method, 3 "
                "of the event; the method is left out"));
}

TEST(CaptureModel, LeavesOutWhatIsNoService) {
  CaptureModel sink;
  for (const std::uint16_t service : {std::uint16_t{0}, std::uint16_t{0x3000}}) {
    someip::Message message{};
    message.header.service = someip::ServiceId{service};
    message.header.method = someip::MethodId{1};
    message.header.type = someip::MessageType::request;
    sink.message({}, 0, message);
  }
  const describe::Reading reading = sink.reading("a.pcap");
  EXPECT_TRUE(reading.ok());
  ASSERT_THAT(reading.model.services, SizeIs(1));
  EXPECT_EQ(reading.model.services[0].name, "service_3000");
  ASSERT_THAT(reading.problems, SizeIs(1));
  EXPECT_THAT(to_string(reading.problems[0]),
              HasSubstr("left out: 1 messages of service 0x0000 or 0xffff, which are no services"));
}

/// As a recording that was killed leaves it.
TEST(ReadCapture, TakesWhatACutCaptureHas) {
  const std::filesystem::path cut =
      std::filesystem::temp_directory_path() / ("cut" + std::to_string(::getpid()) + ".pcap");
  std::filesystem::copy_file(capture("field_getter_setter_notifier.pcap"), cut,
                             std::filesystem::copy_options::overwrite_existing);
  std::filesystem::resize_file(cut, std::filesystem::file_size(cut) - 3);
  const describe::Reading reading = read_capture(cut.string());
  std::filesystem::remove(cut);
  EXPECT_TRUE(reading.ok());
  EXPECT_THAT(reading.model.services, SizeIs(1));
  ASSERT_THAT(reading.problems, SizeIs(1));
  EXPECT_THAT(to_string(reading.problems[0]), HasSubstr("warning: the capture cannot be read to its end"));
}

/// Other people's captures, which are not part of this project.
TEST(ReadCapture, DescribesEveryCaptureThatIsThere) {
  const char* const given = std::getenv("TRESTLE_PCAPS");
  const std::filesystem::path folder = given != nullptr ? given : test::source_dir() + "/../shared/pcaps";
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

/// Hands messages to a CaptureModel as if they had been captured.
class Scene {
 public:
  void send(Transport transport, const Endpoint& from, const Endpoint& to, someip::MessageType type,
            std::uint16_t method) {
    traffic::Place place;
    place.transport = transport;
    place.flow.from = from;
    place.flow.to = to;
    someip::Message message;
    message.header.service = someip::ServiceId{0x1234};
    message.header.method = static_cast<someip::MethodId>(method);
    message.header.interface_version = 1;
    message.header.type = type;
    model_.message(place, 0, message);
  }
  [[nodiscard]] describe::Model model() const { return model_.reading("scene").model; }

 private:
  CaptureModel model_;
};

TEST(ReadCapture, TakesTheEndpointOfAnswersWhereNobodyOffers) {
  const Endpoint server{IpAddress::v4(10, 0, 0, 1), 30491};
  const Endpoint client{IpAddress::v4(10, 0, 0, 3), 40000};
  Scene scene;
  scene.send(Transport::udp, client, server, someip::MessageType::request, 1);
  EXPECT_THAT(scene.model().instances, IsEmpty()) << "a request may go anywhere";
  scene.send(Transport::udp, server, client, someip::MessageType::response, 1);
  scene.send(Transport::tcp, {server.address, 30492}, client, someip::MessageType::notification, 0x8001);
  scene.send(Transport::udp, {IpAddress::v4(10, 0, 0, 2), 30491}, client, someip::MessageType::response, 1);
  const describe::Model model = scene.model();
  ASSERT_THAT(model.instances, SizeIs(2));
  EXPECT_EQ(model.instances[0].address, server.address);
  EXPECT_EQ(model.instances[0].udp_port, 30491);
  EXPECT_EQ(model.instances[0].tcp_port, 30492);
  EXPECT_EQ(model.instances[0].id, std::nullopt);
  EXPECT_EQ(model.instances[1].address, IpAddress::v4(10, 0, 0, 2));
  // And the eventgroup is open, which is told.
  EXPECT_THAT(model.services[0].events[0].eventgroups, IsEmpty());
  ASSERT_THAT(what_is_open(model), SizeIs(1));
  EXPECT_EQ(what_is_open(model)[0].text,
            "service_1234: no subscription was seen; the eventgroups of event_8001 are left open");
}

TEST(ReadCapture, SaysThatThereIsNoCapture) {
  const describe::Reading reading = read_capture("/nowhere/at/all.pcap");
  ASSERT_THAT(reading.problems, SizeIs(1));
  EXPECT_EQ(reading.problems.front().file, "/nowhere/at/all.pcap");
  EXPECT_FALSE(reading.ok());
}

}  // namespace
}  // namespace trestle::generate
