#include <algorithm>

#include "bridge/conform/cases/all_cases.hpp"
#include "bridge/conform/trial.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::conform {
namespace {

using namespace std::chrono_literals;
using enum Level;

/// What is asked of the acknowledgement of a good Subscribe, which has counter 5 and TTL 30.
auto acknowledgement(void (*judge)(Trial& t, const SeenEntry& ack, const sd::Entry& asked)) {
  return [judge](Trial& t) {
    const EventgroupProfile& group = t.eventgroup();
    const SdStimulus stimulus = t.subscribe(t.profile.service(), group.id, {t.own_endpoint()}, 30, 5);
    judge(t, t.answer_to(stimulus), stimulus.entries.front());
  };
}

/// A Subscribe that has to be refused, or may be ignored where the profile says so.
auto refused(void (*change)(sd::Entry& asked), bool judge_echo = true) {
  return [change, judge_echo](Trial& t) {
    SdStimulus stimulus = t.subscribe(t.eventgroup());
    sd::Entry& asked = stimulus.entries.front();
    asked.tail = sd::Entry::eventgroup_tail(asked.eventgroup(), 3, false);
    change(asked);
    const auto nack = t.not_acknowledged(stimulus);
    if (!nack) {
      if (t.profile.policy.refuses_unknown_subscriptions) {
        t.missing("no SubscribeEventgroupNack", "a SubscribeEventgroupNack");
      }
      t.nonstrict("ignored, where the specification asks for a SubscribeEventgroupNack");
      return;
    }
    if (judge_echo) {
      t.equal("Service ID", value(asked.service), value(nack->entry.service), nack->packet);
      t.equal("Instance ID", value(asked.instance), value(nack->entry.instance), nack->packet);
      t.equal("major version", asked.major, nack->entry.major, nack->packet);
      t.equal("eventgroup", value(asked.eventgroup()), value(nack->entry.eventgroup()), nack->packet);
      t.equal("counter", asked.counter(), nack->entry.counter(), nack->packet);
      t.equal("reserved bits", 0U, nack->entry.tail & 0xff70'0000U, nack->packet);
    }
  };
}

Endpoint own(Trial& t) {
  return t.tester.local(t.udp());
}

/// A Subscribe with these endpoint options, all of the first run, that has to be acknowledged.
auto good_options(std::vector<Bytes> (*options)(Trial& t)) {
  return [options](Trial& t) {
    t.acknowledged(t.subscribe(t.profile.service(), t.eventgroup().id, options(t)));
  };
}

/// One that must not be.
auto bad_options(std::vector<Bytes> (*options)(Trial& t)) {
  return [options](Trial& t) {
    t.not_acknowledged(t.subscribe(t.profile.service(), t.eventgroup().id, options(t)));
  };
}

/// One with an address that no subscriber can have, of the family that the device and the tester have.
auto bad_endpoint(const char* v4, const char* v6) {
  return [=](Trial& t) {
    const Endpoint endpoint{*someip::parse_address(t.profile.device.v6 ? v6 : v4), own(t).port};
    t.not_acknowledged(
        t.subscribe(t.profile.service(), t.eventgroup().id, {endpoint_option(endpoint, Transport::udp)}));
  };
}

void several(Trial& t) {
  SdStimulus all;
  std::size_t count = 0;
  for (const EventgroupProfile& group : t.profile.service().eventgroups) {
    if (!group.tcp) {
      all.entries.push_back(t.subscribe(group).entries.front());
      ++count;
    }
  }
  if (count < 2) {
    t.unsupported("one eventgroup only");
  }
  all.options = {t.own_endpoint()};
  const std::size_t since = t.now();
  const auto acks = [&](const sd::Entry& entry) {
    return t.entries_since(since, [&](const SeenEntry& seen) {
      return Trial::is_answer_to(entry)(seen) && seen.entry.ttl_s != 0;
    });
  };
  const auto is_open = [&](const sd::Entry& entry) { return acks(entry).empty(); };
  t.will_unsubscribe(all);
  if (!t.ask([&] { t.send_sd(all); }, [&] { return std::ranges::none_of(all.entries, is_open); })) {
    const sd::Entry& open = *std::ranges::find_if(all.entries, is_open);
    t.missing(fmt::format("no acknowledgement of eventgroup {:#06x}, in a message with {} Subscribes",
                          value(open.eventgroup()), count),
              "a SubscribeEventgroupAck for each entry");
  }
  const Packet* const first = acks(all.entries.front()).front().packet;
  if (!std::ranges::all_of(all.entries,
                           [&](const sd::Entry& entry) { return acks(entry).front().packet == first; })) {
    t.nonstrict("the acknowledgements come in several messages, where TC8 expects one");
  }
}

}  // namespace

void add_sd_subscribe_cases(Cases& cases) {
  const Need group = Need::eventgroup;
  const Cases all{
      {.id = "sd.subscribe.ack.comes",
       .title = "acknowledges a Subscribe",
       .requirements = {"feat_req_someipsd_613", "feat_req_someipsd_441", "feat_req_someipsd_811"},
       .tc8 = {"SOMEIPSRV_SD_MESSAGE_11"},
       .needs = group,
       .run = [](Trial& t) { t.acknowledged(t.subscribe(t.eventgroup())); }},
      {.id = "sd.subscribe.ack.entry-type",
       .title = "acknowledges with entries of type 7",
       .requirements = {"feat_req_someipsd_614"},
       .tc8 = {"SOMEIPSRV_FORMAT_19"},
       .needs = group,
       .run = acknowledgement([](Trial& t, const SeenEntry& ack, const sd::Entry&) {
         t.equal("entry type", 7, static_cast<int>(ack.entry.type), ack.packet);
       })},
      {.id = "sd.subscribe.ack.size",
       .title = "acknowledges with entries of 16 bytes",
       .requirements = {"feat_req_someipsd_109"},
       .tc8 = {"SOMEIPSRV_FORMAT_20"},
       .needs = group,
       // Anything else cannot be taken apart, and then there is no answer.
       .run = acknowledgement([](Trial& t, const SeenEntry& ack, const sd::Entry&) {
         t.require(ack.message.entry_count() >= 1, "entries", "1 or more", "0", ack.packet);
       })},
      {.id = "sd.subscribe.ack.first-option",
       .title = "acknowledges with first options that begin at index 0",
       .requirements = {"feat_req_someipsd_348"},
       .tc8 = {"SOMEIPSRV_FORMAT_21"},
       .needs = group,
       .run = acknowledgement([](Trial& t, const SeenEntry& ack, const sd::Entry&) {
         t.equal("index of the first options", 0, ack.entry.first_run.index, ack.packet);
       })},
      {.id = "sd.subscribe.ack.service",
       .title = "acknowledges with the Service ID that was asked for",
       .requirements = {"feat_req_someipsd_614"},
       .tc8 = {"SOMEIPSRV_FORMAT_23", "SOMEIPSRV_SD_MESSAGE_13"},
       .needs = group,
       .run = acknowledgement([](Trial& t, const SeenEntry& ack, const sd::Entry& asked) {
         t.equal("Service ID", value(asked.service), value(ack.entry.service), ack.packet);
       })},
      {.id = "sd.subscribe.ack.instance",
       .title = "acknowledges with the Instance ID that was asked for",
       .requirements = {"feat_req_someipsd_614"},
       .tc8 = {"SOMEIPSRV_FORMAT_24"},
       .needs = group,
       .run = acknowledgement([](Trial& t, const SeenEntry& ack, const sd::Entry& asked) {
         t.equal("Instance ID", value(asked.instance), value(ack.entry.instance), ack.packet);
       })},
      {.id = "sd.subscribe.ack.major",
       .title = "acknowledges with the major version that was asked for",
       .requirements = {"feat_req_someipsd_614"},
       .tc8 = {"SOMEIPSRV_FORMAT_25"},
       .needs = group,
       .run = acknowledgement([](Trial& t, const SeenEntry& ack, const sd::Entry& asked) {
         t.equal("major version", asked.major, ack.entry.major, ack.packet);
       })},
      {.id = "sd.subscribe.ack.ttl",
       .title = "acknowledges with the TTL that was asked for",
       .requirements = {"feat_req_someipsd_614"},
       .tc8 = {"SOMEIPSRV_FORMAT_26"},
       .needs = group,
       .run = acknowledgement([](Trial& t, const SeenEntry& ack, const sd::Entry& asked) {
         t.equal("TTL", asked.ttl_s, ack.entry.ttl_s, ack.packet);
       })},
      {.id = "sd.subscribe.ack.reserved",
       .title = "acknowledges with reserved bits 0",
       .requirements = {"feat_req_someipsd_614"},
       .tc8 = {"SOMEIPSRV_FORMAT_27"},
       .needs = group,
       .run = acknowledgement([](Trial& t, const SeenEntry& ack, const sd::Entry&) {
         t.equal("reserved bits", 0U, ack.entry.tail & 0xff70'0000U, ack.packet);
       })},
      {.id = "sd.subscribe.ack.counter",
       .title = "acknowledges with the counter that was asked for",
       .requirements = {"feat_req_someipsd_614"},
       .needs = group,
       .run = acknowledgement([](Trial& t, const SeenEntry& ack, const sd::Entry& asked) {
         t.equal("counter", asked.counter(), ack.entry.counter(), ack.packet);
       })},
      {.id = "sd.subscribe.ack.eventgroup",
       .title = "acknowledges with the eventgroup that was asked for",
       .requirements = {"feat_req_someipsd_614"},
       .tc8 = {"SOMEIPSRV_FORMAT_28"},
       .needs = group,
       .run = acknowledgement([](Trial& t, const SeenEntry& ack, const sd::Entry& asked) {
         t.equal("eventgroup", value(asked.eventgroup()), value(ack.entry.eventgroup()), ack.packet);
       })},
      {.id = "sd.subscribe.ack.each-eventgroup",
       .title =
           "acknowledges subscriptions to each of its eventgroups, and then sends the values of its fields",
       .requirements = {"feat_req_someipsd_613", "feat_req_someipcompat_1202", "feat_req_someipsd_432"},
       .tc8 = {"SOMEIP_ETS_086", "SOMEIP_ETS_087"},
       .needs = group,
       .run =
           [](Trial& t) {
             for (const EventgroupProfile& one : t.profile.service().eventgroups) {
               if (one.initial_values && !one.tcp) {
                 t.initial_values(one.events, t.subscribe(one));
               } else if (!one.tcp) {
                 t.acknowledged(t.subscribe(one));
               }
             }
           }},
      {.id = "sd.subscribe.several-entries",
       .title = "acknowledges each of several Subscribes in one message",
       .requirements = {"feat_req_someipsd_836", "feat_req_someipsd_862"},
       .tc8 = {"SOMEIP_ETS_088"},
       .needs = group,
       .run = several},
      {.id = "sd.subscribe.again",
       .title = "acknowledges a subscription that is renewed",
       .requirements = {"feat_req_someipsd_441"},
       .needs = group,
       .run =
           [](Trial& t) {
             for (int count = 0; count < 3; ++count) {
               t.acknowledged(t.subscribe(t.eventgroup()));
             }
           }},
      {.id = "sd.subscribe.stop-and-subscribe",
       .title = "acknowledges a Subscribe that stands behind a StopSubscribe in one message",
       .requirements = {"feat_req_someipsd_862", "feat_req_someipsd_1178"},
       .tc8 = {"SOMEIP_ETS_107"},
       .needs = group,
       .run =
           [](Trial& t) {
             SdStimulus both = t.subscribe(t.eventgroup());
             t.acknowledged(both);
             both.entries.insert(both.entries.begin(), both.entries.front());
             both.entries.front().ttl_s = 0;
             if (!t.asked_for([&] { t.send_sd(both); },
                              [](const SeenEntry& seen) {
                                return seen.entry.kind() == sd::EntryKind::subscribe_eventgroup_ack;
                              })) {
               t.missing("no acknowledgement of the Subscribe", "a SubscribeEventgroupAck");
             }
           }},
      {.id = "sd.subscribe.stop-then-subscribe",
       .title = "acknowledges a subscription that is made anew after it was stopped",
       .requirements = {"feat_req_someipsd_332", "feat_req_someipsd_613"},
       .tc8 = {"SOMEIP_ETS_155"},
       .needs = group,
       .run =
           [](Trial& t) {
             const SdStimulus stimulus = t.subscribe(t.eventgroup());
             t.acknowledged(stimulus);
             t.unsubscribe(stimulus);
             t.pass();  // whatever it says to that is no answer to what follows
             t.acknowledged(stimulus);
           }},

      // What is not there.
      {.id = "sd.subscribe.nack.unknown-service",
       .title = "refuses a subscription to an unknown service",
       .requirements = {"feat_req_someipsd_1137", "feat_req_someipsd_619"},
       .tc8 = {"SOMEIPSRV_SD_MESSAGE_14", "SOMEIPSRV_SD_MESSAGE_16", "SOMEIP_ETS_143"},
       .needs = group,
       .run = refused([](sd::Entry& asked) { asked.service = someip::ServiceId{0x7abc}; })},
      {.id = "sd.subscribe.nack.unknown-instance",
       .title = "refuses a subscription to an unknown instance",
       .requirements = {"feat_req_someipsd_1137", "feat_req_someipsd_619"},
       .tc8 = {"SOMEIPSRV_SD_MESSAGE_17", "SOMEIP_ETS_141"},
       .needs = group,
       .run = refused([](sd::Entry& asked) { asked.instance = someip::InstanceId{0x7abc}; })},
      {.id = "sd.subscribe.nack.unknown-major",
       .title = "refuses a subscription to an unknown major version",
       .requirements = {"feat_req_someipsd_1137", "feat_req_someipsd_619"},
       .tc8 = {"SOMEIPSRV_SD_MESSAGE_18", "SOMEIP_ETS_142"},
       .needs = group,
       .run =
           refused([](sd::Entry& asked) { asked.major = static_cast<std::uint8_t>(asked.major + 0x70U); })},
      {.id = "sd.subscribe.nack.unknown-eventgroup",
       .title = "refuses a subscription to an unknown eventgroup",
       .requirements = {"feat_req_someipsd_1137", "feat_req_someipsd_619", "feat_req_someipsd_811"},
       .tc8 = {"SOMEIPSRV_SD_MESSAGE_19", "SOMEIP_ETS_140"},
       .needs = group,
       .run = refused([](sd::Entry& asked) {
         asked.tail = sd::Entry::eventgroup_tail(someip::EventgroupId{0x7abc}, 3, false);
       })},
      {.id = "sd.subscribe.nack.echo",
       .title = "refuses with the instance, eventgroup, version and reserved bits that were asked for",
       .requirements = {"feat_req_someipsd_619"},
       .tc8 = {"SOMEIPSRV_SD_MESSAGE_15"},
       .needs = group,
       .run = refused([](sd::Entry& asked) {
         asked.tail = sd::Entry::eventgroup_tail(someip::EventgroupId{0x7abd}, 9, false);
       })},

      // Endpoints.
      {.id = "sd.subscribe.endpoint.none",
       .title = "does not acknowledge a Subscribe without endpoint",
       .requirements = {"feat_req_someipsd_102", "feat_req_someipsd_1164", "feat_req_someipsd_1179"},
       .needs = group,
       .run = bad_options([](Trial&) { return std::vector<Bytes>{}; })},
      {.id = "sd.subscribe.endpoint.port-zero",
       .title = "does not acknowledge a Subscribe with port 0",
       .requirements = {"feat_req_someipsd_102"},
       .tc8 = {"SOMEIP_ETS_109"},
       .needs = group,
       .run = bad_options([](Trial& t) {
         return std::vector<Bytes>{endpoint_option({t.profile.tester, 0}, Transport::udp)};
       })},
      {.id = "sd.subscribe.endpoint.invalid",
       .title = "does not acknowledge a Subscribe with address 32.0.0.0, with IPv6 100::",
       .requirements = {"feat_req_someipsd_1233", "feat_req_someipsd_1135"},
       .tc8 = {"SOMEIP_ETS_110"},
       .needs = group,
       .run = bad_endpoint("32.0.0.0", "100::")},
      {.id = "sd.subscribe.endpoint.unspecified",
       .title = "does not acknowledge a Subscribe with address 0.0.0.0, with IPv6 ::",
       .requirements = {"feat_req_someipsd_1233"},
       .needs = group,
       .run = bad_endpoint("0.0.0.0", "::")},
      {.id = "sd.subscribe.endpoint.broadcast",
       .title = "does not acknowledge a Subscribe with the broadcast address, with IPv6 that of all hosts",
       .requirements = {"feat_req_someipsd_1233"},
       .tc8 = {"SOMEIP_ETS_154"},
       .needs = group,
       .run = bad_endpoint("255.255.255.255", "ff02::1")},
      {.id = "sd.subscribe.endpoint.multicast",
       .title = "does not acknowledge a Subscribe with a multicast address in an endpoint option",
       .requirements = {"feat_req_someipsd_1233"},
       .needs = group,
       .run = bad_endpoint("224.244.224.111", "ff15::111")},
      {.id = "sd.subscribe.endpoint.device-itself",
       .title = "does not acknowledge a Subscribe with its own address",
       .requirements = {"feat_req_someipsd_1233"},
       .tc8 = {"SOMEIP_ETS_162"},
       .needs = group,
       .run = bad_options([](Trial& t) {
         return std::vector<Bytes>{endpoint_option({t.profile.device, own(t).port}, Transport::udp)};
       })},
      {.id = "sd.subscribe.endpoint.other-subnet",
       .title = "does not acknowledge a Subscribe with an address of another subnet",
       .requirements = {"feat_req_someipsd_1135"},
       .tc8 = {"SOMEIP_ETS_163"},
       .needs = group,
       .run = bad_endpoint("111.111.111.111", "2001:db8::111")},
      {.id = "sd.subscribe.endpoint.unknown-protocol",
       .title = "does not acknowledge a Subscribe with a protocol that is neither UDP nor TCP",
       .requirements = {"feat_req_someipsd_102"},
       .tc8 = {"SOMEIP_ETS_119"},
       .needs = group,
       .run = bad_options(
           [](Trial& t) { return std::vector<Bytes>{endpoint_option(own(t), Transport{0x63})}; })},
      {.id = "sd.subscribe.endpoint.two-ports",
       .title = "does not acknowledge a Subscribe with two UDP endpoints",
       .requirements = {"feat_req_someipsd_1145", "feat_req_someipsd_1144"},
       .tc8 = {"SOMEIP_ETS_117"},
       .needs = group,
       .run = bad_options([](Trial& t) {
         Endpoint other = own(t);
         ++other.port;
         return std::vector<Bytes>{t.own_endpoint(), endpoint_option(other, Transport::udp)};
       })},
      {.id = "sd.subscribe.endpoint.tcp-without-connection",
       .title = "does not acknowledge a Subscribe over TCP without a connection",
       .requirements = {"feat_req_someipsd_767", "feat_req_someipsd_1137"},
       .tc8 = {"SOMEIP_ETS_096"},
       .needs = group | Need::tcp,
       .run =
           bad_options([](Trial& t) { return std::vector<Bytes>{endpoint_option(own(t), Transport::tcp)}; })},

      // Options.
      {.id = "sd.subscribe.option.reserved-bytes",
       .title = "acknowledges a Subscribe whose endpoint option has reserved bytes set",
       .requirements = {"feat_req_someipsd_129", "feat_req_someipsd_614"},
       .tc8 = {"SOMEIP_ETS_144"},
       .needs = group,
       .run = good_options([](Trial& t) {
         Bytes option = t.own_endpoint();
         option[3] = std::byte{0x5a};
         option[option.size() - 4] = std::byte{0xa5};
         return std::vector<Bytes>{option};
       })},
      {.id = "sd.subscribe.option.redundant",
       .title = "acknowledges a Subscribe that refers to an endpoint and a configuration",
       .requirements = {"feat_req_someipsd_1141"},
       .needs = group,
       .run = good_options([](Trial& t) {
         return std::vector<Bytes>{t.own_endpoint(), raw_option(6, 1, bytes({0, 3, 'a', '=', 'b', 0}))};
       })},
      {.id = "sd.subscribe.option.two-configurations",
       .title = "acknowledges a Subscribe with two configurations that say different things",
       .requirements = {"feat_req_someipsd_1146", "feat_req_someipsd_1147"},
       .needs = group,
       .run = good_options([](Trial& t) {
         return std::vector<Bytes>{t.own_endpoint(), raw_option(6, 1, bytes({0, 3, 'a', '=', 'b', 0})),
                                   raw_option(6, 1, bytes({0, 3, 'a', '=', 'c', 0}))};
       })},
      {.id = "sd.subscribe.option.unreferenced",
       .title = "acknowledges a Subscribe beside a configuration option that nothing refers to",
       .requirements = {"feat_req_someipsd_1141"},
       .tc8 = {"SOMEIP_ETS_175"},
       .needs = group,
       .run =
           [](Trial& t) {
             SdStimulus stimulus = t.subscribe(t.eventgroup());
             stimulus.options.push_back(raw_option(6, 1, bytes({0, 3, 'a', '=', 'b', 0})));
             t.acknowledged(stimulus);
           }},
      {.id = "sd.subscribe.option.second-run",
       .title = "acknowledges Subscribes whose endpoint stands in the first run, or in the second",
       .requirements = {"feat_req_someipsd_336", "feat_req_someipsd_343", "feat_req_someipsd_347"},
       .tc8 = {"SOMEIP_ETS_173"},
       .needs = group,
       .run =
           [](Trial& t) {
             SdStimulus stimulus = t.subscribe(t.eventgroup());
             stimulus.options.insert(stimulus.options.begin(),
                                     raw_option(6, 1, bytes({0, 3, 'a', '=', 'b', 0})));
             sd::Entry& entry = stimulus.entries.front();
             entry.first_run = {.index = 1, .count = 1};
             entry.second_run = {.index = 7, .count = 0};
             t.acknowledged(stimulus);
             t.unsubscribe(stimulus);
             t.pass();  // whatever it says to that is no answer to what follows
             entry.first_run = {.index = 0, .count = 0};
             entry.second_run = {.index = 1, .count = 1};
             t.acknowledged(stimulus);
           }},
      {.id = "sd.subscribe.trailing.counted",
       .title = "acknowledges a Subscribe with bytes behind the options, which Length counts",
       .requirements = {"feat_req_someipsd_44"},
       .tc8 = {"SOMEIP_ETS_176"},
       .needs = group,
       .run =
           [](Trial& t) {
             SdStimulus stimulus = t.subscribe(t.eventgroup());
             stimulus.counted_tail = bytes({1, 2, 3, 4, 5, 6, 7, 8});
             t.acknowledged(stimulus);
           }},
      {.id = "sd.subscribe.trailing.uncounted",
       .title = "acknowledges a Subscribe with bytes behind the message",
       .requirements = {"feat_req_someip_319"},
       .tc8 = {"SOMEIP_ETS_177"},
       .needs = group,
       .run =
           [](Trial& t) {
             SdStimulus stimulus = t.subscribe(t.eventgroup());
             stimulus.uncounted_tail = bytes({0, 0, 0, 0});
             t.acknowledged(stimulus);
           }},

      // Its end.
      {.id = "sd.subscription.stop-is-silent",
       .title = "does not answer a StopSubscribe",
       .level = tc8,
       .requirements = {"feat_req_someipsd_332", "feat_req_someipsd_1297"},
       .tc8 = {"SOMEIP_ETS_092"},
       .needs = group,
       .run =
           [](Trial& t) {
             const SdStimulus stimulus = t.subscribe(t.eventgroup());
             t.acknowledged(stimulus);
             const std::size_t since = t.now();
             t.unsubscribe(stimulus);
             t.pass();
             for (const SeenEntry& seen : t.entries_since(since, [](const SeenEntry& one) {
                    return one.entry.type == sd::EntryType::subscribe_eventgroup_ack;
                  })) {
               t.different("answer", "none", to_string(seen.entry.kind()), seen.packet);
             }
           }},
  };
  cases.insert(cases.end(), all.begin(), all.end());
}

}  // namespace trestle::conform
