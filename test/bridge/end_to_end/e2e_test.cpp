// End-to-end protection at the bridge.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <spdlog/spdlog.h>

#include <filesystem>
#include <fstream>

#include "bridge/carry/runtime/diagnostics.hpp"
#include "test/bridge/end_to_end/bridge_test.hpp"
#include "test/covers.hpp"

namespace trestle::test::e2e_test {
namespace {

using someip::EventgroupId;
using someip::InstanceId;
using someip::MethodId;
using someip::ServiceId;
using testing::ElementsAre;
using testing::HasSubstr;
namespace e2e = someip::e2e;

constexpr MethodId event{0x8031};
constexpr EventgroupId group{1};

/// A bridge with one route.
class E2eAtTheBridge : public BridgeTest {
 protected:
  E2eAtTheBridge() {
    spdlog::set_level(spdlog::level::warn);
    std::filesystem::create_directories(folder_ + "/test_msgs/msg");
    std::ofstream{folder_ + "/test_msgs/msg/Six.msg"} << "uint16 number\nuint32 value\n";
  }
  ~E2eAtTheBridge() override { std::filesystem::remove_all(folder_); }

  void start(const std::string& direction, const std::string& type, const std::string& e2e_keys) {
    start_bridge(fmt::format(
        "types: {{paths: [{}]}}\n"
        "diagnostics: {{topic: /state, period: 60 s}}\n"
        "routes:\n"
        "  - {{topic: /a, type: {}, direction: {}, service: 0x1234, instance: 1, eventgroup: 1, event: "
        "0x8031,\n"
        "     e2e: {{{}}}}}\n",
        folder_, type, direction, e2e_keys));
  }

  [[nodiscard]] std::uint64_t counter(const std::string& name) { return bridge_->counter("route /a", name); }

  /// An offer of the service, whose payloads are sent as they are.
  [[nodiscard]] sd::Offer offer(std::vector<sd::E2eSpec> e2e = {}) {
    return {*peer_,
            {.service = ServiceId{0x1234},
             .instance = InstanceId{1},
             .eventgroups = {{.id = group, .events = {event}}},
             .e2e = std::move(e2e)}};
  }

  const std::string folder_ = testing::TempDir() + "trestle-e2e-" + std::to_string(getpid());
  std::unique_ptr<sd::Node> peer_ = std::make_unique<sd::Node>(io_, peer_config());
};

// Events of vsomeip 3.7.4 with profile 1, from pcaps/vsomeip/e2e_events_p01_p04_p05_p07_crc32.pcap: CRC,
// nibble of the Data ID and counter, and 6 bytes of data.
constexpr const char* recorded[] = {"9ba0 0001 7d9cbbda", "a9a1 0002 7e9dbcdb", "2aa2 0003 7f9ebddc",
                                    "9ca3 0004 809fbedd"};
constexpr const char* recorded_profile =
    "profile: 1, data_id: 0xa73, data_id_mode: nibble, data_bits: 64, payload_only: true";

TEST_F(E2eAtTheBridge, ChecksWhatVsomeipHasProtected) {
  start("someip_to_dds", "test_msgs/msg/Six", recorded_profile);
  Inbox<Bytes> arrived;
  const auto a = reader("/a", "test_msgs/msg/Six", arrived);
  const sd::Offer service = offer();
  ASSERT_TRUE(
      until([&] { return peer_->subscribers(service.handle(), event) == 1 && counter("readers") == 1; }));
  for (const char* const one : recorded) {
    service.notify(event, hex(one));
  }
  Bytes flipped = hex("9ca3 0004 809fbedd");
  flipped[7] ^= std::byte{1};
  service.notify(event, flipped);
  service.notify(event, hex("9ca3 0004 809fbedd"));  // once more
  service.notify(event, hex("9ca3"));
  ASSERT_TRUE(until([&] { return counter("received") == 7; }));
  // Profile 1 in its later form has no opinion of the first.
  EXPECT_EQ(counter("e2e_ok"), 3U);
  EXPECT_EQ(counter("e2e_wrong_sequence"), 1U);
  EXPECT_EQ(counter("e2e_repeated"), 1U);
  EXPECT_EQ(counter("e2e_error"), 2U);
  EXPECT_EQ(counter("carried"), 3U);
  ASSERT_TRUE(arrived.wait_for_count(3));
  // Number and value in little endian, aligned.
  EXPECT_THAT(arrived.take(),
              ElementsAre(hex("00010000 0200 0000 dbbc9d7e"), hex("00010000 0300 0000 dcbd9e7f"),
                          hex("00010000 0400 0000 ddbe9f80")));
}

TEST_F(E2eAtTheBridge, CarriesWhatFailedIfToldSo) {
  start("someip_to_dds", "test_msgs/msg/Six", std::string{recorded_profile} + ", failed: pass");
  Inbox<Bytes> arrived;
  const auto a = reader("/a", "test_msgs/msg/Six", arrived);
  const sd::Offer service = offer();
  ASSERT_TRUE(
      until([&] { return peer_->subscribers(service.handle(), event) == 1 && counter("readers") == 1; }));
  service.notify(event, hex("ffff 0009 809fbedd"));
  ASSERT_TRUE(until([&] { return arrived.size() == 1; }));
  EXPECT_THAT(arrived.take(), ElementsAre(hex("00010000 0900 0000 ddbe9f80")));
  EXPECT_EQ(counter("e2e_error"), 1U);
}

TEST_F(E2eAtTheBridge, ProtectsWhatItSends) {
  covers({"feat_req_someip_102", "feat_req_someip_103"});
  start("dds_to_someip, port: 40001", "std_msgs/msg/String", "profile: 4, data_id: 0x0100002d");
  std::vector<Bytes> received;
  const sd::Subscription subscription{*peer_,
                                      {.service = ServiceId{0x1234}, .eventgroup = group, .events = {event}},
                                      [&](const someip::Message& message, const Endpoint&) {
                                        received.emplace_back(message.payload.begin(), message.payload.end());
                                      }};
  auto a = writer("/a");
  ASSERT_TRUE(until([&] { return subscription.active() && counter("publishers") == 1 && a.matched() == 1; }));
  ASSERT_TRUE(a.write(hello_cdr));
  ASSERT_TRUE(a.write(hello_cdr));
  ASSERT_TRUE(until([&] { return received.size() == 2; }));
  // Length, counter, Data ID, CRC-32P4 (by a bitwise implementation) over Request ID 0000 0001 and 0000 0002,
  // 01 01 02 00, and all but the CRC; then the payload.
  EXPECT_EQ(to_hex(received[0]), "002100000100002d50ab122c00000009efbbbf68656c6c6f00");
  EXPECT_EQ(to_hex(received[1]), "002100010100002d861a927800000009efbbbf68656c6c6f00");
}

TEST_F(E2eAtTheBridge, CountsWhatTheProfileDoesNotAllow) {
  start("dds_to_someip, port: 40001", "std_msgs/msg/String", "profile: 5, data_id: 1, data_bits: 320");
  const sd::Subscription subscription{*peer_,
                                      {.service = ServiceId{0x1234}, .eventgroup = group, .events = {event}},
                                      [](const someip::Message&, const Endpoint&) { ADD_FAILURE(); }};
  auto a = writer("/a");
  ASSERT_TRUE(until([&] { return subscription.active() && counter("publishers") == 1 && a.matched() == 1; }));
  ASSERT_TRUE(a.write(hello_cdr));
  ASSERT_TRUE(until([&] { return counter("not_sent") == 1; }));
  EXPECT_EQ(counter("carried"), 0U);
  EXPECT_EQ(bridge_->counter("SOME/IP", "e2e_not_protected"), 1U);
}

std::string text_of(const Bytes& bytes) {
  std::string text;
  for (const std::byte one : bytes) {
    text += static_cast<char>(one);
  }
  return text;
}

TEST_F(E2eAtTheBridge, PublishesTheStateWhenItChanges) {
  start("someip_to_dds", "test_msgs/msg/Six", recorded_profile);
  Inbox<Bytes> states;
  const auto state = reader("/state", "diagnostic_msgs/msg/DiagnosticArray", states);
  Bytes last;
  const auto comes = [&](int level) {
    for (Bytes& one : states.take()) {
      last = std::move(one);
    }
    return last.size() > 24 && last[24] == static_cast<std::byte>(level);
  };
  const sd::Offer service = offer();
  ASSERT_TRUE(
      until([&] { return peer_->subscribers(service.handle(), event) == 1 && state.matched() == 1; }));
  service.notify(event, hex(recorded[0]));
  service.notify(event, hex(recorded[1]));
  service.notify(event, hex(recorded[2]));
  service.notify(event, hex(recorded[3]));
  ASSERT_TRUE(
      until([&] { return comes(0); }));  // perhaps with the period: the writer may not know of the reader yet
  const std::string valid = text_of(last);
  EXPECT_THAT(valid, HasSubstr("trestle: E2E of /a"));
  EXPECT_THAT(valid, HasSubstr("SOME/IP 0x1234.0x0001 event 0x8031"));
  EXPECT_THAT(valid, HasSubstr(std::string{"state\0\0\0\6\0\0\0valid", 17}));
  const auto before = std::chrono::steady_clock::now();
  for (int i = 0; i < 3; ++i) {
    service.notify(event, hex("ffff 0009 809fbedd"));
  }
  ASSERT_TRUE(until([&] { return comes(2); }));
  EXPECT_LT(std::chrono::steady_clock::now() - before, 40s) << "the period is 60 s";
  EXPECT_THAT(text_of(last), HasSubstr("invalid"));
}

TEST(DiagnosticArray, IsWrittenAsRosReadsIt) {
  using carry::Diagnosis;
  const std::vector<Diagnosis> statuses{
      {.level = Diagnosis::Level::error,
       .name = "n",
       .message = "me",
       .hardware_id = "",
       .values = {{"k", "v"}}},
      {.level = Diagnosis::Level::stale, .name = "o", .message = "", .hardware_id = "h", .values = {}}};
  if constexpr (std::endian::native == std::endian::little) {
    EXPECT_EQ(to_hex(carry::diagnostic_array(std::chrono::nanoseconds{3'000'000'005}, statuses)),
              "00010000"  // encapsulation
              "03000000"
              "05000000"  // stamp
              "01000000"
              "00"
              "000000"    // frame_id, padding
              "02000000"  // statuses
              "02"
              "000000"  // level, padding
              "02000000"
              "6e00"
              "0000"  // name
              "03000000"
              "6d6500"
              "00"  // message
              "01000000"
              "00"
              "000000"    // hardware_id
              "01000000"  // values
              "02000000"
              "6b00"
              "0000"  // key
              "02000000"
              "7600"  // value
              "03"
              "00"  // level
              "02000000"
              "6f00"
              "0000"  // name
              "01000000"
              "00"
              "000000"  // message
              "02000000"
              "6800"
              "0000"        // hardware_id
              "00000000");  // values
  }
}

}  // namespace
}  // namespace trestle::test::e2e_test
