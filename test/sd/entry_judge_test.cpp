// Entries that the application does not let peers make: ServiceDiscovery::judge_entries().
#include "test/covers.hpp"
#include "test/sd/client_fixture.hpp"
#include "test/sd/server_fixture.hpp"

namespace trestle::sd::entry_judge_test {
namespace {
using namespace test;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

struct Asked {
  EntryKind kind{};
  IpAddress from;
};

/// Allows what comes from one host.
struct Judge {
  IpAddress allowed;
  std::vector<Asked> asked{};
  [[nodiscard]] EntryJudge view() {
    return {.is_allowed =
                [](void* judge, const Entry& entry, const IpAddress& from) noexcept {
                  auto& self = *static_cast<Judge*>(judge);
                  self.asked.push_back({entry.kind(), from});
                  return from == self.allowed;
                },
            .context = this};
  }
};

/// Where entries are judged at all.
template <typename Fixture>
class Judged : public Fixture {
 protected:
  void SetUp() override {
    if constexpr (!optimised_for_many) {
      GTEST_SKIP() << "a small device hears everybody";
    }
  }
};
using JudgingServer = Judged<Server>;
using JudgingClient = Judged<Client>;

std::uint64_t nacks(const Machine<>& machine) {
  return machine.discovery.counters().nacks_by_reason.back();
}

TEST_F(JudgingServer, RefusesASubscriptionThatIsNotAllowed) {
  covers({"feat_req_someipsd_1164"});
  offer(udp_service);
  Judge judge{host(3).address};
  machine.discovery.judge_entries(judge.view());
  machine.unicast(client, {subscribe(1, {udp(client_udp)})});
  EXPECT_THAT(machine.sent(), ElementsAre(HasSubstr(": nack 1234.5678 v1 group 0001 ttl 0")));
  EXPECT_THAT(machine.events(), IsEmpty());
  EXPECT_EQ(nacks(machine), 1U);
  FakePeer other{host(3)};
  machine.unicast(other, {subscribe(1, {udp(host(3, 40000))})});
  EXPECT_THAT(machine.sent(), ElementsAre(HasSubstr(": ack 1234.5678")));
  EXPECT_EQ(nacks(machine), 1U);
}

// Who is not allowed learns nothing about what is offered.
TEST_F(JudgingServer, GivesNoOtherReasonToThoseThatAreNotAllowed) {
  offer(udp_service);
  Judge judge{host(3).address};
  machine.discovery.judge_entries(judge.view());
  machine.unicast(client, {subscribe(9, {udp(client_udp)})});
  EXPECT_THAT(machine.sent(), ElementsAre(HasSubstr(": nack ")));
  EXPECT_EQ(nacks(machine), 1U);
  EXPECT_EQ(machine.discovery.counters().nacks_sent, 1U);
}

TEST_F(JudgingClient, IgnoresAnOfferThatIsNotAllowed) {
  require(required);
  Judge judge{host(3).address};
  machine.discovery.judge_entries(judge.view());
  machine.multicast(server, {test::offer({udp(server_udp)})});
  EXPECT_THAT(machine.events(), IsEmpty());
  ASSERT_EQ(judge.asked.size(), 1U);
  EXPECT_EQ(judge.asked.front().kind, EntryKind::offer_service);
  EXPECT_EQ(judge.asked.front().from, server_sd.address);
  FakePeer other{host(3)};
  machine.multicast(other, {test::offer({udp(host(3, 30509))})});
  EXPECT_THAT(machine.events(), ElementsAre(HasSubstr("available")));
}

// They change nothing of others.
TEST_F(JudgingClient, DoesNotAskAboutTheEndsOfOffersAndAnswers) {
  Judge judge{server_sd.address};
  machine.discovery.judge_entries(judge.view());
  static_cast<void>(subscribed());
  ASSERT_EQ(judge.asked.size(), 1U);
  machine.multicast(server, {test::offer({udp(server_udp)}, 0)});
  EXPECT_EQ(judge.asked.size(), 1U);
}

}  // namespace
}  // namespace trestle::sd::entry_judge_test
