#include <fcntl.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <set>
#include <thread>

#include "fault_ways.hpp"

namespace ets {
namespace {

using Message = std::span<const std::uint8_t>;

/// An SD message with all that it says it has.
bool is_whole_sd(Message bytes) {
  return is_sd(bytes) && bytes.size() >= entries_at + 4;
}

std::size_t entry_count(Message bytes) {
  return std::min<std::size_t>(u32(bytes, 20), bytes.size() - entries_at) / 16;
}

Message entry_at(Message bytes, std::size_t number) {
  return bytes.subspan(entries_at + 16 * number, 16);
}

/// Whether it has an entry of which this is true.
bool any(Message bytes, bool (*wanted)(Message entry)) {
  for (std::size_t at = 0; is_whole_sd(bytes) && at < entry_count(bytes); ++at) {
    if (wanted(entry_at(bytes, at))) {
      return true;
    }
  }
  return false;
}

/// The options that there are: calls `visit(option, rest)` with each, which may be cut off, and all behind
/// it.
template <typename Visit>
std::size_t each_option(Message bytes, Visit visit) {
  if (!is_whole_sd(bytes)) {
    return 0;
  }
  const std::size_t array = entries_at + std::size_t{u32(bytes, 20)};
  std::size_t count = 0;
  for (std::size_t at = array + 4; array + 4 <= bytes.size() && at + 3 <= bytes.size(); ++count) {
    const Message rest = bytes.subspan(at);
    visit(rest);
    at += 3 + std::size_t{u16(rest, 0)};
  }
  return count;
}

bool any_option(Message bytes, bool (*wanted)(Message rest)) {
  bool is_there = false;
  each_option(bytes, [&](Message rest) { is_there = is_there || wanted(rest); });
  return is_there;
}

bool is_segment(Message bytes) {
  return is_message(bytes) && bytes.size() >= 20 && (bytes[14] & 0x20U) != 0;
}

/// The parameters of a request to this method, behind a length field that is right; none: it is another
/// message.
Message parameters_behind_length(Message bytes, unsigned method) {
  const bool is_it = is_message(bytes) && bytes.size() >= 20 && u16(bytes, 0) == 0x0101 &&
                     u16(bytes, 2) == method && bytes[14] <= 1;
  return is_it ? bytes.subspan(20) : Message{};
}

/// echoText: the string has its BOM and as many bytes as its length says, but does not end with zero.
bool is_text_without_end(Message bytes) {
  const Message text = parameters_behind_length(bytes, 0x15);
  return text.size() > 3 && u32(bytes, 16) == text.size() && text[0] == 0xef && text[1] == 0xbb &&
         text[2] == 0xbf && text.back() != 0;
}

/// echoUnion: of uint8, uint16 and uint32, and nothing else.
bool is_union_of_none(Message bytes) {
  const Message rest = parameters_behind_length(bytes, 0x19);
  return rest.size() >= 4 && u32(bytes, 16) == rest.size() - 4 && u32(rest, 0) > 3;
}

In crash_if(bool (*wanted)(Message)) {
  return [wanted](Incoming& in) {
    if (wanted(in.bytes)) {
      std::abort();
    }
  };
}

In hang_if(bool (*wanted)(Message)) {
  return [wanted](Incoming& in) {
    while (wanted(in.bytes)) {
      ::pause();
    }
  };
}

/// Of the bug that begins with one message and shows with others.
bool begun = false;

}  // namespace

std::vector<Fault> planted_bugs() {
  return {
      {"bug-option-length",
       "crash",
       "an option that is longer than its array is read beyond the end",
       {},
       crash_if([](Message b) {
         return any_option(b, [](Message rest) { return u16(rest, 0) + 3U > rest.size(); });
       })},
      {"bug-option-empty", "silence", "an option without bytes is read for ever", {}, hang_if([](Message b) {
         return any_option(b, [](Message rest) { return u16(rest, 0) == 0; });
       })},
      {"bug-option-index",
       "crash",
       "an entry refers to options that are not there",
       {},
       crash_if([](Message b) {
         const std::size_t count = each_option(b, [](Message /*rest*/) {});
         for (std::size_t at = 0; is_whole_sd(b) && at < entry_count(b); ++at) {
           const Message entry = entry_at(b, at);
           if (entry[3] >> 4U != 0 && entry[1] >= count) {
             return true;
           }
         }
         return false;
       })},
      {"bug-option-runs",
       "crash",
       "both runs of an entry begin at the same option",
       {},
       crash_if([](Message b) {
         return any(b, [](Message entry) {
           return entry[3] >> 4U != 0 && (entry[3] & 0xfU) != 0 && entry[1] == entry[2];
         });
       })},
      {"bug-option-family",
       "crash",
       "an IPv6 endpoint is copied into the room of an IPv4 one",
       {},
       crash_if([](Message b) { return any_option(b, [](Message rest) { return rest[2] == 0x06; }); })},
      {"bug-configuration",
       "crash",
       "an item of a configuration option ends behind the option",
       {},
       crash_if([](Message b) {
         return any_option(b, [](Message rest) {
           return rest[2] == 0x01 && u16(rest, 0) > 1 && rest.size() > 4 && rest[4] > u16(rest, 0) - 2U;
         });
       })},
      {"bug-entries", "crash", "there is room for 32 entries", {}, crash_if([](Message b) {
         return is_whole_sd(b) && entry_count(b) > 32;
       })},
      {"bug-entries-length",
       "crash",
       "the length of the entries is no multiple of 16",
       {},
       crash_if([](Message b) { return is_whole_sd(b) && u32(b, 20) % 16 != 0; })},
      {"bug-stop-offer", "crash", "a service is used after its StopOffer", {}, crash_if([](Message b) {
         static bool is_offered = false;
         const bool stopped = is_offered && any(b, [](Message entry) { return is_stop_offer(entry); });
         is_offered = is_offered || any(b, [](Message entry) { return is_offer(entry); });
         return stopped;
       })},
      {"bug-stop-subscribe", "crash", "a subscription ends that never began", {}, crash_if([](Message b) {
         static std::set<unsigned> known;
         for (std::size_t at = 0; is_whole_sd(b) && at < entry_count(b); ++at) {
           const Message entry = entry_at(b, at);
           if (is_subscribe(entry)) {
             known.insert(u16(entry, 14));
           } else if (is_stop_subscribe(entry) && !known.contains(u16(entry, 14))) {
             return true;
           }
         }
         return false;
       })},
      {"bug-subscriber-leak",
       "descriptors",
       "each counter of a subscription opens a file",
       {},
       [](Incoming& in) {
         if (any(in.bytes, [](Message entry) { return is_subscribe(entry); })) {
           (void)::open("/dev/null", O_RDONLY | O_CLOEXEC);
         }
       }},
      {"bug-segment-offset",
       "crash",
       "a segment is written where its offset says",
       {},
       crash_if([](Message b) { return is_segment(b) && (u32(b, 16) & ~0xfU) > 0x0010'0000; })},
      {"bug-segment-leak",
       "memory",
       "the room for a message whose last segment is missing is never given back",
       {},
       [](Incoming& in) {
         static std::vector<Bytes> rooms;
         if (is_segment(in.bytes) && (u32(in.bytes, 16) & ~0xeU) == 1) {
           rooms.emplace_back(std::size_t{1} << 20U, std::uint8_t{1});
         }
       }},
      {"bug-length-small",
       "crash",
       "eight is subtracted from a Length below eight",
       {},
       crash_if([](Message b) { return b.size() >= 8 && u32(b, 4) < 8; })},
      {"bug-length-large", "crash", "a Length above 2 GB is negative", {}, crash_if([](Message b) {
         return b.size() >= 8 && u32(b, 4) > 0x7fff'ffff;
       })},
      {"bug-second-message",
       "crash",
       "the second message of a datagram is taken for whole",
       {},
       crash_if([](Message b) {
         if (!is_message(b) || b.size() < 8 || u32(b, 4) > b.size() - 8) {
           return false;
         }
         const Message rest = b.subspan(8 + std::size_t{u32(b, 4)});
         return rest.size() >= 16 && u32(rest, 4) > rest.size() - 8;
       })},
      {"bug-session",
       "silence",
       "after a message of service discovery with Session ID 0 nothing is answered",
       {},
       [](Incoming& in) {
         static bool is_confused = false;
         is_confused = is_confused || (is_sd(in.bytes) && u16(in.bytes, 10) == 0);
         in.lost = is_confused;
       }},
      {"bug-exit",
       "crash",
       "a Find of instance 0 ends the program",
       {},
       [](Incoming& in) {
         if (any(in.bytes, [](Message entry) { return is_find(entry) && u16(entry, 6) == 0; })) {
           std::_Exit(3);
         }
       }},
      {"bug-answer-twice", "rule", "after a request without payload, everything is answered twice",
       [](Outgoing& out) {
         if (begun && is_response(out.bytes) && (out.bytes[14] & 0x20U) == 0) {
           out.copies = 2;
         }
       },
       [](Incoming& in) { begun = begun || (is_message(in.bytes) && in.bytes.size() == 16); }},
      {"bug-message-type",
       "rule",
       "a request of another protocol version gets an answer of no known type",
       {},
       [](Incoming& in) {
         if (is_message(in.bytes) && in.bytes[12] != 1) {
           in.answers.push_back(answer(in.bytes, 0xc0, 0x08));
         }
       }},
      {"bug-text",
       "crash",
       "a text without terminator is read on, behind its end",
       {},
       crash_if(is_text_without_end)},
      {"bug-union", "crash", "the type of a union is looked up in a table", {}, crash_if(is_union_of_none)},
      {"bug-slow",
       "slowness",
       "a request of an unknown version is looked for in a table that is read each time",
       {},
       [](Incoming& in) {
         if (is_message(in.bytes) && in.bytes[13] > 0x7f) {
           std::this_thread::sleep_for(std::chrono::milliseconds{700});
         }
       }},
  };
}

}  // namespace ets
