// The C interface, as far as the example in C does not show it: memory, limits, errors.
#include <gtest/gtest.h>

#include <array>
#include <vector>

#include "someip/wire/types.hpp"
#include "trestle.h"

namespace {

#define SMALL_LIMITS 1, 1, 2, 2, 2, 1, 1, 1, 2, 4, 4, 2, 64, 1, 256, 1

const std::array<std::uint16_t, 1> eventgroups{1};
const std::array<trestle_method, 1> methods{{{0x0001, TRESTLE_REQUEST_RESPONSE}}};
const std::array<trestle_event, 2> events{{{0x8001, {1}}, {0x8002, {1}}}};

class TrestleC : public testing::Test {
 protected:
  TrestleC() {
    trestle_default_settings(&settings);
    settings.own.address[0] = 10;
    settings.own.address[3] = 1;
    service.service = 0x1234;
    service.instance = 1;
    service.major = 1;
    service.port = 30501;
    service.methods = methods.data();
    service.method_count = methods.size();
    service.events = events.data();
    service.event_count = events.size();
    service.eventgroups = eventgroups.data();
    service.eventgroup_count = eventgroups.size();
    settings.services = &service;
    settings.service_count = 1;
  }
  trestle_status init(std::size_t bytes) {
    return trestle_init(memory.data(), bytes, &limits, &settings, &device);
  }

  trestle_limits limits = {SMALL_LIMITS};
  trestle_settings settings{};
  trestle_service service{};
  std::array<std::uint64_t, TRESTLE_MEMORY_BYTES(SMALL_LIMITS) / 8> memory{};
  trestle_device* device = nullptr;
};

TEST_F(TrestleC, SaysHowMuchMemoryItNeeds) {
  const std::size_t exact = trestle_memory_bytes(&limits);
  EXPECT_LE(exact, sizeof memory);
  // The constant is no wild guess. That of a host counts guards, which a library made for size does not have.
#ifdef __unix__
  constexpr std::size_t guards_bytes = trestle::optimised_for_many ? 0 : 2'080;
#else
  constexpr std::size_t guards_bytes = 0;
#endif
  EXPECT_GE(exact * 5 / 4 + 512 + guards_bytes, sizeof memory);
  EXPECT_EQ(init(exact), TRESTLE_OK);
  EXPECT_EQ(init(100), TRESTLE_NO_MEMORY);
  EXPECT_EQ(trestle_init(static_cast<char*>(static_cast<void*>(memory.data())) + 4, sizeof memory - 8,
                         &limits, &settings, &device),
            TRESTLE_NO_MEMORY);
}

TEST_F(TrestleC, HasTheDefaultsOfTheSpecification) {
  trestle_settings defaults{};
  trestle_default_settings(&defaults);
  EXPECT_EQ(defaults.own.port, 30490);
  EXPECT_EQ(defaults.multicast.port, 30490);
  EXPECT_EQ(std::vector(defaults.multicast.address, defaults.multicast.address + 4),
            (std::vector<std::uint8_t>{224, 244, 224, 245}));
  EXPECT_EQ(defaults.initial_delay_min_ms, 10U);
  EXPECT_EQ(defaults.initial_delay_max_ms, 100U);
  EXPECT_EQ(defaults.repetitions_base_delay_ms, 30U);
  EXPECT_EQ(defaults.repetitions_max, 3);
  EXPECT_EQ(defaults.cyclic_offer_delay_ms, 1000U);
  EXPECT_EQ(defaults.ttl_s, 3U);
  EXPECT_EQ(defaults.tp_burst, 4);
  EXPECT_EQ(defaults.tp_separation_us, 1000U);
  EXPECT_EQ(defaults.request_response_delay_min_ms, 0U);
  EXPECT_EQ(defaults.request_response_delay_max_ms, 10U);
  EXPECT_EQ(defaults.reassembly_timeout_ms, 1000U);
}

TEST_F(TrestleC, RefusesWhatCannotBe) {
  ++service.method_count;
  EXPECT_EQ(init(sizeof memory), TRESTLE_TABLE_FULL);
  --service.method_count;
  limits.sends = 1;
  EXPECT_EQ(init(sizeof memory), TRESTLE_BAD_LIMITS);
  limits.sends = 2;
  settings.ttl_s = 0;
  EXPECT_EQ(init(sizeof memory), TRESTLE_BAD_ARGUMENT);
  EXPECT_EQ(trestle_bad_setting(&settings), TRESTLE_ARGUMENT_TTL);
  settings.ttl_s = 3;
  settings.tp_burst = 0;
  EXPECT_EQ(init(sizeof memory), TRESTLE_BAD_ARGUMENT);
  EXPECT_STREQ(trestle_argument_name(trestle_bad_setting(&settings)), "tp_burst");
  settings.tp_burst = 1;
  settings.initial_delay_min_ms = settings.initial_delay_max_ms + 1;
  EXPECT_STREQ(trestle_argument_name(trestle_bad_setting(&settings)), "initial_delay");
  settings.initial_delay_min_ms = 0;
  settings.request_response_delay_min_ms = settings.request_response_delay_max_ms + 1;
  EXPECT_STREQ(trestle_argument_name(trestle_bad_setting(&settings)), "request_response_delay");
  settings.request_response_delay_min_ms = 0;
  EXPECT_EQ(trestle_bad_setting(&settings), TRESTLE_ARGUMENT_NONE);
  ASSERT_EQ(init(sizeof memory), TRESTLE_OK);
  EXPECT_EQ(trestle_notify(device, 0, 0x8001, nullptr, 0), TRESTLE_NOT_OFFERED);
  ASSERT_EQ(trestle_offer(device, 0, 1'000'000'000), TRESTLE_OK);
  EXPECT_EQ(trestle_offer(device, 0, 1'000'000'000), TRESTLE_DUPLICATE);
  EXPECT_EQ(trestle_notify(device, 0, 0x8003, nullptr, 0), TRESTLE_BAD_ARGUMENT);
  EXPECT_EQ(trestle_require(device, 0, 1'000'000'000), TRESTLE_BAD_ARGUMENT);
  std::uint32_t call = 0;
  EXPECT_EQ(trestle_call(device, 0, 1, nullptr, 0, 1, 1'000'000'000, &call), TRESTLE_BAD_ARGUMENT);
}

TEST_F(TrestleC, SaysWhichArgumentIsWrong) {
  ASSERT_EQ(init(sizeof memory), TRESTLE_OK);
  EXPECT_EQ(trestle_bad(device, nullptr), TRESTLE_ARGUMENT_NONE);
  EXPECT_EQ(trestle_notify(device, 0, 0x8003, nullptr, 0), TRESTLE_BAD_ARGUMENT);
  EXPECT_EQ(trestle_bad(device, nullptr), TRESTLE_ARGUMENT_EVENT);
  EXPECT_EQ(trestle_require(device, 0, 1'000'000'000), TRESTLE_BAD_ARGUMENT);
  EXPECT_STREQ(trestle_argument_name(trestle_bad(device, nullptr)), "need");
  const std::array<trestle_event, 2> in_no_group{{{0x8001, {1}}, {0x8002, {2}}}};
  service.events = in_no_group.data();
  ASSERT_EQ(init(sizeof memory), TRESTLE_OK);
  EXPECT_EQ(trestle_offer(device, 0, 1'000'000'000), TRESTLE_BAD_ARGUMENT);
  std::size_t index = 99;
  EXPECT_STREQ(trestle_argument_name(trestle_bad(device, &index)), "event_eventgroups");
  EXPECT_EQ(index, 1U);
}

TEST_F(TrestleC, OffersAnEventBelow0x8000AndTellsOfIt) {
  const std::array<trestle_event, 2> low{{{0x8001, {1}}, {0x0123, {1}}}};
  service.events = low.data();
  ASSERT_EQ(init(sizeof memory), TRESTLE_OK);
  ASSERT_EQ(trestle_offer(device, 0, 1'000'000'000), TRESTLE_OK);
  trestle_happening what{};
  ASSERT_TRUE(trestle_poll_happening(device, &what));
  EXPECT_EQ(what.kind, TRESTLE_UNUSUAL_ID);
  EXPECT_EQ(what.index, 0U);
  EXPECT_EQ(what.method, 0x0123);
  EXPECT_FALSE(trestle_poll_happening(device, &what));
}

TEST_F(TrestleC, TellsTheValueOfAField) {
  std::array<std::uint8_t, 4> room{1, 2};
  trestle_field field{};
  field.getter = 0x0010;
  field.room = room.data();
  field.room_bytes = room.size();
  service.fields = &field;
  service.field_count = 1;
  service.event_count = 1;  // the limits are for two of both
  ASSERT_EQ(init(sizeof memory), TRESTLE_OK);
  std::size_t size = 99;
  EXPECT_EQ(trestle_field_value(device, 0, 0, &size), nullptr);  // not offered
  ASSERT_EQ(trestle_offer(device, 0, 0), TRESTLE_OK);
  EXPECT_EQ(trestle_field_value(device, 0, 0, &size), nullptr);  // no value yet
  EXPECT_EQ(trestle_field_value(device, 0, 1, &size), nullptr);
  EXPECT_EQ(size, 99U);
  const std::array<std::uint8_t, 3> value{7, 8, 9};
  ASSERT_EQ(trestle_set_field(device, 0, 0, value.data(), value.size()), TRESTLE_OK);
  EXPECT_EQ(trestle_field_value(device, 0, 0, &size), room.data());
  EXPECT_EQ(size, 3U);
  EXPECT_EQ(room, (std::array<std::uint8_t, 4>{7, 8, 9}));
}

TEST_F(TrestleC, AnswersARequestThatWasKept) {
  ASSERT_EQ(init(sizeof memory), TRESTLE_OK);
  ASSERT_EQ(trestle_offer(device, 0, 1'000'000'000), TRESTLE_OK);
  const std::array<std::uint8_t, 17> datagram{0x12, 0x34, 0x00, 0x01, 0, 0, 0, 9,   1,
                                              2,    0,    3,    1,    1, 0, 0, 0x55};
  trestle_endpoint peer = settings.own;
  peer.address[3] = 2;
  peer.port = 40000;
  trestle_endpoint to = settings.own;
  to.port = 30501;
  trestle_on_datagram(device, datagram.data(), datagram.size(), &peer, &to, 1'000'000'001);
  std::array<std::uint8_t, TRESTLE_DATAGRAM_BYTES> room{};
  trestle_transmit out{};
  EXPECT_FALSE(trestle_poll_transmit(device, room.data(), room.size(), 1'000'000'001, &out));
  trestle_happening what{};
  ASSERT_TRUE(trestle_poll_happening(device, &what));
  EXPECT_EQ(what.kind, TRESTLE_REQUEST);
  EXPECT_EQ(what.method, 1);
  ASSERT_EQ(what.size, 1U);
  EXPECT_EQ(what.payload[0], 0x55);
  const std::array<std::uint8_t, 2> answer{0xca, 0xfe};
  ASSERT_EQ(trestle_respond(device, &what.request, answer.data(), answer.size()), TRESTLE_OK);
  ASSERT_TRUE(trestle_poll_transmit(device, room.data(), room.size(), 1'000'000'001, &out));
  EXPECT_EQ(out.from_port, 30501);
  EXPECT_EQ(out.to.port, 40000);
  EXPECT_EQ(out.to.address[3], 2);
  const std::vector<std::uint8_t> expected{0x12, 0x34, 0x00, 0x01, 0, 0,    0, 10,   1,
                                           2,    0,    3,    1,    1, 0x80, 0, 0xca, 0xfe};
  EXPECT_EQ(std::vector(out.bytes, out.bytes + out.size), expected);
  EXPECT_FALSE(trestle_poll_transmit(device, room.data(), room.size(), 1'000'000'001, &out));
  trestle_counters counters{};
  trestle_get_counters(device, &counters);
  EXPECT_EQ(counters.requests, 1U);
  std::uint64_t deadline = 0;
  ASSERT_TRUE(trestle_deadline(device, &deadline));
  EXPECT_GE(deadline, 1'010'000'000U);  // the first offer, after 10 to 100 ms
  EXPECT_LE(deadline, 1'100'000'000U);
}

}  // namespace
