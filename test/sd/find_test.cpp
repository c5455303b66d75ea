// Finds of several requirements, in virtual time.
#include "test/covers.hpp"
#include "test/sd/machine.hpp"

namespace trestle::sd::find_test {
namespace {
using namespace test;
using testing::ElementsAre;

constexpr RequiredService required{.service = ServiceId{0x1234}, .instance = InstanceId{0x5678}, .major = 1};

class Finds : public testing::Test {
 protected:
  RequirementHandle require(const RequiredService& service) {
    const auto handle = machine.discovery.require(service, machine.now);
    EXPECT_TRUE(handle);
    return handle.value_or(RequirementHandle{});
  }
  Machine<> machine;
};

TEST_F(Finds, AreSentOnceForAllWhoLookForTheSame) {
  covers({"feat_req_someipsd_18", "feat_req_someipsd_238"});
  require(required);
  require(required);
  RequiredService newer = required;
  newer.minor = 9;  // which is no part of a Find
  const RequirementHandle third = require(newer);
  const std::string once = ": find 1234.5678 v1.* ttl 3";
  EXPECT_THAT(machine.run_to(20ms), ElementsAre("10ms -> 224.244.224.245:30490 s1 reboot" + once));
  require(required);  // joins in: the others are in the repetition phase
  EXPECT_THAT(machine.run_to(60ms), ElementsAre("40ms -> 224.244.224.245:30490 s2 reboot" + once));
  // For the one that wants another minor version it goes on.
  FakePeer server{{IpAddress::v4(10, 0, 0, 2), 30490}};
  machine.multicast(server, {offer({udp({IpAddress::v4(10, 0, 0, 2), 30509})})});
  EXPECT_THAT(machine.events(), testing::SizeIs(3));
  EXPECT_THAT(machine.run_to(1s), ElementsAre("100ms -> 224.244.224.245:30490 s3 reboot" + once));
  machine.discovery.release(third, machine.now);
  // And it starts anew for all together.
  EXPECT_THAT(machine.run_to(3100ms), ElementsAre("3070ms -> 224.244.224.245:30490 s4 reboot" + once,
                                                  "3100ms -> 224.244.224.245:30490 s5 reboot" + once));
}

TEST_F(Finds, AreSentForEachInstanceAndVersion) {
  covers({"feat_req_someipsd_239"});
  require(required);
  RequiredService other = required;
  other.instance = InstanceId{0x5679};
  require(other);
  other.instance = someip::any_instance;
  require(other);
  other.major = 2;
  require(other);
  EXPECT_THAT(machine.run_to(20ms),
              ElementsAre("10ms -> 224.244.224.245:30490 s1 reboot: find 1234.5678 v1.* ttl 3; "
                          "find 1234.5679 v1.* ttl 3; find 1234.ffff v1.* ttl 3; find 1234.ffff v2.* ttl 3"));
}

TEST_F(Finds, AreSentForEachNameOfWhatIsNotSomeip) {
  covers({"feat_req_someipsd_503"});
  for (const char* name : {"diag", "log", "diag"}) {
    require({.service = other_protocols, .otherserv = name});
  }
  EXPECT_THAT(machine.run_to(20ms),
              ElementsAre("10ms -> 224.244.224.245:30490 s1 reboot: "
                          "find fffe.ffff v*.* ttl 3 option 01:000e6f74686572736572763d6469616700; "
                          "find fffe.ffff v*.* ttl 3 option 01:000d6f74686572736572763d6c6f6700"));
  EXPECT_EQ(machine.discovery.counters().entries_sent, 2U);
}

TEST_F(Finds, StartAnewForWhoComesWhenTheSearchIsOver) {
  covers({"feat_req_someipsd_866"});
  require(required);
  EXPECT_THAT(machine.run_to(1s), testing::SizeIs(3));
  require(required);
  EXPECT_THAT(machine.run_to(2s), testing::SizeIs(3));
}

}  // namespace
}  // namespace trestle::sd::find_test
