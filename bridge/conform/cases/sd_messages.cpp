#include <algorithm>

#include "bridge/conform/cases/all_cases.hpp"
#include "bridge/conform/trial.hpp"

namespace trestle::conform {
namespace {

using namespace std::chrono_literals;
using enum Level;

/// The first endpoint of the offer that has this protocol; ends the case when there is none.
sd::EndpointOption endpoint_of(Trial& t, const SeenEntry& offer, Transport transport) {
  for (const sd::EndpointOption& one : offer.endpoints()) {
    if (one.transport == transport) {
      return one;
    }
  }
  const char* const name = transport == Transport::tcp ? "TCP" : "UDP";
  t.fail(fmt::format("the offer has no {} endpoint", name), fmt::format("an offer with a {} endpoint", name),
         "one without", offer.packet);
}

/// The first option of the entry of which that is true, whatever else is right in it. Ends the case when
/// there is none.
sd::Option first_option(Trial& t, const SeenEntry& seen, bool (*is_one)(sd::OptionType)) {
  for (const sd::Option& one : seen.options()) {
    if (is_one(one.type)) {
      return one;
    }
  }
  t.fail("the entry refers to no such option that is there", "an entry with the option", "one without",
         seen.packet);
}

/// Options that are known for something else may stand before it. One of an unknown type is meant for it.
sd::Option first_endpoint(Trial& t, const SeenEntry& seen) {
  return first_option(t, seen, [](sd::OptionType type) {
    return type == sd::OptionType::ipv4_endpoint || type == sd::OptionType::ipv6_endpoint ||
           !sd::is_known(type);
  });
}

sd::Option first_multicast(Trial& t, const SeenEntry& seen) {
  return first_option(t, seen, [](sd::OptionType type) {
    return type == sd::OptionType::ipv4_multicast || type == sd::OptionType::ipv6_multicast;
  });
}

/// What is asked of the offer that comes by itself.
auto offered(void (*judge)(Trial& t, const SeenEntry& offer)) {
  return [judge](Trial& t) { judge(t, t.offer()); };
}

/// What is asked of the acknowledgement of a multicast eventgroup: of its multicast option.
auto multicast_option(void (*judge)(Trial& t, const SeenEntry& ack, const sd::EndpointOption& option,
                                    const Endpoint& configured)) {
  return [judge](Trial& t) {
    const EventgroupProfile& group =
        t.eventgroup([](const EventgroupProfile& one) { return one.multicast.has_value(); });
    const SeenEntry ack = t.acknowledged(t.subscribe(group));
    const auto options = ack.endpoints(sd::EndpointRole::multicast);
    if (options.empty()) {
      t.fail("the acknowledgement has no multicast option (type 0x14 and Length 9, with IPv6 0x16 and 21)",
             "an acknowledgement with a multicast option", "one without", ack.packet);
    }
    judge(t, ack, options.front(), *group.multicast);
  };
}

/// Bytes of an address in the options of this network.
std::size_t address_bytes(const Trial& t) {
  return t.profile.device.v6 ? 16 : 4;
}

unsigned number(ByteView bytes, std::size_t at) {
  return at < bytes.size() ? std::to_integer<unsigned>(bytes[at]) : 0U;
}

}  // namespace

void add_sd_message_cases(Cases& cases) {
  const Cases all{
      {.id = "sd.header.client-id",
       .title = "sends SD messages with Client ID 0",
       .requirements = {"feat_req_someipsd_26"},
       .tc8 = {"SOMEIPSRV_FORMAT_01"},
       .run = offered([](Trial& t, const SeenEntry& offer) {
         // Within a vehicle, Client IDs may begin with a prefix.
         const unsigned client = value(offer.header.client);
         if (client != 0 && (client & 0xffU) == 0) {
           t.nonstrict(fmt::format("the Client ID is {:#06x}, 0 after a prefix", client));
         } else {
           t.equal("Client ID", 0U, client, offer.packet);
         }
       })},
      {.id = "sd.header.first-session",
       .title = "begins with Session ID 1",
       .requirements = {"feat_req_someipsd_26", "feat_req_someip_649"},
       .tc8 = {"SOMEIPSRV_FORMAT_02"},
       .needs = Need::restart,
       .run =
           [](Trial& t) {
             const std::size_t since = t.restart();
             // Whatever is in it. Where somebody else restarts the device, what it said before comes first:
             // up to where the number goes back.
             std::optional<SeenEntry> first;
             unsigned last = 0;
             for (const SeenEntry& seen : t.entries_since(
                      since, [&](const SeenEntry& one) { return one.packet->to == t.tester.sd_group(); })) {
               const unsigned session = value(seen.header.session);
               if (!first || session < last) {
                 first = seen;
               }
               last = session;
             }
             if (!first) {
               t.missing("no SD message by multicast after the start", "an SD message by multicast");
             }
             t.equal("Session ID", 1, value(first->header.session), first->packet);
           }},
      {.id = "sd.header.session-counts",
       .title = "counts the Session ID up by one with each SD message to the group",
       .requirements = {"feat_req_someipsd_26", "feat_req_someip_88"},
       .tc8 = {"SOMEIP_ETS_091"},
       .needs = Need::cyclic_offers,
       .run =
           [](Trial& t) {
             const std::size_t since = t.now();
             t.offer();
             t.offer();
             // Offers of other services may stand in messages of their own.
             const Packet* last = nullptr;
             unsigned expected = 0;
             for (const SeenEntry& seen : t.entries_since(
                      since, [&](const SeenEntry& one) { return one.packet->to == t.tester.sd_group(); })) {
               if (seen.packet == last) {
                 continue;
               }
               const unsigned session = value(seen.header.session);
               if (last != nullptr) {
                 t.equal("Session ID", expected, session, seen.packet);
               }
               last = seen.packet;
               expected = session == 0xffff ? 1 : session + 1;
             }
           }},
      {.id = "sd.header.session-wraps",
       .title = "goes from Session ID 0xffff to 1, and clears the reboot flag then",
       .requirements = {"feat_req_someip_677", "feat_req_someipsd_41"},
       .tc8 = {"SOMEIP_ETS_152"},
       .budget = 120s,
       .run =
           [](Trial& t) {
             // Finds by unicast make it count; many at once, as its answers may be lost. A device may answer
             // many of them by one message.
             constexpr std::size_t at_once = 50;
             constexpr Duration silence = 100ms;
             const auto answers = [&] {
               return t.entries_since(0, [&](const SeenEntry& seen) {
                 return Trial::is_offer(t.profile.service())(seen) && seen.packet->to == t.tester.sd();
               });
             };
             const auto began = std::chrono::steady_clock::now();
             std::optional<unsigned> last;
             std::int64_t counted = 0;
             int by_multicast = 0;
             while (true) {
               t.tester.packets().clear();
               for (std::size_t count = 0; count < at_once; ++count) {
                 t.send_sd({.entries = {Trial::find_entry(t.profile.service())}});
               }
               std::vector<SeenEntry> seen_now;
               std::size_t before = 0;
               do {
                 before = seen_now.size();
                 t.tester.receive(before == 0 ? t.profile.timing.answer_within : silence, [&] {
                   seen_now = answers();
                   return seen_now.size() > before;
                 });
               } while (seen_now.size() > before && seen_now.size() < at_once);
               if (seen_now.empty() && t.profile.policy.multicast_find_answers && ++by_multicast < 3) {
                 t.await_unicast_answers();  // those by multicast have Session IDs of their own
                 continue;
               }
               if (seen_now.empty()) {
                 t.inconclusive("Finds are not answered, so that nothing makes it count this far");
               }
               by_multicast = 0;
               for (const SeenEntry& seen : seen_now) {
                 const unsigned session = value(seen.header.session);
                 t.require(session != 0, "Session ID", "not 0", "0", seen.packet);
                 if (last && session < *last) {
                   t.equal("Session ID after 0xffff", 1U, session, seen.packet);
                   t.equal("Session ID before it", 0xffffU, *last, seen.packet);
                   t.equal("reboot flag after the wrap", false, seen.message.reboot(), seen.packet);
                   return;
                 }
                 counted += last ? session - *last : 0;
                 last = session;
               }
               // A device that answers slowly does not get there before the time of this case is over.
               const auto took = std::chrono::steady_clock::now() - began;
               if (took > 5s && (std::int64_t{0x10000} - *last) * took > counted * (100s - took)) {
                 t.unsupported(
                     fmt::format("the device counts {} Session IDs in {} s, too few to see it come to 0xffff",
                                 counted, took / 1s));
               }
             }
           }},
      {.id = "sd.header.protocol-version",
       .title = "sends SD messages with Protocol Version 1",
       .requirements = {"feat_req_someipsd_26", "feat_req_someip_90"},
       .tc8 = {"SOMEIPSRV_FORMAT_03"},
       .run = offered([](Trial& t, const SeenEntry& offer) {
         t.equal("Protocol Version", 1, offer.header.protocol, offer.packet);
       })},
      {.id = "sd.header.interface-version",
       .title = "sends SD messages with Interface Version 1",
       .requirements = {"feat_req_someipsd_26"},
       .tc8 = {"SOMEIPSRV_FORMAT_04"},
       .run = offered([](Trial& t, const SeenEntry& offer) {
         t.equal("Interface Version", 1, offer.header.interface_version, offer.packet);
       })},
      {.id = "sd.header.message-type",
       .title = "sends SD messages as notifications",
       .requirements = {"feat_req_someipsd_26"},
       .tc8 = {"SOMEIPSRV_FORMAT_05"},
       .run = offered([](Trial& t, const SeenEntry& offer) {
         t.equal("Message Type", someip::MessageType::notification, offer.header.type, offer.packet);
       })},
      {.id = "sd.header.return-code",
       .title = "sends SD messages with Return Code 0",
       .requirements = {"feat_req_someipsd_26"},
       .tc8 = {"SOMEIPSRV_FORMAT_06"},
       .run = offered([](Trial& t, const SeenEntry& offer) {
         t.equal("Return Code", someip::ReturnCode::ok, offer.header.return_code, offer.packet);
       })},
      {.id = "sd.flags.reboot",
       .title = "sets the reboot flag after its start",
       .requirements = {"feat_req_someipsd_40", "feat_req_someipsd_41"},
       .tc8 = {"SOMEIPSRV_FORMAT_07"},
       .needs = Need::restart,
       .run =
           [](Trial& t) {
             t.restart();
             const SeenEntry offer = t.offer();
             t.equal("reboot flag", true, offer.message.reboot(), offer.packet);
           }},
      {.id = "sd.flags.unicast",
       .title = "sets the unicast flag",
       .requirements = {"feat_req_someipsd_87", "feat_req_someipsd_100"},
       .tc8 = {"SOMEIPSRV_FORMAT_08"},
       .run = offered([](Trial& t, const SeenEntry& offer) {
         t.equal("unicast flag", true, offer.message.unicast(), offer.packet);
       })},
      {.id = "sd.flags.undefined",
       .title = "leaves undefined flags 0",
       .requirements = {"feat_req_someipsd_1180"},
       .tc8 = {"SOMEIPSRV_FORMAT_09"},
       .run = offered([](Trial& t, const SeenEntry& offer) {
         // TCI v3.0 of TC8 is older than explicit initial data, whose flag it takes for an undefined one.
         const unsigned undefined = t.profile.policy.explicit_initial_data ? 0x1fU : 0x3fU;
         t.equal("undefined flags", 0U, offer.message.flags() & undefined, offer.packet);
       })},
      {.id = "sd.flags.reserved",
       .title = "leaves the 24 bits after the flags 0",
       .requirements = {"feat_req_someipsd_42"},
       .tc8 = {"SOMEIPSRV_FORMAT_10"},
       .run = offered([](Trial& t, const SeenEntry& offer) {
         t.equal("reserved bits", 0U, offer.message.reserved(), offer.packet);
       })},

      {.id = "sd.offer.entry-type",
       .title = "offers its service with entries of type 1 and 16 bytes",
       .requirements = {"feat_req_someipsd_47", "feat_req_someipsd_252"},
       .tc8 = {"SOMEIPSRV_FORMAT_11"},
       .run = offered([](Trial& t, const SeenEntry& offer) {
         t.equal("entry type", 1, static_cast<int>(offer.entry.type), offer.packet);
       })},
      {.id = "sd.offer.first-option",
       .title = "answers a Find with an offer whose first options begin at index 0",
       .level = tc8,
       .requirements = {"feat_req_someipsd_47"},
       .tc8 = {"SOMEIPSRV_FORMAT_12"},
       .run =
           [](Trial& t) {
             const SeenEntry offer =
                 t.answer_to_find(Trial::find_entry(t.profile.service()), true, t.profile.service());
             // TC8 asks for index 0; the specification only for an endpoint there.
             const bool all_there = offer.options().size() == offer.entry.option_count();
             if (offer.entry.first_run.index != 0 && all_there && !offer.endpoints().empty()) {
               t.nonstrict(fmt::format("the first options begin at index {}, where an endpoint is",
                                       offer.entry.first_run.index));
             } else {
               t.equal("index of the first options", 0, offer.entry.first_run.index, offer.packet);
             }
           }},
      {.id = "sd.offer.options",
       .title = "answers a Find with an offer that refers to an option at least",
       .requirements = {"feat_req_someipsd_752"},
       .tc8 = {"SOMEIPSRV_FORMAT_13"},
       .run =
           [](Trial& t) {
             const SeenEntry offer =
                 t.answer_to_find(Trial::find_entry(t.profile.service()), true, t.profile.service());
             t.require(offer.entry.first_run.count >= 1, "number of first options", "1 or more",
                       std::to_string(offer.entry.first_run.count), offer.packet);
           }},
      {.id = "sd.offer.options-exist",
       .title = "refers only to options that are there",
       .requirements = {"feat_req_someipsd_336", "feat_req_someipsd_342"},
       .run = offered([](Trial& t, const SeenEntry& offer) {
         t.equal("options that are there", offer.entry.option_count(), offer.options().size(), offer.packet);
       })},
      {.id = "sd.offer.service",
       .title = "offers the configured Service ID",
       .requirements = {"feat_req_someipsd_47"},
       .tc8 = {"SOMEIPSRV_FORMAT_14", "SOMEIPSRV_BASIC_01"},
       .run = offered([](Trial& t, const SeenEntry& offer) {
         t.equal("Service ID", value(t.profile.service().service), value(offer.entry.service), offer.packet);
       })},
      {.id = "sd.offer.instance",
       .title = "offers the configured Instance ID",
       .requirements = {"feat_req_someipsd_47"},
       .tc8 = {"SOMEIPSRV_FORMAT_15"},
       .run = offered([](Trial& t, const SeenEntry& offer) {
         t.equal("Instance ID", value(t.profile.service().instance), value(offer.entry.instance),
                 offer.packet);
       })},
      {.id = "sd.offer.instance-is-one",
       .title = "offers no instance 0 or 0xffff",
       .requirements = {"feat_req_someip_579"},
       .tc8 = {"SOMEIPSRV_BASIC_02"},
       .run =
           [](Trial& t) {
             sd::Entry find = Trial::find_entry(t.profile.service());
             find.instance = someip::any_instance;
             // A cyclic offer does as well: whether Finds are answered is what other cases are about.
             const auto seen = t.asked_for([&] { t.send_sd({.entries = {find}}, true, "FindService"); },
                                           [&](const SeenEntry& one) {
                                             return one.entry.kind() == sd::EntryKind::offer_service &&
                                                    one.entry.service == t.profile.service().service;
                                           });
             if (!seen) {
               t.missing("no offer, nor an answer to a Find of any instance", "an OfferService");
             }
             t.require(someip::names_an_instance(seen->entry.instance), "Instance ID", "0x0001 to 0xfffe",
                       fmt::format("{:#06x}", value(seen->entry.instance)), seen->packet);
           }},
      {.id = "sd.offer.major",
       .title = "offers the configured major version",
       .requirements = {"feat_req_someipsd_47"},
       .tc8 = {"SOMEIPSRV_FORMAT_16", "SOMEIPSRV_SD_MESSAGE_03", "SOMEIPSRV_SD_MESSAGE_04"},
       .run = offered([](Trial& t, const SeenEntry& offer) {
         t.equal("major version", t.profile.service().major, offer.entry.major, offer.packet);
       })},
      {.id = "sd.offer.minor",
       .title = "offers the configured minor version",
       .requirements = {"feat_req_someipsd_47"},
       .tc8 = {"SOMEIPSRV_FORMAT_18", "SOMEIPSRV_SD_MESSAGE_05", "SOMEIPSRV_SD_MESSAGE_06"},
       .run = offered([](Trial& t, const SeenEntry& offer) {
         t.equal("minor version", t.profile.service().minor, offer.entry.minor(), offer.packet);
       })},
      {.id = "sd.offer.ttl",
       .title = "offers with the configured TTL",
       .requirements = {"feat_req_someipsd_253"},
       .tc8 = {"SOMEIPSRV_FORMAT_17", "SOMEIPSRV_SD_MESSAGE_07"},
       .run = offered([](Trial& t, const SeenEntry& offer) {
         if (const auto ttl = t.profile.service().ttl_s) {
           t.equal("TTL", *ttl, offer.entry.ttl_s, offer.packet);
         } else {
           t.unsupported("the profile does not tell the TTL");
         }
       })},
      {.id = "sd.offer.endpoint",
       .title = "offers with an endpoint option",
       .requirements = {"feat_req_someipsd_752", "feat_req_someipsd_849"},
       .tc8 = {"SOMEIPSRV_SD_MESSAGE_08"},
       .run = offered([](Trial& t, const SeenEntry& offer) {
         std::size_t udp = 0;
         std::size_t tcp = 0;
         for (const sd::EndpointOption& one : offer.endpoints()) {
           udp += one.transport == Transport::udp ? 1U : 0U;
           tcp += one.transport == Transport::tcp ? 1U : 0U;
         }
         t.require(udp + tcp >= 1, "endpoints", "1 or more", "0", offer.packet);
         t.require(udp <= 1 && tcp <= 1, "endpoints of one protocol", "1 at most",
                   std::to_string(std::max(udp, tcp)), offer.packet);
       })},
      {.id = "sd.offer.both-transports",
       .title = "names UDP and TCP in the answer to a Find when it has both",
       .requirements = {"feat_req_someipsd_752", "feat_req_someip_32"},
       .tc8 = {"SOMEIP_ETS_060"},
       .needs = Need::udp | Need::tcp,
       .run =
           [](Trial& t) {
             const SeenEntry offer =
                 t.answer_to_find(Trial::find_entry(t.profile.service()), true, t.profile.service());
             endpoint_of(t, offer, Transport::udp);
             endpoint_of(t, offer, Transport::tcp);
           }},
      {.id = "sd.offer.shared-port",
       .title = "offers two services at one UDP port",
       .requirements = {"feat_req_someip_445"},
       .tc8 = {"SOMEIPSRV_RPC_13"},
       .needs = Need::two_services | Need::udp,
       .run =
           [](Trial& t) {
             for (const ServiceProfile& other : t.profile.services) {
               if (other.service != t.profile.service().service &&
                   other.udp_port == t.profile.service().udp_port) {
                 const auto first = endpoint_of(t, t.offer(), Transport::udp);
                 const SeenEntry second = t.offer(other);
                 t.equal("UDP port", first.endpoint.port,
                         endpoint_of(t, second, Transport::udp).endpoint.port, second.packet);
                 return;
               }
             }
             t.unsupported("no two services share a port");
           }},

      {.id = "sd.option.endpoint.length",
       .title = "offers endpoints in options of Length 9, or 21 with IPv6",
       .requirements = {"feat_req_someipsd_129", "feat_req_someipsd_164", "feat_req_someipsd_133"},
       .tc8 = {"SOMEIPSRV_OPTIONS_01"},
       .run = offered([](Trial& t, const SeenEntry& offer) {
         t.equal("Length of the option", 5 + address_bytes(t), first_endpoint(t, offer).body.size(),
                 offer.packet);
       })},
      {.id = "sd.option.endpoint.type",
       .title = "offers endpoints in options of type 4, or 6 with IPv6",
       .requirements = {"feat_req_someipsd_127", "feat_req_someipsd_140"},
       .tc8 = {"SOMEIPSRV_OPTIONS_02"},
       .run = offered([](Trial& t, const SeenEntry& offer) {
         const sd::Option option = first_endpoint(t, offer);
         t.equal("type of the option",
                 t.profile.device.v6 ? sd::OptionType::ipv6_endpoint : sd::OptionType::ipv4_endpoint,
                 option.type, offer.packet);
       })},
      {.id = "sd.option.endpoint.reserved",
       .title = "leaves reserved bytes of endpoint options 0",
       .requirements = {"feat_req_someipsd_129"},
       .tc8 = {"SOMEIPSRV_OPTIONS_03", "SOMEIPSRV_OPTIONS_05"},
       .run = offered([](Trial& t, const SeenEntry& offer) {
         const ByteView body = first_endpoint(t, offer).body;
         t.equal("byte after the type", 0U, number(body, 0), offer.packet);
         t.equal("byte before the protocol", 0U, number(body, 1 + address_bytes(t)), offer.packet);
       })},
      {.id = "sd.option.endpoint.address",
       .title = "offers its own address",
       .requirements = {"feat_req_someipsd_128", "feat_req_someipsd_129"},
       .tc8 = {"SOMEIPSRV_OPTIONS_04"},
       .run = offered([](Trial& t, const SeenEntry& offer) {
         const ByteView body = first_endpoint(t, offer).body;
         for (std::size_t at = 0; at < address_bytes(t); ++at) {
           t.equal("byte of the address", unsigned{t.profile.device.bytes[at]}, number(body, 1 + at),
                   offer.packet);
         }
       })},
      {.id = "sd.option.endpoint.protocol",
       .title = "says UDP or TCP in endpoint options",
       .requirements = {"feat_req_someipsd_128", "feat_req_someipsd_129"},
       .tc8 = {"SOMEIPSRV_OPTIONS_06"},
       .run = offered([](Trial& t, const SeenEntry& offer) {
         const unsigned protocol = number(first_endpoint(t, offer).body, 2 + address_bytes(t));
         t.require(protocol == 0x11 || protocol == 0x06, "L4 protocol", "0x11 or 0x06",
                   fmt::format("{:#04x}", protocol), offer.packet);
       })},
      {.id = "sd.option.endpoint.port",
       .title = "offers the configured UDP port",
       .requirements = {"feat_req_someipsd_128", "feat_req_someip_659"},
       .tc8 = {"SOMEIPSRV_OPTIONS_07"},
       .needs = Need::udp,
       .run = offered([](Trial& t, const SeenEntry& offer) {
         t.equal("UDP port", *t.profile.service().udp_port,
                 endpoint_of(t, offer, Transport::udp).endpoint.port, offer.packet);
       })},
      {.id = "sd.option.endpoint.tcp",
       .title = "offers the configured TCP port",
       .requirements = {"feat_req_someipsd_128"},
       .tc8 = {"SOMEIPSRV_OPTIONS_15"},
       .needs = Need::tcp,
       .run = offered([](Trial& t, const SeenEntry& offer) {
         t.equal("TCP port", *t.profile.service().tcp_port,
                 endpoint_of(t, offer, Transport::tcp).endpoint.port, offer.packet);
       })},

      {.id = "sd.option.multicast.length",
       .title = "acknowledges a multicast eventgroup with an option of Length 9",
       .requirements = {"feat_req_someipsd_725", "feat_req_someipsd_854", "feat_req_someipsd_739",
                        "feat_req_someipsd_1083"},
       .tc8 = {"SOMEIPSRV_OPTIONS_08"},
       .needs = Need::multicast_events,
       .run =
           multicast_option([](Trial& t, const SeenEntry& ack, const sd::EndpointOption&, const Endpoint&) {
             t.equal("Length of the option", 5 + address_bytes(t), first_multicast(t, ack).body.size(),
                     ack.packet);
           })},
      {.id = "sd.option.multicast.type",
       .title = "acknowledges a multicast eventgroup with an option of type 0x14",
       .requirements = {"feat_req_someipsd_723", "feat_req_someipsd_737"},
       .tc8 = {"SOMEIPSRV_OPTIONS_09"},
       .needs = Need::multicast_events,
       .run = multicast_option(
           [](Trial& t, const SeenEntry& ack, const sd::EndpointOption& option, const Endpoint&) {
             t.equal("type of the option",
                     t.profile.device.v6 ? sd::OptionType::ipv6_multicast : sd::OptionType::ipv4_multicast,
                     option.type(), ack.packet);
           })},
      {.id = "sd.option.multicast.reserved",
       .title = "leaves reserved bytes of multicast options 0",
       .requirements = {"feat_req_someipsd_725"},
       .tc8 = {"SOMEIPSRV_OPTIONS_10", "SOMEIPSRV_OPTIONS_12"},
       .needs = Need::multicast_events,
       .run = multicast_option(
           [](Trial& t, const SeenEntry& ack, const sd::EndpointOption& option, const Endpoint&) {
             t.equal("byte after the type", 0, option.flags, ack.packet);
             t.equal("byte before the protocol", 0, option.reserved, ack.packet);
           })},
      {.id = "sd.option.multicast.address",
       .title = "names the configured multicast group",
       .requirements = {"feat_req_someipsd_724"},
       .tc8 = {"SOMEIPSRV_OPTIONS_11"},
       .needs = Need::multicast_events,
       .run = multicast_option(
           [](Trial& t, const SeenEntry& ack, const sd::EndpointOption& option, const Endpoint& configured) {
             t.require(option.endpoint.address == configured.address, "multicast address", "as configured",
                       "another", ack.packet);
           })},
      {.id = "sd.option.multicast.protocol",
       .title = "says UDP in multicast options",
       .requirements = {"feat_req_someipsd_725", "feat_req_someipsd_749", "feat_req_someipsd_739"},
       .tc8 = {"SOMEIPSRV_OPTIONS_13"},
       .needs = Need::multicast_events,
       .run = multicast_option(
           [](Trial& t, const SeenEntry& ack, const sd::EndpointOption& option, const Endpoint&) {
             t.equal("L4 protocol", Transport::udp, option.transport, ack.packet);
           })},
      {.id = "sd.option.multicast.port",
       .title = "names the configured multicast port",
       .requirements = {"feat_req_someipsd_724"},
       .tc8 = {"SOMEIPSRV_OPTIONS_14"},
       .needs = Need::multicast_events,
       .run = multicast_option(
           [](Trial& t, const SeenEntry& ack, const sd::EndpointOption& option, const Endpoint& configured) {
             t.equal("multicast port", configured.port, option.endpoint.port, ack.packet);
           })},
  };
  cases.insert(cases.end(), all.begin(), all.end());
}

}  // namespace trestle::conform
