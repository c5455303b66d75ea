// What users get who set nothing, and the words that they read in logs.
#include "sd/core/settings.hpp"

#include <gmock/gmock.h>

#include "sd/core/service_discovery.hpp"
#include "test/covers.hpp"

namespace trestle::sd::settings_test {
namespace {
using namespace std::chrono_literals;
using test::covers;

TEST(Settings, AreTheUsualOnesOfTheIndustry) {
  covers({"feat_req_someip_658"});
  const Settings settings;
  EXPECT_EQ(settings.multicast, (Endpoint{IpAddress::v4(224, 244, 224, 245), 30490}));
  EXPECT_EQ(settings.timing.initial_delay_min, 10ms);
  EXPECT_EQ(settings.timing.initial_delay_max, 100ms);
  EXPECT_EQ(settings.timing.repetitions_base_delay, 30ms);
  EXPECT_EQ(settings.timing.repetitions_max, 3);
  EXPECT_EQ(settings.timing.cyclic_offer_delay, 1s);
  EXPECT_EQ(settings.timing.request_response_delay_min, 0ms);
  EXPECT_EQ(settings.timing.request_response_delay_max, 10ms);
  EXPECT_EQ(settings.timing.ttl_s, 3U);
  EXPECT_EQ(settings.find_answer, FindAnswer::unicast);
  EXPECT_FALSE(settings.subnet_prefix_bits);
  EXPECT_TRUE(settings.explicit_initial_data);
  EXPECT_TRUE(settings.check_tcp_connections);
  EXPECT_TRUE(settings.answer_finds_in_repetition_phase);
  EXPECT_FALSE(settings.accept_partial_endpoints);
  EXPECT_TRUE(settings.answer_unknown_subscriptions);
  EXPECT_FALSE(settings.refuse_unknown_options);
  EXPECT_FALSE(settings.multicast_option_in_offers);
  EXPECT_FALSE(settings.sd_endpoint);
  EXPECT_FALSE(settings.only_from_sd_port);
  EXPECT_EQ(settings.client_id_prefix, 0);
  EXPECT_TRUE(settings.renew_infinite_subscriptions);
  EXPECT_EQ(settings.max_subscribers_per_eventgroup, 64);
  EXPECT_EQ(settings.max_subscribers_per_eventgroup_and_address, 16);
  EXPECT_EQ(settings.max_peers_per_address, 16);
  EXPECT_EQ(settings.silent_after, std::chrono::seconds{10});
  EXPECT_EQ(settings.max_entries_per_second, 2000U);
  EXPECT_EQ(settings.max_entries_at_once, 10'000U);
  EXPECT_EQ(settings.reboot_pause, std::chrono::seconds{5});
  EXPECT_EQ(settings.max_reboots_at_once, 8);
  EXPECT_EQ(settings.duplicate_window, 500ms);
  EXPECT_EQ(settings.unranked, (LoadBalancingOption{.priority = 0xffff, .weight = 0}));
}

TEST(Limits, SufficeForACar) {
  const Limits limits;
  EXPECT_EQ(limits.max_offers, 64);
  EXPECT_EQ(limits.max_eventgroups, 256);
  EXPECT_EQ(limits.max_subscribers, 512);
  EXPECT_EQ(limits.max_requirements, 64);
  EXPECT_EQ(limits.max_subscriptions, 128);
  EXPECT_EQ(limits.max_remote_services, 256);
  EXPECT_EQ(limits.max_peers, 64);
  EXPECT_EQ(limits.max_tcp_connections, 64);
  EXPECT_EQ(limits.max_pending_entries, 512);
  EXPECT_EQ(limits.max_pending_events, 512);
  EXPECT_EQ(limits.max_configurations, 64);
  EXPECT_EQ(limits.max_configuration_bytes, 256);
  EXPECT_EQ(limits.max_silent_hosts, optimised_for_many ? 256 : 2);
}

TEST(Counters, BeginAtZero) {
  const SdCounters counters;
  for (const std::uint64_t count : {counters.datagrams_received,
                                    counters.messages_received,
                                    counters.datagrams_sent,
                                    counters.entries_sent,
                                    counters.reboots_detected,
                                    counters.dropped_down,
                                    counters.dropped_own,
                                    counters.dropped_source,
                                    counters.dropped_not_sd,
                                    counters.dropped_malformed,
                                    counters.dropped_reboots,
                                    counters.dropped_duplicates,
                                    counters.ignored_unknown_type,
                                    counters.ignored_wrong_transport,
                                    counters.ignored_unknown_subscriptions,
                                    counters.ignored_bad_options,
                                    counters.ignored_conflicting_offer,
                                    counters.ignored_unexpected_ack,
                                    counters.ignored_no_room,
                                    counters.ignored_too_many,
                                    counters.displaced,
                                    counters.configurations_cut,
                                    counters.nacks_sent,
                                    counters.silences,
                                    counters.unsendable_entries,
                                    counters.lost_events}) {
    EXPECT_EQ(count, 0U);
  }
  EXPECT_THAT(counters.nacks_by_reason, testing::Each(0U));
  EXPECT_THAT(counters.limits_reached, testing::Each(0U));
}

TEST(Names, TellEachReasonAndErrorApart) {
  EXPECT_STREQ(to_string(LossReason::stopped), "stopped");
  EXPECT_STREQ(to_string(LossReason::expired), "expired");
  EXPECT_STREQ(to_string(LossReason::rebooted), "rebooted");
  EXPECT_STREQ(to_string(LossReason::replaced), "replaced");
  EXPECT_STREQ(to_string(LossReason::link_down), "link down");
  EXPECT_STREQ(to_string(LossReason::unreachable), "unreachable");
  EXPECT_STREQ(to_string(LossReason::displaced), "displaced");
  EXPECT_STREQ(to_string(NackReason::unknown_service), "unknown service");
  EXPECT_STREQ(to_string(NackReason::unknown_instance), "unknown instance");
  EXPECT_STREQ(to_string(NackReason::unknown_major), "unknown major version");
  EXPECT_STREQ(to_string(NackReason::unknown_eventgroup), "unknown eventgroup");
  EXPECT_STREQ(to_string(NackReason::bad_options), "bad options");
  EXPECT_STREQ(to_string(NackReason::missing_endpoint), "missing endpoint");
  EXPECT_STREQ(to_string(NackReason::no_tcp_connection), "no TCP connection");
  EXPECT_STREQ(to_string(NackReason::no_room), "no room");
  if constexpr (optimised_for_many) {
    EXPECT_STREQ(to_string(NackReason::not_allowed), "not allowed");
  }
  EXPECT_STREQ(to_string(SdError::table_full), "table full");
  EXPECT_STREQ(to_string(SdError::duplicate), "duplicate");
  EXPECT_STREQ(to_string(SdError::bad_argument), "bad argument");
  EXPECT_STREQ(to_string(SdError::unknown_handle), "unknown handle");
}

}  // namespace
}  // namespace trestle::sd::settings_test
