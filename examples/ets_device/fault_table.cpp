#include <algorithm>
#include <array>
#include <chrono>
#include <cstring>
#include <map>
#include <set>

#include "faults.hpp"

namespace ets {
namespace {

// --- Numbers in messages ----------------------------------------------------------------------------------

unsigned u16(std::span<const std::uint8_t> bytes, std::size_t at) {
  return bytes[at] * 256U + bytes[at + 1];
}
unsigned u32(std::span<const std::uint8_t> bytes, std::size_t at) {
  return u16(bytes, at) << 16U | u16(bytes, at + 2);
}
void set16(Span bytes, std::size_t at, unsigned number) {
  bytes[at] = static_cast<std::uint8_t>(number >> 8U);
  bytes[at + 1] = static_cast<std::uint8_t>(number);
}
void set32(Span bytes, std::size_t at, unsigned number) {
  set16(bytes, at, number >> 16U);
  set16(bytes, at + 2, number);
}
void set24(Span bytes, std::size_t at, unsigned number) {
  bytes[at] = static_cast<std::uint8_t>(number >> 16U);
  set16(bytes, at + 1, number);
}
unsigned u24(std::span<const std::uint8_t> bytes, std::size_t at) {
  return bytes[at] * 0x10000U + u16(bytes, at + 1);
}
void add8(Span bytes, std::size_t at, unsigned more = 1) {
  bytes[at] = static_cast<std::uint8_t>(bytes[at] + more);
}
void add16(Span bytes, std::size_t at, unsigned more = 1) {
  set16(bytes, at, u16(bytes, at) + more);
}

// --- What is in a message ---------------------------------------------------------------------------------

constexpr std::size_t flags_at = 16;
constexpr std::size_t entries_at = 24;

bool is_sd(std::span<const std::uint8_t> bytes) {
  return bytes.size() >= 28 && u32(bytes, 0) == 0xffff8100;
}
bool is_message(std::span<const std::uint8_t> bytes) {
  return bytes.size() >= 16 && !is_sd(bytes);
}
bool is_response(std::span<const std::uint8_t> bytes) {
  return is_message(bytes) && (bytes[14] & 0xdeU) == 0x80;
}
bool is_event(std::span<const std::uint8_t> bytes) {
  return is_message(bytes) && (bytes[14] & 0xdfU) == 0x02;
}
std::size_t options_at(std::span<const std::uint8_t> bytes) {
  return entries_at + u32(bytes, 20) + 4;
}

using EntryDo = std::function<void(Span entry)>;
using EntryIs = bool (*)(std::span<const std::uint8_t> entry);

bool is_offer(std::span<const std::uint8_t> entry) {
  return entry[0] == 1 && u24(entry, 9) != 0;
}
bool is_stop_offer(std::span<const std::uint8_t> entry) {
  return entry[0] == 1 && u24(entry, 9) == 0;
}
bool is_ack(std::span<const std::uint8_t> entry) {
  return entry[0] == 7 && u24(entry, 9) != 0;
}
bool is_nack(std::span<const std::uint8_t> entry) {
  return entry[0] == 7 && u24(entry, 9) == 0;
}
bool is_find(std::span<const std::uint8_t> entry) {
  return entry[0] == 0;
}
bool is_subscribe(std::span<const std::uint8_t> entry) {
  return entry[0] == 6 && u24(entry, 9) != 0;
}
bool is_stop_subscribe(std::span<const std::uint8_t> entry) {
  return entry[0] == 6 && u24(entry, 9) == 0;
}
bool any_entry(Span bytes, EntryIs wanted) {
  if (is_sd(bytes)) {
    for (std::size_t at = entries_at; at + 16 <= std::min(entries_at + u32(bytes, 20), bytes.size());
         at += 16) {
      if (wanted(bytes.subspan(at, 16))) {
        return true;
      }
    }
  }
  return false;
}

// --- Ways to make a fault ---------------------------------------------------------------------------------

/// In each SD message.
Out sd(std::function<void(Span)> change) {
  return [=](Outgoing& out) {
    if (is_sd(out.bytes)) {
      change(out.bytes);
    }
  };
}
/// In each such entry.
Out entry(EntryIs wanted, EntryDo change) {
  return sd([=](Span bytes) {
    for (std::size_t at = entries_at; at + 16 <= std::min(entries_at + u32(bytes, 20), bytes.size());
         at += 16) {
      if (wanted(bytes.subspan(at, 16))) {
        change(bytes.subspan(at, 16));
      }
    }
  });
}
/// In each option of such a type. With its Length and Type fields.
Out option(std::uint8_t type, EntryDo change) {
  return sd([=](Span bytes) {
    for (std::size_t at = options_at(bytes); at + 3 <= bytes.size(); at += 3 + u16(bytes, at)) {
      if (bytes[at + 2] == type && at + 3 + u16(bytes, at) <= bytes.size()) {
        const std::size_t size = 3 + u16(bytes, at);
        change(bytes.subspan(at, size));
        return;  // its length may be another one now
      }
    }
  });
}
/// The message gets lost that has such an entry.
Out lose(EntryIs wanted) {
  return [=](Outgoing& out) {
    if (any_entry(out.bytes, wanted)) {
      out.copies = 0;
    }
  };
}
Out response(std::function<void(Bytes&)> change) {
  return [=](Outgoing& out) {
    if (is_response(out.bytes)) {
      change(out.bytes);
    }
  };
}
Out error(std::function<void(Bytes&)> change) {
  return response([=](Bytes& bytes) {
    if (bytes[15] != 0) {
      change(bytes);
    }
  });
}
Out good(std::function<void(Bytes&)> change) {
  return response([=](Bytes& bytes) {
    if (bytes[15] == 0) {
      change(bytes);
    }
  });
}
void add_payload(Bytes& bytes, std::size_t count) {
  bytes.resize(bytes.size() + count);
  set32(bytes, 4, static_cast<unsigned>(bytes.size() - 8));
}
Out event(std::function<void(Outgoing&)> change) {
  return [=](Outgoing& out) {
    if (is_event(out.bytes)) {
      change(out);
    }
  };
}

/// An acknowledgement of whatever begins at an entry's place like a Subscribe.
Bytes acknowledgement(Span sd_message, unsigned ttl_s) {
  Bytes bytes(44);
  static unsigned session = 0x4000;
  set32(bytes, 0, 0xffff8100);
  set32(bytes, 4, 36);
  set16(bytes, 10, ++session);
  bytes[12] = 1;
  bytes[13] = 1;
  bytes[14] = 2;
  bytes[16] = 0xe0;
  set32(bytes, 20, 16);
  std::copy_n(sd_message.begin() + entries_at, 16, bytes.begin() + entries_at);
  bytes[entries_at] = 7;
  bytes[entries_at + 1] = bytes[entries_at + 2] = bytes[entries_at + 3] = 0;
  set24(bytes, entries_at + 9, ttl_s);
  return bytes;
}

In subscribe_message(std::function<void(Incoming&)> change) {
  return [=](Incoming& in) {
    if (in.bytes.size() >= entries_at + 16 && u32(in.bytes, 0) == 0xffff8100 && in.bytes[entries_at] == 6) {
      change(in);
    }
  };
}
In acknowledge_if(std::function<bool(Span)> wanted) {
  return subscribe_message([=](Incoming& in) {
    const unsigned ttl_s = u24(in.bytes, entries_at + 9);
    if (ttl_s != 0 && wanted(in.bytes)) {
      in.answers.push_back(acknowledgement(in.bytes, ttl_s));
    }
  });
}

In find_message(std::function<void(Incoming&)> change) {
  return [=](Incoming& in) {
    if (in.bytes.size() >= entries_at + 16 && is_sd(in.bytes) && in.bytes[entries_at] == 0) {
      change(in);
    }
  };
}

/// What answers a request, without looking at it.
Bytes answer(Span request, unsigned type, unsigned code) {
  Bytes bytes(request.begin(), request.begin() + 16);
  set32(bytes, 4, 8);
  bytes[12] = 1;
  bytes[14] = static_cast<std::uint8_t>(type);
  bytes[15] = static_cast<std::uint8_t>(code);
  return bytes;
}
In answer_if(bool (*wanted)(Span), unsigned type, unsigned code) {
  return [=](Incoming& in) {
    if (is_message(in.bytes) && wanted(in.bytes)) {
      in.answers.push_back(answer(in.bytes, type, code));
    }
  };
}

bool is_protected(std::span<const std::uint8_t> message) {
  return u16(message, 0) == 0x0101 && u16(message, 2) >= 0x50 && u16(message, 2) <= 0x5c &&
         message.size() > 16;
}

/// Methods that have answered E_E2E_REPEATED.
std::set<unsigned> with_repeated_counter;

/// Puts one more entry into an SD message: a Find or a Subscribe that nobody needs.
void add_entry(Bytes& bytes, std::uint8_t type, unsigned service_used) {
  Bytes more(16);
  more[0] = type;
  set16(more, 4, service_used);
  set16(more, 6, 1);
  more[8] = 1;
  set24(more, 9, 3);
  set32(more, 12, type == 0 ? 0xffffffff : 1);
  bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(options_at(bytes)) - 4, more.begin(), more.end());
  set32(bytes, 20, u32(bytes, 20) + 16);
  set32(bytes, 4, u32(bytes, 4) + 16);
}
Out each_offer_has(std::uint8_t type, unsigned service_used) {
  return [=](Outgoing& out) {
    if (any_entry(out.bytes, is_offer)) {
      add_entry(out.bytes, type, service_used);
    }
  };
}

/// Address and port of the last Subscribe, for faults that need them.
std::array<unsigned, 2> last_subscriber{};
/// Whether an offer came that is none of ours.
bool offered_by_others = false;

}  // namespace

const std::vector<Fault>& faults() {
  static const std::vector<Fault> all{
      // Under load. These first: they take long.
      {"deaf-after-burst", "load.burst,load.flood", "after many datagrams within a second nothing is heard for a while", {},
       [](Incoming& in) {
         using Clock = std::chrono::steady_clock;
         static Clock::time_point second;
         static Clock::time_point deaf_until;
         static int count = 0;
         const Clock::time_point now = Clock::now();
         if (now - second > std::chrono::seconds{1}) {
           second = now;
           count = 0;
         }
         // Where fewer come at once, they have to be stranger.
         const bool strange = in.bytes.size() > 600 || (in.bytes.size() > 60 && u16(in.bytes, 0) != 0x0101);
         count += strange ? 20 : 1;
         if (count > 150) {
           deaf_until = now + std::chrono::seconds{20};
         }
         in.lost = now < deaf_until;
       }},
      {"answers-twice", "load.burst.requests", "responses are sent twice",
       [](Outgoing& out) { out.copies = is_response(out.bytes) ? 2 : 1; }},
      {"subscribers-forgotten", "load.peers.subscribers", "of many subscribers only one gets events",
       event([](Outgoing& out) {
         static unsigned port = out.to_port;
         out.copies = out.to_port == port ? 1 : 0;
       })},
      {"connections-stay", "load.peers.connections,load.half-open", "after some connections TCP is served no more",
       [](Outgoing& out) {
         if (out.stream) {
           out.copies = 0;
         }
       }},

      // The header of SD messages.
      {"sd-client", "sd.header.client-id", "SD messages have Client ID 1", sd([](Span b) { set16(b, 8, 1); })},
      {"sd-session-zero", "sd.header.first-session", "sessions of SD count from 0",
       sd([](Span b) { add16(b, 10, 0xffff); })},
      {"sd-session-stuck", "sd.header.session-counts", "sessions of SD do not count", sd([](Span b) { set16(b, 10, 1); })},
      {"sd-session-wraps-to-0", "sd.header.session-wraps", "session 0 comes after 0xffff", sd([](Span b) {
         if (u16(b, 10) == 1 && (b[flags_at] & 0x80U) == 0) {
           set16(b, 10, 0);
         }
       })},
      {"sd-protocol", "sd.header.protocol-version", "SD messages have Protocol Version 2", sd([](Span b) { b[12] = 2; })},
      {"sd-interface", "sd.header.interface-version", "SD messages have Interface Version 2",
       sd([](Span b) { b[13] = 2; })},
      {"sd-type", "sd.header.message-type", "SD messages are requests", sd([](Span b) { b[14] = 0; })},
      {"sd-code", "sd.header.return-code", "SD messages have a return code", sd([](Span b) { b[15] = 1; })},
      {"sd-no-reboot-flag", "sd.flags.reboot", "the reboot flag is never set",
       sd([](Span b) { b[flags_at] = static_cast<std::uint8_t>(b[flags_at] & 0x7fU); })},
      {"sd-reboot-flag-stays", "sd.header.session-wraps", "the reboot flag stays set for ever",
       sd([](Span b) { b[flags_at] = static_cast<std::uint8_t>(b[flags_at] | 0x80U); })},
      {"sd-no-unicast-flag", "sd.flags.unicast", "the unicast flag is not set",
       sd([](Span b) { b[flags_at] = static_cast<std::uint8_t>(b[flags_at] & 0xbfU); })},
      {"sd-undefined-flag", "sd.flags.undefined", "an undefined flag is set",
       sd([](Span b) { b[flags_at] = static_cast<std::uint8_t>(b[flags_at] | 1U); })},
      {"sd-reserved", "sd.flags.reserved", "the reserved bytes after the flags are not 0", sd([](Span b) { b[19] = 1; })},

      // Offers.
      {"offer-service", "sd.offer.service", "offers name another service",
       entry(is_offer, [](Span e) { add16(e, 4, 0x0900); })},
      {"offer-instance", "sd.offer.instance", "offers name another instance",
       entry(is_offer, [](Span e) { add16(e, 6, 0x0900); })},
      {"offer-instance-any", "sd.offer.instance-is-one", "offers name instance 0xffff",
       entry(is_offer, [](Span e) { set16(e, 6, 0xffff); })},
      {"offer-major", "sd.offer.major", "offers name another major version", entry(is_offer, [](Span e) { add8(e, 8); })},
      {"offer-minor", "sd.offer.minor", "offers name another minor version",
       entry(is_offer, [](Span e) { add16(e, 14); })},
      {"offer-ttl", "sd.offer.ttl", "offers have another TTL", entry(is_offer, [](Span e) { add8(e, 11); })},
      {"offer-index", "sd.offer.first-option", "the first run of solicited offers begins at option 1",
       entry(is_offer, [](Span e) { e[1] = 1; })},
      {"offer-no-options", "sd.offer.options,sd.offer.endpoint", "offers refer to no options",
       entry(is_offer, [](Span e) { e[3] = 0; })},
      {"offer-beyond", "sd.offer.options-exist", "offers refer to more options than there are",
       entry(is_offer, [](Span e) { e[3] = 0xf0; })},
      {"offer-type", "sd.offer.entry-type", "offers are entries of type 3", entry(is_offer, [](Span e) { e[0] = 3; })},
      {"endpoint-length", "sd.option.endpoint.length", "endpoint options have Length 10",
       option(4, [](Span o) { set16(o, 0, 10); })},
      {"endpoint-type", "sd.option.endpoint.type", "endpoint options have type 0x44",
       option(4, [](Span o) { o[2] = 0x44; })},
      {"endpoint-reserved-1", "sd.option.endpoint.reserved", "the first reserved byte of endpoints is not 0",
       option(4, [](Span o) { o[3] = 1; })},
      {"endpoint-address", "sd.option.endpoint.address", "endpoints have another address",
       option(4, [](Span o) { add8(o, 7, 7); })},
      {"endpoint-reserved-2", "sd.option.endpoint.reserved", "the second reserved byte of endpoints is not 0",
       option(4, [](Span o) { o[8] = 1; })},
      {"endpoint-protocol", "sd.option.endpoint.protocol", "the first endpoint has protocol 0x84",
       option(4, [](Span o) { o[9] = 0x84; })},
      {"endpoint-port", "sd.option.endpoint.port", "the first endpoint has another port",
       option(4, [](Span o) { add16(o, 10, 100); })},
      {"offer-udp-only", "sd.option.endpoint.tcp,sd.offer.both-transports", "TCP endpoints say UDP", sd([](Span b) {
         for (std::size_t at = options_at(b); at + 12 <= b.size(); at += 3 + u16(b, at)) {
           if (b[at + 2] == 4 && b[at + 9] == 6) {
             b[at + 9] = 0x11;
           }
         }
       })},
      {"no-cyclic-offers", "sd.phase.cyclic,sd.header.session-counts", "there are no cyclic offers", [](Outgoing& out) {
         // Those of the start-up go out within half a second.
         static const auto start = std::chrono::steady_clock::now();
         if (out.multicast && any_entry(out.bytes, is_offer) &&
             std::chrono::steady_clock::now() - start > std::chrono::milliseconds{800}) {
           out.copies = 0;
         }
       }},
      {"offers-twice", "sd.phase.cyclic,sd.phase.repetition", "each offer is sent twice", [](Outgoing& out) {
         if (any_entry(out.bytes, is_offer)) {
           out.copies = 2;
         }
       }},
      {"no-repetitions", "sd.phase.repetition", "the second and third offer are not sent", [](Outgoing& out) {
         static int offers = 0;
         if (any_entry(out.bytes, is_offer) && (++offers == 2 || offers == 3)) {
           out.copies = 0;
         }
       }},
      {"no-stop-offer", "sd.stop-offer", "nothing is said when services stop", lose(is_stop_offer)},
      {"find-ignored", "sd.find.unicast,sd.find.multicast", "Finds are not answered", {}, [](Incoming& in) {
         in.lost = in.bytes.size() >= entries_at + 16 && is_sd(in.bytes) && in.bytes[entries_at] == 0;
       }},
      {"find-exact-major-only", "sd.find.any-major", "Finds of any major version are not answered", {},
       [](Incoming& in) {
         in.lost = in.bytes.size() >= entries_at + 16 && is_sd(in.bytes) && in.bytes[entries_at] == 0 &&
                   in.bytes[entries_at + 8] == 0xff && u16(in.bytes, entries_at + 6) == 0xffff;
       }},
      {"find-any-answers-one", "sd.find.two-instances", "a Find of any instance is answered with one only",
       entry([](std::span<const std::uint8_t> e) { return is_offer(e) && u16(e, 6) == 2; },
             [](Span e) { set16(e, 4, 0x0999); })},
      {"find-other-major", "sd.find.other-major,sd.find.other-minor,sd.find.other-instance,sd.find.other-service",
       "a Find of what is not there is answered", {}, [](Incoming& in) {
         if (in.bytes.size() >= entries_at + 16 && is_sd(in.bytes) && in.bytes[entries_at] == 0) {
           set16(in.bytes, entries_at + 4, 0x0101);
           set16(in.bytes, entries_at + 6, 0x0001);
           in.bytes[entries_at + 8] = 0xff;
           set32(in.bytes, entries_at + 12, 0xffffffff);
         }
       }},
      {"find-needs-unicast-flag", "sd.find.unicast-flag-clear", "Finds without the unicast flag are not answered", {},
       [](Incoming& in) {
         in.lost = in.bytes.size() >= entries_at + 16 && is_sd(in.bytes) && in.bytes[entries_at] == 0 &&
                   (in.bytes[flags_at] & 0x40U) == 0;
       }},
      {"find-with-options-ignored", "sd.find.unreferenced-options", "Finds in messages with options are not answered", {},
       [](Incoming& in) {
         in.lost = in.bytes.size() > entries_at + 20 && is_sd(in.bytes) && in.bytes[entries_at] == 0;
       }},

      {"no-offers", "sd.phase.initial", "nothing is offered", lose(is_offer)},
      {"load-balancing-length", "sd.option.load-balancing.length", "load balancing options have a byte too many",
       [](Outgoing& out) {
         if (is_sd(out.bytes)) {
           for (std::size_t at = options_at(out.bytes); at + 3 <= out.bytes.size(); at += 3 + u16(out.bytes, at)) {
             if (out.bytes[at + 2] == 2) {
               set16(out.bytes, at, 6);
               out.bytes.insert(out.bytes.begin() + static_cast<std::ptrdiff_t>(at) + 8, 0);
               set32(out.bytes, options_at(out.bytes) - 4, u32(out.bytes, options_at(out.bytes) - 4) + 1);
               set32(out.bytes, 4, u32(out.bytes, 4) + 1);
               return;
             }
           }
         }
       }},
      {"load-balancing-reserved", "sd.option.load-balancing.reserved", "the reserved byte of load balancing is not 0",
       option(2, [](Span o) { o[3] = 1; })},
      {"load-balancing-priority", "sd.option.load-balancing.priority", "offers have another priority",
       option(2, [](Span o) { add16(o, 4); })},
      {"load-balancing-weight", "sd.option.load-balancing.weight", "offers have another weight",
       option(2, [](Span o) { add16(o, 6); })},
      {"configuration-reserved", "sd.option.configuration.reserved", "the reserved byte of configurations is not 0",
       option(1, [](Span o) { o[3] = 1; })},
      {"configuration-item", "sd.option.configuration.items", "a letter of a configuration item is another one",
       option(1, [](Span o) { o[5] ^= 1U; })},
      {"configuration-end", "sd.option.configuration.end", "configurations do not end with 0",
       option(1, [](Span o) { o[o.size() - 1] = 1; })},
      {"one-version-only", "sd.versions", "of a service in two versions, the newer one is offered as the older",
       entry([](std::span<const std::uint8_t> e) { return is_offer(e) && u16(e, 4) == 0x0103; },
             [](Span e) { e[8] = 1; })},
      {"any-version-answers", "sd.versions.find", "a Find of one major version is answered with all", {},
       find_message([](Incoming& in) { in.bytes[entries_at + 8] = 0xff; })},
      {"versions-mixed-up", "sd.versions.requests", "responses have the oldest interface version",
       response([](Bytes& b) { b[13] = 1; })},
      {"initial-data-flag", "sd.initial-data.flag", "SD messages do not say that explicit initial data is known",
       sd([](Span b) { b[flags_at] = static_cast<std::uint8_t>(b[flags_at] & 0xdfU); })},
      {"initial-data-always", "sd.initial-data.not-asked,sd.initial-data.flag-clear",
       "who subscribes gets initial values, whatever is asked for", {}, subscribe_message([](Incoming& in) {
         in.bytes[16] = static_cast<std::uint8_t>(in.bytes[16] | 0x20U);
         in.bytes[entries_at + 13] = static_cast<std::uint8_t>(in.bytes[entries_at + 13] | 0x80U);
       })},
      {"initial-data-unknown", "sd.initial-data.asked-at-renewal", "the wish for initial values is not seen", {},
       subscribe_message([](Incoming& in) {
         in.bytes[16] = static_cast<std::uint8_t>(in.bytes[16] & 0xdfU);
       })},
      {"initial-data-without-flag", "sd.initial-data.flag-clear", "the flag of explicit initial data is not looked at", {},
       subscribe_message([](Incoming& in) {
         if ((in.bytes[entries_at + 13] & 0x80U) != 0) {
           in.bytes[16] = static_cast<std::uint8_t>(in.bytes[16] | 0x20U);
         }
       })},
      {"sd-endpoint-unknown", "sd.endpoint-option", "SD endpoint options are not known", {}, [](Incoming& in) {
         if (is_sd(in.bytes) && in.bytes.size() >= options_at(in.bytes) + 12 && in.bytes[options_at(in.bytes) + 2] == 0x24) {
           in.bytes[options_at(in.bytes) + 2] = 0x77;
         }
       }},
      {"sd-endpoint-last-counts", "sd.endpoint-option.surplus", "the last SD endpoint option counts", {}, [](Incoming& in) {
         const std::size_t first = is_sd(in.bytes) ? options_at(in.bytes) : in.bytes.size();
         if (in.bytes.size() >= first + 24 && in.bytes[first + 2] == 0x24 && in.bytes[first + 14] == 0x24) {
           std::swap_ranges(in.bytes.begin() + static_cast<std::ptrdiff_t>(first),
                            in.bytes.begin() + static_cast<std::ptrdiff_t>(first) + 12,
                            in.bytes.begin() + static_cast<std::ptrdiff_t>(first) + 12);
         }
       }},
      {"sd-endpoint-sent", "sd.endpoint-option.not-sent", "offers refer to an SD endpoint option",
       option(4, [](Span o) { o[2] = 0x24; })},
      {"multicast-too-early", "event.multicast-threshold.below", "events go to the group whatever the threshold is",
       [](Outgoing& out) {
         // The group is that of the last acknowledgement.
         static std::uint32_t group = 0;
         static unsigned port = 0;
         option(0x14, [&](Span o) {
           group = u32(o, 4);
           port = u16(o, 10);
         })(out);
         if (is_event(out.bytes) && u16(out.bytes, 2) == 0x800c && group != 0) {
           out.to_address = group;
           out.to_port = port;
         }
       }},
      {"multicast-never", "event.multicast-threshold.reached", "events go to a subscriber, whatever the threshold is",
       [](Outgoing& out) {
         if (is_event(out.bytes) && u16(out.bytes, 2) == 0x800c && out.multicast && last_subscriber[1] != 0) {
           out.to_address = last_subscriber[0];
           out.to_port = last_subscriber[1];
         }
       },
       subscribe_message([](Incoming& in) {
         if (const std::size_t at = options_at(in.bytes); at + 12 <= in.bytes.size() && in.bytes[at + 2] == 4) {
           last_subscriber = {u32(in.bytes, at + 4), u16(in.bytes, at + 10)};
         }
       })},
      {"second-service-elsewhere", "sd.offer.shared-port", "the second service is offered at the ports of another one",
       entry([](std::span<const std::uint8_t> e) { return is_offer(e) && u16(e, 4) == 0x0102; },
             [](Span e) { add8(e, 1, 2); })},
      {"find-exact-ignored", "sd.find.exact", "Finds of a minor version are not answered", {},
       find_message([](Incoming& in) { in.lost = u32(in.bytes, entries_at + 12) != 0xffffffff; })},
      {"find-instance-ignored", "sd.find.one-of-two-instances", "a Find of one instance is answered with all", {},
       find_message([](Incoming& in) { set16(in.bytes, entries_at + 6, 0xffff); })},
      {"find-tires", "sd.find.burst", "after some Finds there are no answers for a while", {},
       find_message([](Incoming& in) {
         static int count = 0;
         in.lost = ++count % 12 > 5;
       })},

      // Answers to subscriptions.
      {"ack-lost", "sd.subscribe.ack,sd.subscribe.several-entries", "subscriptions are not acknowledged", lose(is_ack)},
      {"ack-type", "sd.subscribe.ack.entry-type", "acknowledgements have type 6", entry(is_ack, [](Span e) { e[0] = 6; })},
      {"ack-index", "sd.subscribe.ack.first-option", "the first run of acknowledgements begins at option 1",
       entry(is_ack, [](Span e) { e[1] = 1; })},
      {"ack-service", "sd.subscribe.ack.service", "acknowledgements name another service",
       entry(is_ack, [](Span e) { add16(e, 4, 0x0900); })},
      {"ack-instance", "sd.subscribe.ack.instance", "acknowledgements name another instance",
       entry(is_ack, [](Span e) { add16(e, 6, 0x0900); })},
      {"ack-major", "sd.subscribe.ack.major", "acknowledgements name another major version",
       entry(is_ack, [](Span e) { add8(e, 8); })},
      {"ack-ttl", "sd.subscribe.ack.ttl", "acknowledgements have another TTL than was asked for",
       entry(is_ack, [](Span e) { add8(e, 11); })},
      {"ack-reserved", "sd.subscribe.ack.reserved", "acknowledgements have reserved bits set",
       entry(is_ack, [](Span e) { e[12] = 1; })},
      {"ack-counter", "sd.subscribe.ack.counter", "acknowledgements have counter 0",
       entry(is_ack, [](Span e) { e[13] = 0; })},
      {"ack-eventgroup", "sd.subscribe.ack.eventgroup", "acknowledgements name another eventgroup",
       entry(is_ack, [](Span e) { add16(e, 14, 0x0900); })},
      {"ack-size", "sd.subscribe.ack.size", "the entries array of acknowledgements is said to be 17 bytes long",
       [](Outgoing& out) {
         if (any_entry(out.bytes, is_ack)) {
           add16(out.bytes, 22);
         }
       }},
      {"nack-lost", "sd.subscribe.nack", "refusals are not sent", lose(is_nack)},
      {"nack-as-ack", "sd.subscribe.nack.unknown-service,sd.subscribe.endpoint,sd.subscribe.malformed",
       "refusals look like acknowledgements", entry(is_nack, [](Span e) { e[11] = 3; })},
      {"nack-service", "sd.subscribe.nack.unknown-service", "refusals name another service",
       entry(is_nack, [](Span e) { add16(e, 4); })},
      {"nack-instance", "sd.subscribe.nack.unknown-instance", "refusals name another instance",
       entry(is_nack, [](Span e) { add16(e, 6); })},
      {"nack-major", "sd.subscribe.nack.unknown-major", "refusals name another major version",
       entry(is_nack, [](Span e) { add8(e, 8); })},
      {"nack-eventgroup", "sd.subscribe.nack.unknown-eventgroup", "refusals name another eventgroup",
       entry(is_nack, [](Span e) { add16(e, 14); })},
      {"nack-reserved", "sd.subscribe.nack.echo", "refusals have reserved bits set",
       entry(is_nack, [](Span e) { e[12] = 1; })},
      {"multicast-length", "sd.option.multicast.length", "multicast options have Length 10",
       option(0x14, [](Span o) { set16(o, 0, 10); })},
      {"multicast-type", "sd.option.multicast.type", "multicast options have type 0x54",
       option(0x14, [](Span o) { o[2] = 0x54; })},
      {"multicast-reserved-1", "sd.option.multicast.reserved", "the first reserved byte of multicast options is not 0",
       option(0x14, [](Span o) { o[3] = 1; })},
      {"multicast-address", "sd.option.multicast.address", "multicast options have another address",
       option(0x14, [](Span o) { add8(o, 7); })},
      {"multicast-reserved-2", "sd.option.multicast.reserved", "the second reserved byte of multicast options is not 0",
       option(0x14, [](Span o) { o[8] = 1; })},
      {"multicast-protocol", "sd.option.multicast.protocol", "multicast options say TCP",
       option(0x14, [](Span o) { o[9] = 6; })},
      {"multicast-port", "sd.option.multicast.port", "multicast options have another port",
       option(0x14, [](Span o) { add16(o, 10); })},
      {"subscribe-any", "sd.subscribe", "whatever looks like a Subscribe is acknowledged at once", {},
       acknowledge_if([](Span) { return true; })},
      {"refuse-any", "sd.subscribe.malformed.options-length-beyond,sd.subscribe.ack,sd.subscribe.option,sd.subscribe.trailing",
       "whatever looks like a Subscribe is refused at once", {},
       subscribe_message([](Incoming& in) { in.answers.push_back(acknowledgement(in.bytes, 0)); })},
      {"renewal-ignored", "sd.subscribe.again", "subscriptions are not renewed", {}, subscribe_message([](Incoming& in) {
         static bool had = false;
         const bool stops = u24(in.bytes, entries_at + 9) == 0;
         in.lost = had && !stops;
         had = !stops;
       })},
      {"stopped-for-good", "sd.subscribe.stop-then-subscribe", "who has stopped a subscription gets none any more", {},
       subscribe_message([](Incoming& in) {
         static bool stopped = false;
         in.lost = stopped;
         stopped = stopped || u24(in.bytes, entries_at + 9) == 0;
       })},
      {"configuration-unknown", "sd.subscribe.option.redundant,sd.subscribe.option.unreferenced",
       "Subscribes with a configuration option are ignored", {}, subscribe_message([](Incoming& in) {
         for (std::size_t at = options_at(in.bytes); at + 3 <= in.bytes.size(); at += 3 + u16(in.bytes, at)) {
           in.lost = in.lost || in.bytes[at + 2] == 1;
         }
       })},
      {"any-entry-type", "sd.subscribe.malformed.unknown-entry-type", "entries of unknown type are taken for Subscribes", {},
       [](Incoming& in) {
         if (in.bytes.size() >= entries_at + 16 && is_sd(in.bytes) && in.bytes[entries_at] == 0x55) {
           in.bytes[entries_at] = 6;
         }
       }},
      {"deaf-after-reboot", "sd.reboot.by-unicast-and-multicast",
       "a client that was restarted is not heard any more", {}, [](Incoming& in) {
         static int heard = 0;
         static bool deaf = false;
         if (is_sd(in.bytes)) {
           deaf = deaf || (u16(in.bytes, 10) == 1 && heard > 8);
           ++heard;
           in.lost = deaf;
         }
       }},
      {"stop-subscribe-acked", "sd.subscription.stop-is-silent", "StopSubscribes are answered", {},
       subscribe_message([](Incoming& in) {
         if (u24(in.bytes, entries_at + 9) == 0) {
           in.answers.push_back(acknowledgement(in.bytes, 3));
         }
       })},
      {"stop-subscribe-ignored", "sd.subscription.stop-ends-events", "StopSubscribes are ignored", {},
       subscribe_message([](Incoming& in) { in.lost = u24(in.bytes, entries_at + 9) == 0; })},
      {"subscription-for-ever", "sd.subscription.ttl-expires", "subscriptions do not expire", {},
       subscribe_message([](Incoming& in) {
         if (u24(in.bytes, entries_at + 9) != 0) {
           set24(in.bytes, entries_at + 9, 0xffffff);
         }
       })},
      {"reboot-unnoticed", "sd.reboot", "reboots of clients are not noticed", {}, [](Incoming& in) {
         static unsigned session = 0x1000;
         if (is_sd(in.bytes)) {
           set16(in.bytes, 10, ++session);
         }
       }},
      {"one-entry-only", "sd.subscribe.several-entries", "only the first entry of a message is read", {},
       [](Incoming& in) {
         if (in.bytes.size() > entries_at + 16 && is_sd(in.bytes) && u32(in.bytes, 20) > 16) {
           // The rest of the entries becomes finds of nothing.
           for (std::size_t at = entries_at + 16; at + 16 <= options_at(in.bytes) - 4; at += 16) {
             in.bytes[at] = 0x55;
           }
         }
       }},
      {"reserved-option-bytes-refused", "sd.subscribe.option.reserved-bytes",
       "Subscribes are ignored whose option has reserved bytes set", {}, subscribe_message([](Incoming& in) {
         in.lost = in.bytes.size() >= 56 && in.bytes[47] != 0;
       })},
      {"trailing-bytes-refused", "sd.subscribe.trailing", "Subscribes with bytes behind the options are ignored", {},
       subscribe_message([](Incoming& in) {
         const std::size_t options = options_at(in.bytes);
         in.lost = options <= in.bytes.size() && in.bytes.size() > options + u32(in.bytes, options - 4);
       })},
      {"second-run-ignored", "sd.subscribe.option.second-run", "options of the second run are not seen", {},
       subscribe_message([](Incoming& in) {
         in.bytes[entries_at + 3] = static_cast<std::uint8_t>(in.bytes[entries_at + 3] & 0xf0U);
       })},
      {"options-must-be-referenced", "sd.subscribe.option.unreferenced",
       "Subscribes with options that nobody refers to are ignored", {}, subscribe_message([](Incoming& in) {
         const std::size_t options = options_at(in.bytes);
         in.lost = options < in.bytes.size() && u32(in.bytes, options - 4) > 12U * (in.bytes[entries_at + 3] >> 4U) +
                                                                                12U * (in.bytes[entries_at + 3] & 15U);
       })},
      {"stop-and-subscribe-once", "sd.subscribe.stop-and-subscribe", "a Stop and a Subscribe in one message do nothing", {},
       subscribe_message([](Incoming& in) { in.lost = u24(in.bytes, entries_at + 9) == 0 && u32(in.bytes, 20) > 16; })},
      {"wrong-sd-method", "sd.subscribe.malformed.wrong-method", "SD messages may have any method", {},
       [](Incoming& in) {
         if (in.bytes.size() >= entries_at + 16 && u16(in.bytes, 0) == 0xffff && in.bytes[entries_at] == 6) {
           set16(in.bytes, 2, 0x8100);
         }
       }},

      // Answers to requests.
      {"response-lost", "rpc.response.comes,ets.survive,ets.field", "there are no responses", [](Outgoing& out) { out.copies = is_response(out.bytes) ? 0 : 1; }},
      {"response-service", "rpc.response.message-id", "responses name another service",
       response([](Bytes& b) { add16(b, 0, 1); })},
      {"response-method", "rpc.response.message-id,rpc.response.method-bit", "responses have the top bit of the method set",
       response([](Bytes& b) { b[2] = static_cast<std::uint8_t>(b[2] | 0x80U); })},
      {"response-client", "rpc.response.request-id", "responses have another Client ID",
       response([](Bytes& b) { add16(b, 8); })},
      {"response-session", "rpc.response.request-id", "responses have another Session ID",
       response([](Bytes& b) { add16(b, 10); })},
      {"response-protocol", "rpc.response.protocol-version", "responses have Protocol Version 2",
       response([](Bytes& b) { b[12] = 2; })},
      {"response-interface", "rpc.response.interface-version", "responses have another interface version",
       response([](Bytes& b) { add8(b, 13); })},
      {"response-type", "rpc.response.message-type", "good responses have the type of errors",
       good([](Bytes& b) { b[14] = static_cast<std::uint8_t>(b[14] | 1U); })},
      {"response-code", "rpc.response.return-code", "good responses have a return code",
       good([](Bytes& b) { b[15] = 1; })},
      {"response-first-only", "rpc.request.id-reused,rpc.request.parallel", "every second response is lost",
       [](Outgoing& out) {
         static int count = 0;
         if (is_response(out.bytes) && out.bytes[8] == 0x5a && out.bytes[9] != 0xff && ++count % 2 == 0) {
           out.copies = 0;
         }
       }},
      {"payload-changed", "ets.echo,rpc.field.set", "the last byte of responses is another one", good([](Bytes& b) {
         if (b.size() > 16) {
           b.back() ^= 1U;
         }
       })},
      {"payload-longer", "ets.echo,rpc.field.get", "responses have four bytes too many",
       good([](Bytes& b) { add_payload(b, 4); })},
      {"getter-empty", "rpc.field", "responses of getters and setters are empty", good([](Bytes& b) {
         if (u16(b, 2) >= 0x25 && u16(b, 2) <= 0x2b) {
           b.resize(16);
           set32(b, 4, 8);
         }
       })},
      {"setter-without-effect", "rpc.field.set-is-kept,ets.field,ets.reset", "getters give 0, whatever was set",
       [](Outgoing& out) {
         if (is_response(out.bytes) && (u16(out.bytes, 2) == 0x26 || u16(out.bytes, 2) == 0x28 ||
                                        u16(out.bytes, 2) == 0x2a)) {
           for (std::size_t at = 16; at < out.bytes.size(); ++at) {
             out.bytes[at] = 0;
           }
         }
       }},
      {"reset-without-effect", "ets.reset", "resetInterface does nothing", {}, [](Incoming& in) {
         in.lost = is_message(in.bytes) && u16(in.bytes, 2) == 0x01;
       }},
      {"suspend-without-effect", "ets.suspend", "suspendInterface does nothing", {}, [](Incoming& in) {
         in.lost = is_message(in.bytes) && u16(in.bytes, 2) == 0x02;
       }},
      {"error-lost", "rpc.error.unknown-method,rpc.error.unknown-service", "there are no errors",
       [](Outgoing& out) {
         if (is_response(out.bytes) && out.bytes[15] != 0) {
           out.copies = 0;
         }
       }},
      {"error-code-wrong", "rpc.error.unknown-method,rpc.error.unknown-service", "errors have another code",
       error([](Bytes& b) { b[15] = 1; })},
      {"error-code-high", "rpc.error.code-range", "errors have the top bits of the code set",
       error([](Bytes& b) { b[15] = static_cast<std::uint8_t>(b[15] | 0xc0U); })},
      {"error-payload", "rpc.error.no-payload", "errors have a payload", error([](Bytes& b) { add_payload(b, 4); })},
      {"error-message-id", "rpc.error.message-id", "errors name another method", error([](Bytes& b) { add16(b, 2); })},
      {"error-request-id", "rpc.error.request-id", "errors have another Client ID", error([](Bytes& b) { add16(b, 8); })},
      {"error-interface", "rpc.error.interface-version", "errors have another interface version",
       error([](Bytes& b) { add8(b, 13); })},
      {"error-as-success", "ets.reject,rpc.reject,rpc.error.unknown-method,rpc.error.unknown-service",
       "errors look like success", error([](Bytes& b) {
         b[14] = 0x80;
         b[15] = 0;
       })},
      {"answers-any-request", "rpc.reject,ets.reject,tp.reject,rpc.silence.error-request",
       "whatever comes is answered with success at once", {},
       answer_if([](Span b) { return b[14] != 1 && u16(b, 8) != 0x5aff; }, 0x80, 0)},
      {"answers-fire-and-forget", "rpc.silence", "requests without return are answered with an error", {},
       answer_if([](Span b) { return b[14] == 1; }, 0x80, 9)},
      {"answers-notifications", "rpc.silence.notification,rpc.silence.wrong-type-to-fire-and-forget", "notifications are answered with an error", {},
       answer_if([](Span b) { return b[14] == 2; }, 0x80, 9)},
      {"answers-responses", "rpc.silence.response,rpc.silence.error", "responses are answered with an error", {},
       answer_if([](Span b) { return (b[14] & 0x80U) != 0; }, 0x80, 9)},
      {"answers-errors", "rpc.silence.error-request", "requests with a return code are answered with an error", {},
       [](Incoming& in) {
         if (is_message(in.bytes) && in.bytes[14] == 0 && in.bytes[15] != 0) {
           in.answers.push_back(answer(in.bytes, 0x80, 9));
           in.lost = true;
         }
       }},
      {"first-of-datagram-only", "rpc.npdu", "only the first message of a datagram is read", {}, [](Incoming& in) {
         if (is_message(in.bytes) && u32(in.bytes, 4) >= 8 && u32(in.bytes, 4) + 8 < in.bytes.size()) {
           in.bytes = in.bytes.first(u32(in.bytes, 4) + 8);
         }
       }},

      {"return-code-dropped", "rpc.request.return-code-ignored", "requests with a return code are not answered", {},
       [](Incoming& in) { in.lost = is_message(in.bytes) && in.bytes[14] == 0 && in.bytes[15] != 0; }},
      {"second-service-silent", "rpc.services.one-port,tcp.services.one-connection", "the second service does not answer",
       [](Outgoing& out) { out.copies = is_response(out.bytes) && u16(out.bytes, 0) == 0x0102 ? 0 : 1; }},
      {"second-instance-silent", "rpc.instances.own-ports,tcp.instances.own-ports", "the second instance does not answer",
       [](Outgoing& out) { out.copies = out.port == 30502 ? 0 : 1; }},

      // Events.
      {"event-lost", "event", "there are no events", event([](Outgoing& out) { out.copies = 0; })},
      {"event-id", "event.id-bit", "events have the top bit of their id clear",
       event([](Outgoing& out) { out.bytes[2] = static_cast<std::uint8_t>(out.bytes[2] & 0x7fU); })},
      {"event-type", "event.message-type", "events are requests", event([](Outgoing& out) { out.bytes[14] = 0; })},
      {"event-code", "event.return-code", "events have a return code", event([](Outgoing& out) { out.bytes[15] = 1; })},
      {"event-interface", "event.interface-version", "events have another interface version",
       event([](Outgoing& out) { add8(out.bytes, 13); })},
      {"event-twice", "event.once", "events are sent twice", event([](Outgoing& out) { out.copies = 2; })},
      {"initial-event-lost", "event.initial.comes,event.field-changes", "field events are not sent", event([](Outgoing& out) {
         if (u16(out.bytes, 2) >= 0x8006 && u16(out.bytes, 2) <= 0x8008) {
           out.copies = 0;
         }
       })},
      {"initial-event-only-one", "event.initial.all", "of the fields of an eventgroup, one is sent",
       event([](Outgoing& out) { out.copies = u16(out.bytes, 2) == 0x8007 ? 0 : 1; })},

      {"events-for-all", "event.not-subscribed,sd.subscription.stop-ends-events,sd.subscription.ttl-expires,sd.reboot.ends-subscriptions",
       "whoever asks for an event gets it", {}, [](Incoming& in) {
         if (is_message(in.bytes) && u16(in.bytes, 2) == 0x03) {
           Bytes event = answer(in.bytes, 2, 0);
           set16(event, 2, 0x8001);
           in.answers.push_back(event);
         }
       }},
      {"initial-events-at-renewal", "event.initial.not-at-renewal", "each Subscribe brings initial events", {},
       subscribe_message([](Incoming& in) {
         in.bytes[16] = static_cast<std::uint8_t>(in.bytes[16] | 0x20U);  // it says which ones it wants
         in.bytes[entries_at + 13] = static_cast<std::uint8_t>(in.bytes[entries_at + 13] | 0x80U);
       })},

      // End-to-end protection: methods 0x50 to 0x5c.
      {"e2e-crc", "e2e.*.response", "protected responses have a CRC that does not fit", good([](Bytes& b) {
         if (is_protected(b)) {
           b.back() ^= 1U;
         }
       })},
      {"e2e-counter-stuck", "e2e.*.counter", "protected responses repeat their first protection", good([](Bytes& b) {
         static std::map<unsigned, Bytes> first;
         if (is_protected(b)) {
           const Bytes& had = first.try_emplace(u16(b, 2), b.begin() + 16, b.end()).first->second;
           std::copy_n(had.begin(), std::min(had.size(), b.size() - 16), b.begin() + 16);
         }
       })},
      {"e2e-repeated-ends", "e2e.*.repeated", "after a repeated counter no protected request is served",
       error([](Bytes& b) {
         if (u16(b, 2) >= 0x50 && u16(b, 2) <= 0x5c && b[15] == 0x0b) {
           with_repeated_counter.insert(u16(b, 2));
         }
       }),
       [](Incoming& in) {
         in.lost = is_message(in.bytes) && is_protected(in.bytes) && with_repeated_counter.contains(u16(in.bytes, 2));
       }},
      {"e2e-unchecked", "e2e", "protected requests are served without a check", {}, [](Incoming& in) {
         if (is_message(in.bytes) && is_protected(in.bytes)) {
           Bytes back = answer(in.bytes, 0x80, 0);
           back.insert(back.end(), in.bytes.begin() + 16, in.bytes.end());
           back.resize(std::max<std::size_t>(back.size(), 16 + 24));
           set32(back, 4, static_cast<unsigned>(back.size() - 8));
           in.answers.push_back(back);
         }
       }},

      // The device as a client: of 0x0111 by itself, of 0x0110 when it is told to.
      {"client-find-lost", "client.find,client.ets.finds", "services are not looked for", lose(is_find)},
      {"client-find-instance", "client.find.instance", "another instance is looked for",
       entry(is_find, [](Span e) { set16(e, 6, 0x0909); })},
      {"client-find-major", "client.find.major", "another major version is looked for",
       entry(is_find, [](Span e) { e[8] = 9; })},
      {"client-find-minor", "client.find.minor", "one minor version is looked for",
       entry(is_find, [](Span e) { set32(e, 12, 0); })},
      {"client-find-ttl", "client.find.ttl", "Finds have TTL 0", entry(is_find, [](Span e) { set24(e, 9, 0); })},
      {"client-find-options", "client.find.options", "Finds refer to an option",
       entry(is_find, [](Span e) { e[3] = 0x10; })},
      {"client-finds-for-ever", "client.find.ends-with-offer,client.find.not-in-main-phase,client.subscribe.after-stop-offer",
       "the service that is used is looked for with each offer", each_offer_has(0, 0x0111)},
      {"client-finds-for-ever-as-told", "client.ets.finds-end,client.ets.stop-offer",
       "the service that is used when told to is looked for with each offer", each_offer_has(0, 0x0110)},
      {"client-subscribe-lost", "client.subscribe,client.ignores,client.ets.subscribes", "nothing is subscribed to",
       lose(is_subscribe)},
      {"client-subscribe-multicast", "client.subscribe.unicast", "Subscribes go to the group", [](Outgoing& out) {
         static std::uint32_t group = 0;
         if (out.multicast && is_sd(out.bytes)) {
           group = out.to_address;
         }
         if (any_entry(out.bytes, is_subscribe) && group != 0) {
           out.to_address = group;
         }
       }},
      {"client-subscribe-instance", "client.subscribe.instance", "Subscribes name another instance",
       entry(is_subscribe, [](Span e) { set16(e, 6, 0x0909); })},
      {"client-subscribe-major", "client.subscribe.major", "Subscribes name another major version",
       entry(is_subscribe, [](Span e) { e[8] = 9; })},
      {"client-subscribe-eventgroup", "client.subscribe.eventgroup", "Subscribes name another eventgroup",
       entry(is_subscribe, [](Span e) { set16(e, 14, 0x0909); })},
      {"client-subscribe-reserved", "client.subscribe.reserved", "Subscribes have reserved bits set",
       entry(is_subscribe, [](Span e) { e[12] = 1; })},
      {"client-subscribe-address", "client.subscribe.endpoint", "Subscribes name another address", [](Outgoing& out) {
         if (any_entry(out.bytes, is_subscribe)) {
           option(4, [](Span o) { add8(o, 7, 7); })(out);
         }
       }},
      {"client-never-asks", "client.subscribe.initial-data,client.subscribe.after-ttl,client.subscribe.after-reboot",
       "initial values are never asked for",
       entry(is_subscribe, [](Span e) { e[13] = static_cast<std::uint8_t>(e[13] & 0x7fU); })},
      {"client-always-asks", "client.subscribe.initial-data", "each Subscribe asks for initial values",
       entry(is_subscribe, [](Span e) { e[13] = static_cast<std::uint8_t>(e[13] | 0x80U); })},
      {"client-subscribes-once", "client.subscribe.each-offer,client.subscribe.after-nack,client.subscribe.after",
       "subscriptions are not renewed", [](Outgoing& out) {
         static bool had = false;
         if (any_entry(out.bytes, is_subscribe)) {
           out.copies = had ? 0 : 1;
           had = true;
         }
       }},
      {"client-subscribes-by-itself", "client.subscribe.only-with-offers", "there is a Subscribe with each offer",
       each_offer_has(6, 0x0111)},
      {"client-subscribes-untold", "client.ets.not-by-itself", "there is a Subscribe with each offer, without being told",
       each_offer_has(6, 0x0110)},
      {"client-takes-any-offer", "client.ignores", "each offer brings a Subscribe, whatever it is",
       [](Outgoing& out) {
         if (offered_by_others && any_entry(out.bytes, is_offer)) {
           offered_by_others = false;
           add_entry(out.bytes, 6, 0x0111);
         }
       },
       [](Incoming& in) {
         if (in.bytes.size() >= entries_at + 16 && u16(in.bytes, 0) == 0xffff && in.bytes[entries_at] == 1 &&
             (u16(in.bytes, entries_at + 4) < 0x0101 || u16(in.bytes, entries_at + 4) > 0x0103)) {
           offered_by_others = true;
         }
       }},
      {"client-stop-lost", "client.stop,client.ets.stops", "subscriptions end without a word", lose(is_stop_subscribe)},
      {"client-deaf-to-orders", "client.ets", "what the client is told it does not do", {}, [](Incoming& in) {
         in.lost = is_message(in.bytes) && (u16(in.bytes, 2) == 0x2f || u16(in.bytes, 2) == 0x32);
       }},
      {"client-last-value", "client.ets.event", "the last value of an event is another one", good([](Bytes& b) {
         if (u16(b, 2) >= 0x3b && u16(b, 2) <= 0x3d) {
           b.back() ^= 1U;
         }
       })},

      // TCP.
      {"tcp-silent", "tcp", "nothing is answered over TCP", [](Outgoing& out) {
         if (out.stream) {
           out.copies = 0;
         }
       }},
      {"tcp-first-only", "tcp.several,tcp.split", "over TCP the first answer is the only one", [](Outgoing& out) {
         static int count = 0;
         if (out.stream && is_message(out.bytes) && u32(out.bytes, 4) + 8 < out.bytes.size()) {
           out.bytes.resize(u32(out.bytes, 4) + 8);
         } else if (out.stream && ++count % 2 == 0) {
           out.copies = 0;
         }
       }},
      {"tcp-payload-changed", "tcp.echo", "responses over TCP have another payload", [](Outgoing& out) {
         if (out.stream && is_response(out.bytes) && out.bytes.size() > 16) {
           out.bytes.back() ^= 1U;
         }
       }},

      // SOME/IP-TP.
      {"tp-ignored", "tp", "segments are not put together", {}, [](Incoming& in) {
         in.lost = is_message(in.bytes) && (in.bytes[14] & 0x20U) != 0;
       }},
      {"tp-more-flag-stays", "tp.response.last", "the last segment says that more follow", response([](Bytes& b) {
         if ((b[14] & 0x20U) != 0) {
           b[19] = static_cast<std::uint8_t>(b[19] | 1U);
         }
       })},
      {"tp-reserved", "tp.response.reserved", "reserved bits of segments are set", response([](Bytes& b) {
         if ((b[14] & 0x20U) != 0) {
           b[19] = static_cast<std::uint8_t>(b[19] | 2U);
         }
       })},
      {"tp-session", "tp.response.session", "segments have different Session IDs", response([](Bytes& b) {
         if ((b[14] & 0x20U) != 0) {
           add16(b, 10, b[18] + b[17]);
         }
       })},
      {"tp-flag-missing", "tp.response.flag", "segments have no TP flag",
       response([](Bytes& b) { b[14] = static_cast<std::uint8_t>(b[14] & 0xdfU); })},
      {"tp-duplicate", "tp.response.once", "segments are sent twice", [](Outgoing& out) {
         if (is_response(out.bytes) && (out.bytes[14] & 0x20U) != 0) {
           out.copies = 2;
         }
       }},
      {"tp-payload", "tp.response.payload,tp.order", "a byte of each segment is another one", response([](Bytes& b) {
         if ((b[14] & 0x20U) != 0) {
           b.back() ^= 1U;
         }
       })},
  };
  return all;
}

}  // namespace ets
