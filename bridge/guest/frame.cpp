#include "bridge/guest/frame.hpp"

#include <algorithm>
#include <concepts>
#include <span>
#include <type_traits>

#include "someip/wire/bytes.hpp"

namespace trestle::guest {
namespace {

constexpr std::size_t most_text_bytes = 4096;

/// Appends to a vector what ByteReader reads.
class Writer {
 public:
  explicit Writer(std::vector<std::byte>& to) : to_{to} {}

  template <std::unsigned_integral T>
  void number(T value) {
    const std::size_t at = to_.size();
    to_.resize(at + sizeof(T));
    someip::store(to_.data() + at, value);
  }
  void flag(bool value) { number(static_cast<std::uint8_t>(value ? 1 : 0)); }
  void bytes(ByteView value) { to_.insert(to_.end(), value.begin(), value.end()); }
  void text(const std::string& value) {
    const std::size_t size = std::min(value.size(), most_text_bytes);
    number(static_cast<std::uint16_t>(size));
    bytes(std::as_bytes(std::span{value}.first(size)));
  }
  void endpoint(const Endpoint& value) {
    bytes(std::as_bytes(std::span{value.address.bytes}));
    flag(value.address.v6);
    number(value.port);
  }
  void endpoint(const std::optional<Endpoint>& value) {
    flag(value.has_value());
    endpoint(value.value_or(Endpoint{}));
  }
  template <typename Id>
  void id(Id value) {
    number(someip::value(value));
  }

 private:
  std::vector<std::byte>& to_;
};

void write(Writer& out, const Hello& frame) {
  out.number(frame.process);
  out.endpoint(frame.at);
  out.text(frame.configuration);
}
void write(Writer& out, const Found& frame) {
  const sd::RemoteService& one = frame.service;
  out.id(one.service);
  out.id(one.instance);
  out.number(one.major);
  out.number(one.minor);
  out.endpoint(one.udp);
  out.endpoint(one.tcp);
  out.endpoint(one.peer);
}
void write(Writer& out, const Answer& frame) {
  out.text(frame.fault);
  out.flag(frame.is_answer);
  out.bytes(frame.message);
}
void write(Writer& out, const Event& frame) {
  out.endpoint(frame.from);
  out.number(frame.lost);
  out.bytes(frame.message);
}
void write(Writer& out, const Said& frame) {
  out.flag(frame.is_end);
  out.text(frame.text);
}
void write(Writer& out, const Find& frame) {
  out.id(frame.service);
  out.id(frame.instance);
}
void write(Writer& out, const Call& frame) {
  out.id(frame.service);
  out.id(frame.instance);
  out.number(frame.major);
  out.id(frame.method);
  out.number(frame.timeout_ms);
  out.number(static_cast<std::uint8_t>(frame.transport ? static_cast<std::uint8_t>(*frame.transport) : 0U));
  out.flag(frame.forget);
  out.bytes(frame.payload);
}
void write(Writer& out, const Subscribe& frame) {
  out.id(frame.service);
  out.id(frame.instance);
  out.number(frame.major);
  out.id(frame.eventgroup);
  out.flag(frame.udp);
  out.flag(frame.tcp);
  out.number(static_cast<std::uint16_t>(frame.events.size()));
  for (const someip::MethodId event : frame.events) {
    out.id(event);
  }
}

/// Reads what Writer writes. What cannot be makes it fail, as what is missing does.
class Reader {
 public:
  explicit Reader(ByteView bytes) : in_{bytes} {}

  template <typename T>
  T number() {
    if constexpr (sizeof(T) == 1) {
      return in_.u8();
    } else if constexpr (sizeof(T) == 2) {
      return in_.u16();
    } else if constexpr (sizeof(T) == 4) {
      return in_.u32();
    } else {
      return in_.u64();
    }
  }
  template <typename Id>
  Id id() {
    return Id{number<std::underlying_type_t<Id>>()};
  }
  bool flag() {
    const std::uint8_t value = in_.u8();
    wrong_ = wrong_ || value > 1;
    return value == 1;
  }
  std::string text() {
    const std::size_t size = in_.u16();
    wrong_ = wrong_ || size > most_text_bytes;
    const ByteView bytes = in_.take(size);
    std::string value(bytes.size(), '\0');
    std::ranges::transform(bytes, value.begin(), [](std::byte one) { return static_cast<char>(one); });
    return value;
  }
  Endpoint endpoint() {
    Endpoint value;
    const ByteView address = in_.take(value.address.bytes.size());
    std::ranges::transform(address, value.address.bytes.begin(),
                           [](std::byte one) { return std::to_integer<std::uint8_t>(one); });
    value.address.v6 = flag();
    value.port = in_.u16();
    return value;
  }
  std::optional<Endpoint> optional_endpoint() {
    const bool is_there = flag();
    const Endpoint value = endpoint();
    wrong_ = wrong_ || (!is_there && value != Endpoint{});
    return is_there ? std::optional{value} : std::nullopt;
  }
  std::optional<Transport> transport() {
    const std::uint8_t value = in_.u8();
    for (const Transport one : {Transport::tcp, Transport::udp}) {
      if (value == static_cast<std::uint8_t>(one)) {
        return one;
      }
    }
    wrong_ = wrong_ || value != 0;
    return std::nullopt;
  }
  std::vector<std::byte> rest() {
    const ByteView bytes = in_.rest();
    in_.skip(bytes.size());
    return {bytes.begin(), bytes.end()};
  }
  void refuse() { wrong_ = true; }
  /// Nothing is missing, wrong or left over.
  [[nodiscard]] bool is_whole() const { return !wrong_ && !in_.failed() && in_.rest().empty(); }

 private:
  someip::ByteReader in_;
  bool wrong_ = false;
};

void read(Reader& in, Hello& frame) {
  frame.process = in.number<std::uint32_t>();
  frame.at = in.endpoint();
  frame.configuration = in.text();
}
void read(Reader& in, Found& frame) {
  sd::RemoteService& one = frame.service;
  one.service = in.id<someip::ServiceId>();
  one.instance = in.id<someip::InstanceId>();
  one.major = in.number<std::uint8_t>();
  one.minor = in.number<std::uint32_t>();
  one.udp = in.optional_endpoint();
  one.tcp = in.optional_endpoint();
  one.peer = in.endpoint();
}
void read(Reader& in, Answer& frame) {
  frame.fault = in.text();
  frame.is_answer = in.flag();
  frame.message = in.rest();
}
void read(Reader& in, Event& frame) {
  frame.from = in.endpoint();
  frame.lost = in.number<std::uint64_t>();
  frame.message = in.rest();
}
void read(Reader& in, Said& frame) {
  frame.is_end = in.flag();
  frame.text = in.text();
}
void read(Reader& in, Find& frame) {
  frame.service = in.id<someip::ServiceId>();
  frame.instance = in.id<someip::InstanceId>();
}
void read(Reader& in, Call& frame) {
  frame.service = in.id<someip::ServiceId>();
  frame.instance = in.id<someip::InstanceId>();
  frame.major = in.number<std::uint8_t>();
  frame.method = in.id<someip::MethodId>();
  frame.timeout_ms = in.number<std::uint32_t>();
  frame.transport = in.transport();
  frame.forget = in.flag();
  frame.payload = in.rest();
}
void read(Reader& in, Subscribe& frame) {
  frame.service = in.id<someip::ServiceId>();
  frame.instance = in.id<someip::InstanceId>();
  frame.major = in.number<std::uint8_t>();
  frame.eventgroup = in.id<someip::EventgroupId>();
  frame.udp = in.flag();
  frame.tcp = in.flag();
  const std::size_t count = in.number<std::uint16_t>();
  if (count > most_events) {
    in.refuse();
    return;
  }
  for (std::size_t i = 0; i < count; ++i) {
    frame.events.push_back(in.id<someip::MethodId>());
  }
}

/// Reads the frame of this kind, which is its place in the variant.
template <std::size_t kind = 0>
std::optional<Frame> read_kind(std::size_t wanted, Reader& in) {
  if constexpr (kind < std::variant_size_v<Frame>) {
    if (kind != wanted) {
      return read_kind<kind + 1>(wanted, in);
    }
    std::variant_alternative_t<kind, Frame> frame;
    read(in, frame);
    return in.is_whole() ? std::optional<Frame>{std::move(frame)} : std::nullopt;
  } else {
    return std::nullopt;
  }
}

/// Leaves room for the length of a frame, which end_frame() writes.
std::size_t begin_frame(std::vector<std::byte>& to, std::size_t kind) {
  const std::size_t at = to.size();
  Writer out{to};
  out.number(std::uint32_t{0});
  out.number(static_cast<std::uint8_t>(kind));
  return at;
}
void end_frame(std::vector<std::byte>& to, std::size_t begun_at) {
  someip::store(to.data() + begun_at, static_cast<std::uint32_t>(to.size() - begun_at - length_bytes));
}

}  // namespace

std::vector<std::byte> encode(const Frame& frame) {
  std::vector<std::byte> bytes;
  const std::size_t at = begin_frame(bytes, frame.index());
  Writer out{bytes};
  std::visit([&](const auto& one) { write(out, one); }, frame);
  end_frame(bytes, at);
  return bytes;
}

void append_event(std::vector<std::byte>& to, const someip::Message& message, const Endpoint& from,
                  std::uint64_t lost) {
  const std::size_t at = begin_frame(to, Frame{Event{}}.index());
  Writer out{to};
  out.endpoint(from);
  out.number(lost);
  const std::size_t header_at = to.size();
  to.resize(header_at + someip::header_bytes);
  static_cast<void>(someip::encode_header(message.header, message.payload.size(),
                                          ByteSpan{to}.subspan(header_at)));  // there is room
  out.bytes(message.payload);
  end_frame(to, at);
}

std::optional<Frame> decode(ByteView bytes) {
  Reader in{bytes};
  const std::size_t kind = in.number<std::uint8_t>();
  return read_kind(kind, in);
}

}  // namespace trestle::guest
