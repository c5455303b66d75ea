#include <algorithm>

#include "bridge/conform/cases/all_cases.hpp"
#include "bridge/conform/trial.hpp"

namespace trestle::conform {
namespace {

using namespace std::chrono_literals;
using enum Level;

// --- Explicit initial data --------------------------------------------------------------------------------

const EventgroupProfile& with_values(Trial& t) {
  return t.eventgroup([](const EventgroupProfile& one) { return one.initial_values && !one.tcp; });
}

/// A Subscribe with the flag for explicit initial data in the message, and the wish for it in the entry.
SdStimulus asking(Trial& t, bool flag, bool wish) {
  SdStimulus stimulus = t.subscribe(with_values(t));
  if (flag) {
    stimulus.flags |= sd::explicit_initial_data_flag;
  }
  sd::Entry& entry = stimulus.entries.front();
  entry.tail = sd::Entry::eventgroup_tail(entry.eventgroup(), 0, wish);
  return stimulus;
}

void no_value_since(Trial& t, std::size_t since, const char* why) {
  t.pass();
  for (const someip::MethodId event : with_values(t).events) {
    for (const SeenMessage& seen : t.messages_since(since, t.is_event(event))) {
      t.different("initial event", std::string{"none, "} + why, "one", seen.packet);
      return;
    }
  }
}

// --- The SD endpoint option -------------------------------------------------------------------------------

Bytes sd_endpoint_option(const Endpoint& endpoint) {
  Bytes option = endpoint_option(endpoint, Transport::udp);
  option[2] = static_cast<std::byte>(endpoint.address.v6 ? sd::OptionType::ipv6_sd_endpoint
                                                         : sd::OptionType::ipv4_sd_endpoint);
  return option;
}

/// A port of ours that messages with this option name as their sender, with sessions of its own.
struct Channel {
  /// Ends the case where the device does not know the option.
  explicit Channel(Trial& t) : port{t.tester.open_udp()}, at{t.tester.local(port)} {
    if (!t.profile.policy.sd_endpoint_option) {
      t.unsupported("the profile says that the SD endpoint option is not known (policy: sd_endpoint_option)");
    }
    t.hear_sd_at(at);
  }

  void send(Trial& t, SdStimulus stimulus) {
    // The option stands first, so that what entries refer to moves up.  [feat_req_someipsd_1151]
    stimulus.options.insert(stimulus.options.begin(), sd_endpoint_option(at));
    for (sd::Entry& entry : stimulus.entries) {
      if (entry.first_run.count > 0) {
        ++entry.first_run.index;
      }
    }
    t.tester.send_sd(stimulus.encode(someip::SessionId{++session}, true),
                     {t.profile.device, t.profile.sd_port});
    t.is_stimulus("stimulus, with an SD endpoint option");
  }

  PortId port;
  Endpoint at;
  std::uint16_t session = 0;
};

/// The entry that comes to this endpoint, after up to three attempts.
SeenEntry answer_there(Trial& t, Channel& channel, const SdStimulus& stimulus, sd::EntryType type) {
  if (const auto seen = t.asked_for(
          [&] {
            if (type == sd::EntryType::offer_service) {
              t.await_unicast_answers();
            }
            channel.send(t, stimulus);
          },
          [&](const SeenEntry& one) { return one.entry.type == type && one.packet->to == channel.at; })) {
    return *seen;
  }
  t.missing("no answer to the endpoint that the SD endpoint option names", "an answer there");
}

SdStimulus find(Trial& t) {
  return {.entries = {Trial::find_entry(t.profile.service())}};
}

// --- What offers say --------------------------------------------------------------------------------------

/// The first service of which this is true.
const ServiceProfile& service_with(Trial& t, bool (*is_one)(const ServiceProfile&)) {
  const auto found = std::ranges::find_if(t.profile.services, is_one);
  if (found == t.profile.services.end()) {
    t.unsupported("no such service in the profile");
  }
  return *found;
}

/// The only option of this type of an offer.
sd::Option option_of(Trial& t, const SeenEntry& offer, sd::OptionType type, const char* name) {
  std::vector<sd::Option> all;
  for (const sd::Option& one : offer.options()) {
    if (one.type == type) {
      all.push_back(one);
    }
  }
  if (all.size() != 1) {
    t.fail(fmt::format("the offer has {} {} options, expected 1", all.size(), name),
           fmt::format("1 {} option", name), std::to_string(all.size()), offer.packet);
  }
  return all.front();
}

unsigned number16(ByteView bytes, std::size_t at) {
  return at + 1 < bytes.size()
             ? std::to_integer<unsigned>(bytes[at]) << 8U | std::to_integer<unsigned>(bytes[at + 1])
             : 0U;
}

auto balanced(void (*judge)(Trial& t, ByteView body, const LoadBalancingProfile& expected, Packet* packet)) {
  return [judge](Trial& t) {
    const ServiceProfile& service =
        service_with(t, [](const ServiceProfile& one) { return one.load_balancing.has_value(); });
    const SeenEntry offer = t.offer(service);
    const sd::Option option = option_of(t, offer, sd::OptionType::load_balancing, "load balancing");
    judge(t, option.body, *service.load_balancing, offer.packet);
  };
}

/// The items of a configuration option, as far as they can be read; "malformed" at the end otherwise.
std::vector<std::string> items_of(ByteView body) {
  std::vector<std::string> items;
  std::size_t at = 1;
  while (at < body.size() && std::to_integer<std::size_t>(body[at]) != 0) {
    const auto length = std::to_integer<std::size_t>(body[at]);
    if (at + 1 + length >= body.size()) {
      items.emplace_back("malformed: an item reaches beyond the option");
      return items;
    }
    std::string item;
    for (const std::byte one : body.subspan(at + 1, length)) {
      item += static_cast<char>(one);
    }
    items.push_back(item);
    at += 1 + length;
  }
  if (at + 1 != body.size()) {
    items.emplace_back("malformed: the option does not end with one item of length 0");
  }
  return items;
}

std::string joined(const std::vector<std::string>& items) {
  std::string all;
  for (const std::string& one : items) {
    all += (all.empty() ? "" : ", ") + one;
  }
  return all;
}

auto configured(void (*judge)(Trial& t, ByteView body, const std::vector<std::string>& expected,
                              Packet* packet)) {
  return [judge](Trial& t) {
    const ServiceProfile& service =
        service_with(t, [](const ServiceProfile& one) { return !one.configuration.empty(); });
    const SeenEntry offer = t.offer(service);
    const sd::Option option = option_of(t, offer, sd::OptionType::configuration, "configuration");
    judge(t, option.body, service.configuration, offer.packet);
  };
}

// --- Two major versions -----------------------------------------------------------------------------------

/// Both versions of the first service that has two.
std::array<const ServiceProfile*, 2> versions(Trial& t) {
  for (const ServiceProfile& one : t.profile.services) {
    if (const ServiceProfile* other = other_version(t.profile, one)) {
      return {&one, other};
    }
  }
  t.unsupported("no service in two major versions");
}

Trial::EntryIs is_offer_of_version(const ServiceProfile& service) {
  return [&service](const SeenEntry& seen) {
    return Trial::is_offer(service)(seen) && seen.entry.major == service.major;
  };
}

}  // namespace

void add_sd_option_cases(Cases& cases) {
  const Need values = Need::initial_values | Need::udp;
  const Cases all{
      {.id = "sd.initial-data.flag",
       .title = "says that it knows explicit initial data",
       .requirements = {"feat_req_someipsd_1187", "feat_req_someipsd_1194"},
       .run =
           [](Trial& t) {
             if (!t.profile.policy.explicit_initial_data) {
               t.unsupported(
                   "the profile says that explicit initial data is not known (policy: "
                   "explicit_initial_data)");
             }
             const SeenEntry offer = t.offer();
             t.equal("flag of explicit initial data", true,
                     (offer.message.flags() & sd::explicit_initial_data_flag) != 0, offer.packet);
           }},
      {.id = "sd.initial-data.asked-at-renewal",
       .title = "sends initial values for a renewed subscription that asks for them",
       .requirements = {"feat_req_someipsd_1188", "feat_req_someipsd_1194"},
       .needs = values,
       .run =
           [](Trial& t) {
             if (!t.profile.policy.explicit_initial_data) {
               t.unsupported("the profile says that explicit initial data is not known");
             }
             const SdStimulus subscribe = asking(t, true, true);
             t.initial_values({with_values(t).events.front()}, subscribe);
             t.pass();
             t.initial_values({with_values(t).events.front()}, [&] { t.acknowledged(subscribe); });
           }},
      {.id = "sd.initial-data.not-asked",
       .title = "sends no initial values to whom knows explicit initial data and does not ask for it",
       .requirements = {"feat_req_someipsd_1188", "feat_req_someipsd_1194"},
       .needs = values,
       .run =
           [](Trial& t) {
             if (!t.profile.policy.explicit_initial_data) {
               t.unsupported("the profile says that explicit initial data is not known");
             }
             const std::size_t since = t.now();
             t.acknowledged(asking(t, true, false));
             no_value_since(t, since, "as the entry does not ask for them");
           }},
      {.id = "sd.initial-data.flag-clear",
       .title = "ignores the wish for initial values of whom does not set the flag for it",
       .requirements = {"feat_req_someipsd_1188"},
       .needs = values,
       .run =
           [](Trial& t) {
             t.initial_values({with_values(t).events.front()}, asking(t, false, false));
             t.pass();
             const std::size_t since = t.now();
             t.acknowledged(asking(t, false, true));
             no_value_since(t, since, "as the subscription is renewed, and the flag is clear");
           }},

      {.id = "sd.endpoint-option.find",
       .title = "answers a Find at the endpoint that an SD endpoint option names",
       .requirements = {"feat_req_someipsd_1084", "feat_req_someipsd_1085", "feat_req_someipsd_1087",
                        "feat_req_someipsd_1100", "feat_req_someipsd_1101", "feat_req_someipsd_1103",
                        "feat_req_someipsd_809", "feat_req_someipsd_810"},
       .run =
           [](Trial& t) {
             Channel channel{t};
             answer_there(t, channel, find(t), sd::EntryType::offer_service);
           }},
      {.id = "sd.endpoint-option.subscribe",
       .title = "acknowledges a subscription at the endpoint that an SD endpoint option names",
       .requirements = {"feat_req_someipsd_1084", "feat_req_someipsd_814"},
       .needs = Need::eventgroup,
       .run =
           [](Trial& t) {
             Channel channel{t};
             const SdStimulus stimulus = t.subscribe(t.eventgroup());
             const SeenEntry ack =
                 answer_there(t, channel, stimulus, sd::EntryType::subscribe_eventgroup_ack);
             t.equal("TTL", stimulus.entries.front().ttl_s, ack.entry.ttl_s, ack.packet);
             SdStimulus stop = stimulus;
             stop.entries.front().ttl_s = 0;
             channel.send(t, stop);
           }},
      {.id = "sd.endpoint-option.surplus",
       .title = "ignores SD endpoint options after the first one",
       .requirements = {"feat_req_someipsd_1152", "feat_req_someipsd_1154"},
       .run =
           [](Trial& t) {
             Channel channel{t};
             const Endpoint other = t.tester.local(t.tester.open_udp());
             t.hear_sd_at(other);
             SdStimulus stimulus = find(t);
             stimulus.options = {sd_endpoint_option(other)};
             const std::size_t since = t.now();
             answer_there(t, channel, stimulus, sd::EntryType::offer_service);
             t.pass();
             for (const SeenEntry& seen :
                  t.entries_since(since, [&](const SeenEntry& one) { return one.packet->to == other; })) {
               t.different("receiver", "the endpoint of the first option alone", "that of the second",
                           seen.packet);
             }
           }},
      {.id = "sd.endpoint-option.reboot",
       .title = "keeps the sessions of an SD endpoint apart from those of the sender's address",
       .requirements = {"feat_req_someipsd_1084", "feat_req_someipsd_765"},
       .needs = Need::event,
       .run =
           [](Trial& t) {
             const EventSource source = t.source();
             t.acknowledged(t.subscribe(source));
             // Session 1 with the reboot flag: of the sender's own relation it would be a reboot.
             Channel channel{t};
             answer_there(t, channel, find(t), sd::EntryType::offer_service);
             t.event(source);
           }},
      {.id = "sd.endpoint-option.not-sent",
       .title = "refers to no SD endpoint in its offers",
       .requirements = {"feat_req_someipsd_1082", "feat_req_someipsd_1114", "feat_req_someipsd_1151"},
       .run =
           [](Trial& t) {
             const SeenEntry offer = t.offer();
             for (const sd::Option& option : offer.options()) {
               t.require(option.type != sd::OptionType::ipv4_sd_endpoint &&
                             option.type != sd::OptionType::ipv6_sd_endpoint,
                         "option of the offer", "no SD endpoint", "an SD endpoint", offer.packet);
             }
           }},

      {.id = "sd.option.load-balancing.length",
       .title = "ranks a service with a load balancing option of Length 5",
       .requirements = {"feat_req_someipsd_146", "feat_req_someipsd_175"},
       .needs = Need::load_balancing,
       .run = balanced([](Trial& t, ByteView body, const LoadBalancingProfile&, Packet* packet) {
         t.equal("Length of the option", std::size_t{5}, body.size(), packet);
       })},
      {.id = "sd.option.load-balancing.reserved",
       .title = "leaves the reserved byte of load balancing options 0",
       .requirements = {"feat_req_someipsd_175"},
       .needs = Need::load_balancing,
       .run = balanced([](Trial& t, ByteView body, const LoadBalancingProfile&, Packet* packet) {
         t.equal("byte after the type", 0U, std::to_integer<unsigned>(body.front()) & 0x7fU, packet);
       })},
      {.id = "sd.option.load-balancing.priority",
       .title = "names the configured priority of a service",
       .requirements = {"feat_req_someipsd_175", "feat_req_someipsd_754"},
       .needs = Need::load_balancing,
       .run = balanced([](Trial& t, ByteView body, const LoadBalancingProfile& expected, Packet* packet) {
         t.equal("priority", unsigned{expected.priority}, number16(body, 1), packet);
       })},
      {.id = "sd.option.load-balancing.weight",
       .title = "names the configured weight of a service",
       .requirements = {"feat_req_someipsd_175", "feat_req_someipsd_754"},
       .needs = Need::load_balancing,
       .run = balanced([](Trial& t, ByteView body, const LoadBalancingProfile& expected, Packet* packet) {
         t.equal("weight", unsigned{expected.weight}, number16(body, 3), packet);
       })},
      {.id = "sd.option.configuration.items",
       .title = "names the configured items of a service, in their order, equal keys included",
       .requirements = {"feat_req_someipsd_152", "feat_req_someipsd_149", "feat_req_someipsd_684",
                        "feat_req_someipsd_857", "feat_req_someipsd_151", "feat_req_someipsd_158",
                        "feat_req_someipsd_160", "feat_req_someipsd_217"},
       .needs = Need::configuration,
       .run =
           configured([](Trial& t, ByteView body, const std::vector<std::string>& expected, Packet* packet) {
             t.equal("items", joined(expected), joined(items_of(body)), packet);
           })},
      {.id = "sd.option.configuration.reserved",
       .title = "leaves the reserved byte of configuration options 0",
       .requirements = {"feat_req_someipsd_152"},
       .needs = Need::configuration,
       .run = configured([](Trial& t, ByteView body, const std::vector<std::string>&, Packet* packet) {
         t.equal("byte after the type", 0U,
                 body.empty() ? 0x100U : std::to_integer<unsigned>(body.front()) & 0x7fU, packet);
       })},
      {.id = "sd.option.configuration.end",
       .title = "ends configuration options with an item of length 0",
       .requirements = {"feat_req_someipsd_150", "feat_req_someipsd_152"},
       .needs = Need::configuration,
       .run = configured([](Trial& t, ByteView body, const std::vector<std::string>&, Packet* packet) {
         t.equal("last byte", 0U, body.empty() ? 0x100U : std::to_integer<unsigned>(body.back()), packet);
       })},

      {.id = "sd.versions.offers",
       .title = "offers each major version of a service",
       .requirements = {"feat_req_someipcompat_800", "feat_req_someipcompat_803"},
       .needs = Need::two_versions,
       .run =
           [](Trial& t) {
             for (const ServiceProfile* one : versions(t)) {
               sd::Entry entry = Trial::find_entry(*one);
               entry.major = one->major;
               if (!t.asked_for([&] { t.send_sd({.entries = {entry}}, true, "FindService"); },
                                is_offer_of_version(*one))) {
                 t.missing(fmt::format("no offer of major version {}", one->major), "an OfferService");
               }
             }
           }},
      {.id = "sd.versions.find",
       .title = "answers a Find of one major version with that one alone",
       .requirements = {"feat_req_someipcompat_802", "feat_req_someipsd_239"},
       .needs = Need::two_versions,
       .run =
           [](Trial& t) {
             const auto both = versions(t);
             sd::Entry entry = Trial::find_entry(*both[0]);
             entry.major = both[0]->major;
             // What comes once may be a late answer to a Find of before.
             for (int round = 1;; ++round) {
               const std::size_t since = t.now();
               t.answer_to_find(entry, true, *both[0]);
               t.pass();
               const auto others = t.entries_since(since, [&](const SeenEntry& seen) {
                 return is_offer_of_version(*both[1])(seen) && seen.packet->to == t.tester.sd();
               });
               if (others.empty()) {
                 return;
               }
               if (round == 3) {
                 t.different("major version of the answer", std::to_string(both[0]->major),
                             std::to_string(others.front().entry.major), others.front().packet);
                 return;
               }
             }
           }},
      {.id = "sd.versions.requests",
       .title = "answers requests to each major version with its own interface version",
       .requirements = {"feat_req_someipcompat_714", "feat_req_someipcompat_801"},
       .needs = Need::two_versions,
       .run =
           [](Trial& t) {
             for (const ServiceProfile* one : versions(t)) {
               if (!one->request || !one->udp_port) {
                 t.unsupported("the profile names no request of a version");
               }
               const SeenMessage seen = t.answer_from(*one, fmt::format("major version {}", one->major));
               t.equal("Interface Version", one->major, seen.message.header.interface_version, seen.packet);
               t.equal("Return Code", someip::ReturnCode::ok, seen.message.header.return_code, seen.packet);
             }
           }},
  };
  cases.insert(cases.end(), all.begin(), all.end());
}

}  // namespace trestle::conform
