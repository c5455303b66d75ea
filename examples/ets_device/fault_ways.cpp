#include "fault_ways.hpp"

#include <algorithm>

namespace ets {

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

void add8(Span bytes, std::size_t at, unsigned more) {
  bytes[at] = static_cast<std::uint8_t>(bytes[at] + more);
}

void add16(Span bytes, std::size_t at, unsigned more) {
  set16(bytes, at, u16(bytes, at) + more);
}

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

unsigned type_of(std::span<const std::uint8_t> option) {
  const unsigned type = option[2];
  return (type & 0x0fU) == 6 ? type - 2 : type;
}

Receiver receiver_in(std::span<const std::uint8_t> option) {
  return {.address = {option.begin() + 4, option.end() - 4}, .port = u16(option, port_in(option))};
}

void each_option(Span sd_message, const EntryDo& look) {
  for (std::size_t at = options_at(sd_message); at + 3 <= sd_message.size();) {
    const std::size_t size = 3 + u16(sd_message, at);
    if (at + size > sd_message.size()) {
      return;
    }
    look(sd_message.subspan(at, size));
    at += size;
  }
}

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

Out sd(std::function<void(Span)> change) {
  return [=](Outgoing& out) {
    if (is_sd(out.bytes)) {
      change(out.bytes);
    }
  };
}

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

Out option(std::uint8_t type, EntryDo change) {
  return sd([=](Span bytes) {
    bool done = false;
    each_option(bytes, [&](Span one) {
      if (!done && type_of(one) == type) {
        change(one);
        done = true;
      }
    });
  });
}

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
  return u16(message, 0) == 0x0101 && u16(message, 2) >= 0x50 && u16(message, 2) <= 0x5d &&
         message.size() > 16;
}

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

const std::vector<Fault>& bugs() {
  static const std::vector<Fault> all = planted_bugs();
  return all;
}

const std::vector<Fault>& faults() {
  static const std::vector<Fault> all = [] {
    // Those first that take long.
    std::vector<Fault> every = load_faults();
    for (const auto& some : {sd_faults(), message_faults()}) {
      every.insert(every.end(), some.begin(), some.end());
    }
    return every;
  }();
  return all;
}

}  // namespace ets
