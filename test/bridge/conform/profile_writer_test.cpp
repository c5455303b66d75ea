#include "bridge/conform/commands/profile_writer.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bridge/conform/profile.hpp"

namespace trestle::conform::profile_writer_test {
namespace {

using describe::Instance;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

const IpAddress device = IpAddress::v4(192, 168, 1, 10);
const IpAddress other = IpAddress::v4(192, 168, 1, 11);

describe::Model door() {
  describe::Service service{
      .name = "Door", .scope = "car", .id = someip::ServiceId{0x4711}, .major = 2, .minor = 3};
  service.fields = {{.name = "label",
                     .getter = someip::MethodId{2},
                     .setter = someip::MethodId{3},
                     .notifier = someip::MethodId{0x8002},
                     .eventgroups = {someip::EventgroupId{1}}}};
  service.events = {{.name = "moved",
                     .id = someip::MethodId{0x8010},
                     .eventgroups = {someip::EventgroupId{2}},
                     .transfer = {.transport = Transport::tcp}}};
  service.methods = {
      {.name = "ring\nlifecycle: {start: evil}", .id = someip::MethodId{0x12}, .fire_and_forget = true}};
  describe::Model model;
  model.services = {service};
  Instance instance{.service_id = service.id,
                    .id = someip::InstanceId{1},
                    .address = device,
                    .udp_port = std::uint16_t{30711},
                    .multicast = {{.eventgroup = someip::EventgroupId{1},
                                   .group = {IpAddress::v4(239, 1, 1, 1), 30712},
                                   .threshold = 2}},
                    .machine = "Door \"ECU\""};
  Instance elsewhere = instance;
  elsewhere.address = other;
  elsewhere.machine.clear();
  model.instances = {instance, instance, elsewhere};
  model.instances[1].id = someip::InstanceId{2};
  model.machines = {{.name = "Door \"ECU\"",
                     .address = device,
                     .sd_multicast = IpAddress::v4(239, 0, 0, 1),
                     .sd_port = std::uint16_t{30491}}};
  return model;
}

Profile read_back(const WrittenProfile& written) {
  auto profile = read_profile(written.text, "p.yaml");
  EXPECT_TRUE(profile) << written.text << (profile ? "" : documents::to_string(profile.error().front()));
  return profile ? *profile : Profile{.services = {{}}};
}

TEST(ProfileWriter, WritesWhatTheReaderReads) {
  const WrittenProfile written = write_profile(door(), {});
  const Profile profile = read_back(written);
  EXPECT_EQ(profile.name, "Door ?ECU?");
  EXPECT_EQ(profile.device, device);
  EXPECT_EQ(profile.tester, other);  // the address beside it, as a guess
  EXPECT_THAT(written.text, HasSubstr("# a guess: an address of this host"));
  EXPECT_EQ(profile.multicast, IpAddress::v4(239, 0, 0, 1));
  EXPECT_EQ(profile.sd_port, 30491);
  EXPECT_EQ(written.others, "192.168.1.11");
  ASSERT_EQ(profile.services.size(), 2U);
  const ServiceProfile& service = profile.service();
  EXPECT_EQ(service.service, someip::ServiceId{0x4711});
  EXPECT_EQ(service.major, 2);
  EXPECT_EQ(service.minor, 3U);
  EXPECT_EQ(service.udp_port, 30711);
  ASSERT_EQ(service.eventgroups.size(), 2U);
  EXPECT_TRUE(service.eventgroups[0].initial_values);
  EXPECT_FALSE(service.eventgroups[0].tcp);
  EXPECT_THAT(service.eventgroups[0].events, ElementsAre(someip::MethodId{0x8002}));
  EXPECT_EQ(service.eventgroups[0].multicast, (Endpoint{IpAddress::v4(239, 1, 1, 1), 30712}));
  EXPECT_EQ(service.eventgroups[0].multicast_threshold, 2U);
  EXPECT_TRUE(service.eventgroups[1].tcp);
  ASSERT_TRUE(service.request);
  EXPECT_EQ(service.request->method, someip::MethodId{2});
  // What may do harm, a person has to say; and no name gets out of its comment.
  EXPECT_FALSE(service.fire_and_forget);
  EXPECT_THAT(written.text, HasSubstr("# fire_and_forget: 0x0012  # ring?lifecycle"));
  EXPECT_THAT(written.text, HasSubstr("# policy:\n#   answers_unknown_method: false\n"));
  EXPECT_FALSE(profile.can_restart());
}

TEST(ProfileWriter, WritesTheDeviceThatIsAskedFor) {
  const WrittenProfile written = write_profile(door(), {.name = "D", .device = other, .tester = device});
  const Profile profile = read_back(written);
  EXPECT_EQ(profile.name, "D");
  EXPECT_EQ(profile.device, other);
  EXPECT_EQ(profile.tester, device);
  EXPECT_EQ(profile.services.size(), 1U);
  EXPECT_THAT(write_profile(door(), {.device = IpAddress::v4(10, 0, 0, 1)}).text, IsEmpty());
}

TEST(ProfileWriter, GuessesWhatADescriptionLeavesOpen) {
  describe::Model model = door();
  model.instances = {{.service_id = someip::ServiceId{0x4711}}};
  const WrittenProfile written = write_profile(model, {});
  const Profile profile = read_back(written);
  EXPECT_EQ(profile.device, IpAddress::v4(192, 0, 2, 1));
  EXPECT_EQ(profile.service().udp_port, 30501);
  EXPECT_THAT(written.text, HasSubstr("# a guess: the description has no port"));
  // The address may be told.
  EXPECT_EQ(read_back(write_profile(model, {.device = device})).device, device);
}

TEST(ProfileWriter, WritesWhatWasSeenOfOffers) {
  describe::Model model = door();
  model.instances[0].observed_ttl_s = 3;
  model.instances[0].observed_cycle = std::chrono::microseconds{1'003'700};
  const Profile profile = read_back(write_profile(model, {}));
  EXPECT_EQ(profile.service().ttl_s, 3U);
  EXPECT_EQ(profile.timing.cyclic_offer_delay, std::chrono::seconds{1});
}

TEST(ProfileWriter, WritesWhatAClientUses) {
  describe::Model model = door();
  const IpAddress client = IpAddress::v4(192, 168, 1, 12);
  const auto use = [&](std::uint16_t service, std::uint16_t group, bool udp, bool multicast) {
    return describe::ObservedUse{.client = client,
                                 .service = someip::ServiceId{service},
                                 .instance = someip::InstanceId{3},
                                 .major = 2,
                                 .eventgroup = someip::EventgroupId{group},
                                 .udp = udp,
                                 .tcp = !udp,
                                 .multicast = multicast};
  };
  model.observed_uses = {use(0x4711, 2, true, false), use(0x4711, 7, true, true),
                         use(0x4711, 9, false, false), use(0x4712, 1, false, false)};
  const WrittenProfile written = write_profile(model, {.device = client});
  const Profile profile = read_back(written);
  EXPECT_EQ(profile.device, client);
  EXPECT_TRUE(profile.services.empty());
  ASSERT_EQ(profile.uses.size(), 1U);  // the other one has nothing over UDP, which cases need
  const UsedService& used = profile.uses.front();
  EXPECT_EQ(used.service, someip::ServiceId{0x4711});
  EXPECT_EQ(used.instance, someip::InstanceId{3});
  EXPECT_EQ(used.major, 2);
  EXPECT_EQ(used.udp->id, someip::EventgroupId{2});
  EXPECT_EQ(used.udp->event, someip::MethodId{0x8010});
  EXPECT_EQ(used.multicast->id, someip::EventgroupId{7});
  EXPECT_EQ(used.tcp->id, someip::EventgroupId{9});
  EXPECT_THAT(written.text, HasSubstr("# which events it needs is a guess"));
  // A device that offers something goes before, unless the client is asked for.
  EXPECT_EQ(read_back(write_profile(model, {})).device, device);
  model.instances.clear();
  EXPECT_EQ(read_back(write_profile(model, {})).device, client);
}

IpAddress v6(std::uint8_t last) {
  return {{0xfd, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, last}, true};
}

TEST(ProfileWriter, WritesOfDevicesOverIpv6) {
  const IpAddress group{{0xff, 0x15, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}, true};
  describe::Model model = door();
  model.instances[2].address = v6(0xfe);
  model.instances[2].multicast.push_back(
      {.eventgroup = someip::EventgroupId{1}, .group = {group, 30713}, .threshold = 1});
  // Its group is a guess, as the one of its machine is of IPv4; so is the tester's address, which stays in
  // the subnet.
  const WrittenProfile guessed = write_profile(model, {.device = v6(0xfe)});
  EXPECT_THAT(guessed.text, HasSubstr("multicast: \"ff15::1\"  # a guess"));
  const Profile profile = read_back(guessed);
  EXPECT_EQ(profile.device, v6(0xfe));
  EXPECT_EQ(profile.tester, v6(1));
  EXPECT_EQ(profile.service().eventgroups[0].multicast, (Endpoint{group, 30713}));
  // A profile is all of one kind: what the tester has or where was listened chooses.
  EXPECT_EQ(read_back(write_profile(model, {.tester = v6(7)})).device, v6(0xfe));
  const Profile heard = read_back(write_profile(model, {.discovery = Endpoint{group, 30492}}));
  EXPECT_EQ(heard.device, v6(0xfe));
  EXPECT_EQ(heard.multicast, group);
  const WrittenProfile v4 = write_profile(model, {.tester = other});
  EXPECT_EQ(read_back(v4).device, device);
  EXPECT_THAT(v4.others, IsEmpty());
  model.instances = {{.service_id = someip::ServiceId{0x4711}}};
  EXPECT_TRUE(read_back(write_profile(model, {.tester = v6(7)})).device.v6);
  // Clients, too.
  model.instances.clear();
  model.observed_uses = {{.client = v6(9),
                          .service = someip::ServiceId{0x4711},
                          .instance = someip::InstanceId{3},
                          .major = 2,
                          .eventgroup = someip::EventgroupId{2},
                          .udp = true}};
  EXPECT_EQ(read_back(write_profile(model, {})).device, v6(9));
  EXPECT_THAT(write_profile(model, {.tester = other}).text, IsEmpty());
}

TEST(ProfileWriter, SaysWhatToAddWhereOnlyOffersWereSeen) {
  describe::Model model = door();
  EXPECT_THAT(write_profile(model, {}).text, Not(HasSubstr("# eventgroups:")));
  model.services[0].fields.clear();
  model.services[0].events.clear();
  EXPECT_THAT(write_profile(model, {}).text, Not(HasSubstr("# eventgroups:")));  // a method is known
  model.services[0].methods.clear();
  const std::string text = write_profile(model, {}).text;
  EXPECT_THAT(text, HasSubstr("    # request: {method: 0x0001, payload: \"00\"}\n"));
  // As it stands there it is right, and of the first service alone.
  const auto at = text.find("    # request:");
  EXPECT_EQ(text.find("# request:", at + 10), std::string::npos);
  std::string without_comments = text;
  for (const char* const line : {"    # request:", "    # eventgroups:"}) {
    without_comments.replace(without_comments.find(line) + 4, 2, "");
  }
  const Profile profile = read_back({.text = without_comments});
  EXPECT_TRUE(profile.service().request);
  EXPECT_EQ(profile.service().eventgroups.size(), 1U);
}

TEST(ProfileWriter, WritesNothingWhereNothingIsOffered) {
  describe::Model model = door();
  for (Instance& one : model.instances) {
    one.role = Instance::Role::required;
  }
  EXPECT_THAT(write_profile(model, {}).text, IsEmpty());
  EXPECT_THAT(write_profile({}, {}).text, IsEmpty());
}

}  // namespace
}  // namespace trestle::conform::profile_writer_test
