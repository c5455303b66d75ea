#include "bridge/carry/runtime/loop_suspects.hpp"

#include <gtest/gtest.h>

#include "someip/net/address_text.hpp"

namespace trestle::carry::loop_suspects_test {
namespace {

IpAddress ip(const char* text) {
  return someip::parse_address(text).value();
}

dds::Guid guid(unsigned participant, unsigned endpoint = 4) {
  dds::Guid result{};
  result[11] = static_cast<std::byte>(participant);
  result[15] = static_cast<std::byte>(endpoint);
  return result;
}

dds::Counterpart at(unsigned participant, std::vector<std::string> addresses) {
  return {.guid = guid(participant), .node = "", .participant = "", .addresses = std::move(addresses)};
}

const std::vector<IpAddress> own{ip("10.0.0.1"), ip("127.0.0.1"), ip("fe80::1")};

class Suspects : public testing::Test {
 protected:
  LoopSuspects suspects_{"rt/chatter", false};
};

TEST_F(Suspects, AreNobodyWhereNobodyIs) {
  suspects_.set({}, own);
  for (const char* host : {"10.0.0.1", "10.0.0.2", "127.0.0.1", "0.0.0.0"}) {
    EXPECT_FALSE(suspects_.at(ip(host))) << host;
  }
}

TEST_F(Suspects, AreAtEachAddressOfTheirHosts) {
  suspects_.set({at(1, {"10.0.0.2", "192.168.0.2"}), at(2, {"fe80::2"}), at(3, {})}, own);
  for (const char* host : {"10.0.0.2", "192.168.0.2", "fe80::2"}) {
    EXPECT_TRUE(suspects_.at(ip(host))) << host;
  }
  for (const char* host : {"10.0.0.3", "10.0.0.1", "127.0.0.1", "127.0.0.2", "fe80::1"}) {
    EXPECT_FALSE(suspects_.at(ip(host))) << host;
  }
}

// Who is on this host tells other addresses of it than the one that he speaks SOME/IP from.
TEST_F(Suspects, OnThisHostAreAtAllAddressesOfIt) {
  for (const char* told : {"127.0.0.1", "10.0.0.1", "::1"}) {
    suspects_.set({at(1, {told})}, own);
    for (const char* host : {"10.0.0.1", "127.0.0.1", "127.4.5.6", "fe80::1", "::1"}) {
      EXPECT_TRUE(suspects_.at(ip(host))) << told << " " << host;
    }
    EXPECT_FALSE(suspects_.at(ip("10.0.0.2"))) << told;
  }
}

TEST_F(Suspects, AreForgottenWhenTheyHaveLeft) {
  suspects_.set({at(1, {"10.0.0.2"})}, own);
  EXPECT_TRUE(suspects_.at(ip("10.0.0.2")));
  suspects_.set({}, {});
  EXPECT_FALSE(suspects_.at(ip("10.0.0.2")));
}

TEST_F(Suspects, AreKnownByTheirParticipants) {
  suspects_.set({at(9, {"127.0.0.1"}), at(1, {"10.0.0.2"})}, own);
  const std::vector<IpAddress> hosts{ip("10.0.0.5"), ip("10.0.0.2")};
  EXPECT_TRUE(suspects_.is_at(guid(1, 77), hosts)) << "another endpoint of it";
  EXPECT_FALSE(suspects_.is_at(guid(2), hosts));
  EXPECT_FALSE(suspects_.is_at(guid(10), hosts));
  EXPECT_FALSE(suspects_.is_at(guid(9), hosts)) << "it is elsewhere";
  EXPECT_FALSE(suspects_.is_at(guid(1), {}));
  const std::vector<IpAddress> here{ip("10.0.0.1")};
  EXPECT_TRUE(suspects_.is_at(guid(9), here));
  EXPECT_FALSE(suspects_.is_at(guid(1), here));
}

}  // namespace
}  // namespace trestle::carry::loop_suspects_test
