#include "bridge/guest/frame.hpp"

#include <algorithm>
#include <concepts>
#include <span>
#include <type_traits>

#include "someip/wire/bytes.hpp"

namespace trestle::guest {
namespace {

constexpr std::size_t most_text_bytes = 4096;

template <typename T, typename Kind>
concept Is = std::same_as<std::remove_const_t<T>, Kind>;

// What each frame holds, in this order: a Writer and a Reader go through it.
void visit(auto&& fields, Is<Hello> auto& frame) {
  fields(frame.process, frame.at, frame.configuration);
}
void visit(auto&& fields, Is<Found> auto& frame) {
  auto& one = frame.service;
  fields(one.service, one.instance, one.major, one.minor, one.udp, one.tcp, one.peer);
}
void visit(auto&& fields, Is<Answer> auto& frame) {
  fields(frame.fault, frame.is_answer, frame.message);
}
void visit(auto&& fields, Is<Event> auto& frame) {
  fields(frame.from, frame.lost, frame.message);
}
void visit(auto&& fields, Is<Said> auto& frame) {
  fields(frame.is_end, frame.text);
}
void visit(auto&& fields, Is<Find> auto& frame) {
  fields(frame.service, frame.instance);
}
void visit(auto&& fields, Is<Call> auto& frame) {
  fields(frame.service, frame.instance, frame.major, frame.method, frame.timeout_ms, frame.transport,
         frame.forget, frame.payload);
}
void visit(auto&& fields, Is<Subscribe> auto& frame) {
  fields(frame.service, frame.instance, frame.major, frame.eventgroup, frame.udp, frame.tcp, frame.events);
}

/// Appends fields to a vector.
class Writer {
 public:
  explicit Writer(std::vector<std::byte>& to) : to_{to} {}

  void operator()(const auto&... fields) { (put(fields), ...); }

 private:
  template <std::unsigned_integral T>
  void put(T value) {
    const std::size_t at = to_.size();
    to_.resize(at + sizeof(T));
    someip::store(to_.data() + at, value);
  }
  void put(bool value) { put(static_cast<std::uint8_t>(value ? 1 : 0)); }
  template <typename Id>
  requires std::is_enum_v<Id>
  void put(Id value) { put(someip::value(value)); }
  void put(const std::optional<Transport>& value) {
    put(static_cast<std::uint8_t>(value ? static_cast<std::uint8_t>(*value) : 0U));
  }
  void put(const Endpoint& value) {
    put(std::as_bytes(std::span{value.address.bytes}));
    put(value.address.v6);
    put(value.port);
  }
  void put(const std::optional<Endpoint>& value) {
    put(value.has_value());
    put(value.value_or(Endpoint{}));
  }
  void put(const std::string& value) {
    const std::size_t size = std::min(value.size(), most_text_bytes);
    put(static_cast<std::uint16_t>(size));
    put(std::as_bytes(std::span{value}.first(size)));
  }
  void put(const std::vector<someip::MethodId>& events) {
    put(static_cast<std::uint16_t>(events.size()));
    for (const someip::MethodId event : events) {
      put(event);
    }
  }
  /// All that comes after the other fields.
  void put(ByteView rest) { to_.insert(to_.end(), rest.begin(), rest.end()); }

  std::vector<std::byte>& to_;
};

/// Reads what Writer writes. What cannot be makes it fail, as what is missing does.
class Reader {
 public:
  explicit Reader(ByteView bytes) : in_{bytes} {}

  void operator()(auto&... fields) { (get(fields), ...); }
  /// Nothing is missing, wrong or left over.
  [[nodiscard]] bool is_whole() const { return !wrong_ && !in_.failed() && in_.rest().empty(); }

 private:
  void get(std::uint8_t& value) { value = in_.u8(); }
  void get(std::uint16_t& value) { value = in_.u16(); }
  void get(std::uint32_t& value) { value = in_.u32(); }
  void get(std::uint64_t& value) { value = in_.u64(); }
  void get(bool& value) {
    const std::uint8_t number = in_.u8();
    wrong_ = wrong_ || number > 1;
    value = number == 1;
  }
  template <typename Id>
  requires std::is_enum_v<Id>
  void get(Id& value) {
    std::underlying_type_t<Id> number{};
    get(number);
    value = Id{number};
  }
  void get(std::optional<Transport>& value) {
    const std::uint8_t number = in_.u8();
    for (const Transport one : {Transport::tcp, Transport::udp}) {
      if (number == static_cast<std::uint8_t>(one)) {
        value = one;
        return;
      }
    }
    wrong_ = wrong_ || number != 0;
    value.reset();
  }
  void get(Endpoint& value) {
    const ByteView address = in_.take(value.address.bytes.size());
    std::ranges::transform(address, value.address.bytes.begin(),
                           [](std::byte one) { return std::to_integer<std::uint8_t>(one); });
    get(value.address.v6);
    get(value.port);
  }
  void get(std::optional<Endpoint>& value) {
    bool is_there = false;
    get(is_there);
    get(value.emplace());
    if (!is_there) {
      wrong_ = wrong_ || *value != Endpoint{};
      value.reset();
    }
  }
  void get(std::string& value) {
    const std::size_t size = in_.u16();
    wrong_ = wrong_ || size > most_text_bytes;
    const ByteView bytes = in_.take(size);
    value.resize(bytes.size());
    std::ranges::transform(bytes, value.begin(), [](std::byte one) { return static_cast<char>(one); });
  }
  void get(std::vector<someip::MethodId>& events) {
    const std::size_t count = in_.u16();
    if (count > most_events) {
      wrong_ = true;
      return;
    }
    events.resize(count);
    for (someip::MethodId& event : events) {
      get(event);
    }
  }
  void get(std::vector<std::byte>& rest) {
    const ByteView bytes = in_.rest();
    in_.skip(bytes.size());
    rest.assign(bytes.begin(), bytes.end());
  }

  someip::ByteReader in_;
  bool wrong_ = false;
};

/// Reads the frame of this kind, which is its place in the variant.
template <std::size_t kind = 0>
std::optional<Frame> read_kind(std::size_t wanted, Reader& in) {
  if constexpr (kind < std::variant_size_v<Frame>) {
    if (kind != wanted) {
      return read_kind<kind + 1>(wanted, in);
    }
    std::variant_alternative_t<kind, Frame> frame;
    visit(in, frame);
    return in.is_whole() ? std::optional<Frame>{std::move(frame)} : std::nullopt;
  } else {
    return std::nullopt;
  }
}

/// Leaves room for the length of a frame, which end_frame() writes.
std::size_t begin_frame(std::vector<std::byte>& to, std::size_t kind) {
  const std::size_t at = to.size();
  Writer{to}(std::uint32_t{0}, static_cast<std::uint8_t>(kind));
  return at;
}
void end_frame(std::vector<std::byte>& to, std::size_t begun_at) {
  someip::store(to.data() + begun_at, static_cast<std::uint32_t>(to.size() - begun_at - length_bytes));
}

}  // namespace

std::vector<std::byte> encode(const Frame& frame) {
  std::vector<std::byte> bytes;
  const std::size_t at = begin_frame(bytes, frame.index());
  std::visit([&](const auto& one) { visit(Writer{bytes}, one); }, frame);
  end_frame(bytes, at);
  return bytes;
}

void append_event(std::vector<std::byte>& to, const someip::Message& message, const Endpoint& from,
                  std::uint64_t lost) {
  const std::size_t at = begin_frame(to, Frame{Event{}}.index());
  Writer{to}(from, lost);
  const std::size_t header_at = to.size();
  to.resize(header_at + someip::header_bytes);
  static_cast<void>(someip::encode_header(message.header, message.payload.size(),
                                          ByteSpan{to}.subspan(header_at)));  // there is room
  Writer{to}(message.payload);
  end_frame(to, at);
}

std::optional<Frame> decode(ByteView bytes) {
  Reader in{bytes};
  std::uint8_t kind = 0;
  in(kind);
  return read_kind(kind, in);
}

}  // namespace trestle::guest
