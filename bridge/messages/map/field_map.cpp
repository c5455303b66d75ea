#include "bridge/messages/map/field_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>

#include "bridge/messages/convert/program/wire_forms.hpp"

namespace trestle::messages {
namespace {

constexpr std::int64_t nanoseconds_per_second = 1'000'000'000;

std::int64_t nanoseconds_per(TimeUnit unit) noexcept {
  switch (unit) {
    case TimeUnit::ns:
      return 1;
    case TimeUnit::us:
      return 1'000;
    case TimeUnit::ms:
      return 1'000'000;
    case TimeUnit::s:
      break;
  }
  return nanoseconds_per_second;
}

bool is_text(const FieldType& type) noexcept {
  return type.primitive && width(*type.primitive) == 0;
}

/// The message that is read. The first read beyond its end fails it for good.
class Reader {
 public:
  Reader(ByteView sample, std::endian order) : in_{sample.data()}, size_{sample.size()}, order_{order} {}

  [[nodiscard]] bool failed() const noexcept { return fault_.has_value(); }
  [[nodiscard]] std::size_t at() const noexcept { return at_; }
  [[nodiscard]] std::size_t left() const noexcept { return size_ - at_; }
  [[nodiscard]] ConversionFault fault() const noexcept { return *fault_; }
  [[nodiscard]] std::endian order() const noexcept { return order_; }
  [[nodiscard]] bool swaps() const noexcept { return order_ != std::endian::native; }
  [[nodiscard]] const std::byte* data(std::size_t at) const noexcept { return in_ + at; }
  void go(std::size_t at) noexcept { at_ = at; }
  void fail(ConversionFault fault) noexcept { fault_ = fault_ ? fault_ : fault; }

  /// Goes to the next multiple, counted from behind the encapsulation, and over `size` bytes there.
  /// @return where these begin.
  std::size_t take(std::size_t alignment, std::uint64_t size) noexcept {
    const std::size_t padding = (encapsulation_bytes - at_) & (alignment - 1);
    if (failed() || padding > left() || size > left() - padding) {
      fail(ConversionFault::truncated);
      return at_;
    }
    const std::size_t begin = at_ + padding;
    at_ = begin + static_cast<std::size_t>(size);
    return begin;
  }
  std::uint32_t count() noexcept {
    const std::size_t at = take(4, 4);
    return failed() ? 0 : load_u32(in_ + at, order_);
  }
  /// A string's characters, without its terminator.
  ByteView string() noexcept {
    const std::uint32_t size = count();
    const std::size_t at = take(1, size);
    if (failed() || size == 0) {
      return {};
    }
    if (in_[at + size - 1] != std::byte{0}) {
      fail(ConversionFault::bad_string);
      return {};
    }
    return {in_ + at, size - 1};
  }
  /// The numbers of an array.
  std::size_t numbers(std::uint64_t count, std::size_t width) noexcept {
    if (count == 0) {
      return at_;
    }
    return take(width, exceed(count, width, size_) ? size_ + 1 : count * width);
  }

 private:
  const std::byte* in_;
  std::size_t size_;
  std::size_t at_ = encapsulation_bytes;
  std::endian order_;
  std::optional<ConversionFault> fault_;
};

class Mapper {
 public:
  Mapper(const MapProgram& program, Reader& reader, std::chrono::nanoseconds received, MapScratch& scratch,
         MapCounters& counters)
      : program_{program},
        in_{reader},
        received_{received},
        out_{scratch.output},
        slots_{scratch.slots},
        counters_{counters} {}

  /// @return how many reads were good: all, unless the reader has failed.
  std::size_t read() {
    for (std::size_t i = 0; i < program_.reads.size(); ++i) {
      one(program_.reads[i]);
      if (in_.failed()) {
        return i;
      }
    }
    return program_.reads.size();
  }

  /// @return likewise of the writes.
  std::size_t write() {
    for (std::size_t i = 0; i < program_.writes.size(); ++i) {
      one(program_.writes[i]);
      if (in_.failed()) {
        return i;
      }
    }
    return program_.writes.size();
  }

 private:
  // Reading

  void one(const ReadOp& op) {
    Slot slot;
    switch (op.kind) {
      case ReadOp::Kind::numbers:
        slot = {in_.numbers(op.count, op.width), static_cast<std::size_t>(op.count)};
        break;
      case ReadOp::Kind::sequence: {
        const std::uint32_t count = in_.count();
        slot = {in_.numbers(count, op.width), count};
        break;
      }
      case ReadOp::Kind::string:
        slot.at = in_.at();
        static_cast<void>(in_.string());
        break;
      case ReadOp::Kind::wstring:
        slot.at = in_.at();
        wide_string();
        break;
      case ReadOp::Kind::place:
        slot.at = in_.at();
        break;
      case ReadOp::Kind::other:
        slot.at = in_.at();
        skip(program_.types[op.type]);
        break;
    }
    if (op.slot != no_slot) {
      slots_[op.slot] = slot;
    }
  }

  std::uint32_t wide_string() {
    const std::uint32_t units = in_.count();
    in_.numbers(units, 4);
    return units;
  }

  // Each element takes at least a byte, so that the message bounds the loops.
  void skip(const FieldType& type) {
    std::uint64_t count = type.array == ArrayKind::none ? 1 : type.array_size;
    if (type.array == ArrayKind::bounded || type.array == ArrayKind::unbounded) {
      count = in_.count();
    }
    if (type.primitive && !is_text(type)) {
      in_.numbers(count, width(*type.primitive));
      return;
    }
    for (std::uint64_t i = 0; i < count && !in_.failed(); ++i) {
      if (!type.primitive) {
        const MessageDefinition& message = program_.from.messages[type.message_index];
        if (message.fields.empty()) {
          in_.take(1, 1);
        }
        for (const Field& field : message.fields) {
          skip(field.type);
        }
      } else if (*type.primitive == Primitive::string) {
        static_cast<void>(in_.string());
      } else {
        wide_string();
      }
    }
  }

  // Writing

  void one(const WriteOp& op) {
    switch (op.kind) {
      case WriteOp::Kind::number:
        put(op.width, number(slots_[op.slot], op.element, op.width));
        break;
      case WriteOp::Kind::mapped: {
        const NumberMap& map = program_.maps[op.map];
        put(op.width, mapped(map, number(slots_[op.slot], op.element, width(map.from))));
        break;
      }
      case WriteOp::Kind::constant:
        put(op.width, op.bits);
        break;
      case WriteOp::Kind::blank: {
        align_cdr(out_, op.width);
        const std::size_t bytes = static_cast<std::size_t>(op.count) * op.width;
        std::fill_n(out_.room(bytes), bytes, std::byte{0});
        break;
      }
      case WriteOp::Kind::array:
        if (slots_[op.slot].count != op.count) {
          in_.fail(ConversionFault::bad_length);
          return;
        }
        numbers(op, slots_[op.slot]);
        break;
      case WriteOp::Kind::sequence: {
        const Slot slot = slots_[op.slot];
        if (slot.count > op.bound) {
          in_.fail(ConversionFault::bound_exceeded);
          return;
        }
        write_cdr_u32(out_, static_cast<std::uint32_t>(slot.count));
        numbers(op, slot);
        break;
      }
      case WriteOp::Kind::string:
        in_.go(slots_[op.slot].at);
        string(op.bound);
        break;
      case WriteOp::Kind::wstring:
        in_.go(slots_[op.slot].at);
        wstring(op.bound);
        break;
      case WriteOp::Kind::text: {
        const std::string& text = program_.texts[op.index];
        put_text(std::as_bytes(std::span{text}));
        break;
      }
      case WriteOp::Kind::wide_text: {
        const std::vector<std::uint32_t>& units = program_.wide_texts[op.index];
        write_cdr_u32(out_, static_cast<std::uint32_t>(units.size()));
        for (const std::uint32_t unit : units) {
          put(4, unit);
        }
        break;
      }
      case WriteOp::Kind::other:
        in_.go(slots_[op.slot].at);
        copy(program_.types[op.index], program_.types[op.to_type]);
        break;
      case WriteOp::Kind::received:
        put_time(received_.count());
        break;
      case WriteOp::Kind::time:
        time(op);
        break;
      case WriteOp::Kind::time_number:
        time_number(op);
        break;
    }
  }

  [[nodiscard]] std::uint64_t number(const Slot& slot, std::size_t element, std::size_t width) const {
    return load_number(in_.data(slot.at + element * width), width, in_.order());
  }

  void put(std::size_t width, std::uint64_t bits) {
    align_cdr(out_, width);
    store_number(out_.room(width), width, bits, std::endian::native);
  }

  std::uint64_t mapped(const NumberMap& map, std::uint64_t bits) {
    if (map.from == Primitive::boolean && bits > 1) {
      in_.fail(ConversionFault::bad_bool);
    } else if (!map.convert(bits, counters_)) {
      in_.fail(ConversionFault::not_in_table);
    }
    return bits;
  }

  void numbers(const WriteOp& op, const Slot& slot) {
    if (slot.count == 0) {
      return;
    }
    align_cdr(out_, op.width);
    const std::size_t bytes = slot.count * op.width;
    if (op.is_mapped) {
      const NumberMap& map = program_.maps[op.map];
      const std::size_t from_width = width(map.from);
      for (std::size_t i = 0; i < slot.count && !in_.failed(); ++i) {
        const std::uint64_t bits = mapped(map, number(slot, i, from_width));
        store_number(out_.room(op.width), op.width, bits, std::endian::native);
      }
    } else if (op.width > 1 && in_.swaps()) {
      copy_swapped(out_.room(bytes), in_.data(slot.at), slot.count, op.width);
    } else {
      out_.put({in_.data(slot.at), bytes});
    }
  }

  void put_text(ByteView text) {
    write_cdr_u32(out_, static_cast<std::uint32_t>(text.size() + 1));
    std::byte* const to = out_.room(text.size() + 1);
    copy_few(to, text.data(), text.size());
    to[text.size()] = std::byte{0};
  }

  void string(std::uint32_t bound) {
    const ByteView text = in_.string();
    if (text.size() > bound) {
      in_.fail(ConversionFault::bound_exceeded);
    }
    if (!in_.failed()) {
      put_text(text);
    }
  }

  void wstring(std::uint32_t bound) {
    const std::uint32_t units = in_.count();
    const std::size_t at = in_.numbers(units, 4);
    if (units > bound) {
      in_.fail(ConversionFault::bound_exceeded);
    }
    if (in_.failed()) {
      return;
    }
    write_cdr_u32(out_, units);
    for (std::size_t i = 0; i < units; ++i) {
      put(4, load_u32(in_.data(at + 4 * i), in_.order()));
    }
  }

  void put_time(std::int64_t nanoseconds) {
    std::int64_t seconds = nanoseconds / nanoseconds_per_second;
    std::int64_t rest = nanoseconds % nanoseconds_per_second;
    if (rest < 0) {  // a Duration before now: -0.5 s is -1 s and 500,000,000 ns
      --seconds;
      rest += nanoseconds_per_second;
    }
    constexpr std::int64_t largest = std::numeric_limits<std::int32_t>::max();
    if (seconds > largest || seconds < -largest - 1) {
      ++counters_.saturated;
      rest = seconds > 0 ? nanoseconds_per_second - 1 : 0;
      seconds = seconds > 0 ? largest : -largest - 1;
    }
    put(4, static_cast<std::uint32_t>(seconds));
    put(4, static_cast<std::uint32_t>(rest));
  }

  void time(const WriteOp& op) {
    const NumberMap& map = program_.maps[op.map];
    const std::uint64_t bits = number(slots_[op.slot], op.element, width(map.from));
    const std::int64_t unit = nanoseconds_per(op.unit);
    if (is_real(map.from)) {
      put_time(static_cast<std::int64_t>(NumberMap::nearest(
          NumberMap::value(bits, map.from) * static_cast<double>(unit), Primitive::int64, counters_)));
      return;
    }
    // What is too large for nanoseconds is too large for seconds, too, or close to it.
    std::int64_t number = NumberMap::whole(bits, map.from);
    if (!is_signed_whole(map.from) && number < 0) {
      number = std::numeric_limits<std::int64_t>::max();
    }
    std::int64_t nanoseconds = 0;
    if (__builtin_mul_overflow(number, unit, &nanoseconds)) {
      nanoseconds =
          number < 0 ? std::numeric_limits<std::int64_t>::min() : std::numeric_limits<std::int64_t>::max();
    }
    put_time(nanoseconds);
  }

  void time_number(const WriteOp& op) {
    const NumberMap& map = program_.maps[op.map];
    const Slot slot = slots_[op.slot];  // of the seconds, behind which the nanoseconds stand
    const std::int64_t seconds = NumberMap::whole(number(slot, 0, 4), Primitive::int32);
    const auto rest = static_cast<std::int64_t>(number(slot, 1, 4));
    const std::int64_t nanoseconds = seconds * nanoseconds_per_second + rest;
    const std::int64_t unit = nanoseconds_per(op.unit);
    if (is_real(map.to)) {
      put(op.width, NumberMap::nearest(static_cast<double>(nanoseconds) / static_cast<double>(unit), map.to,
                                       counters_));
      return;
    }
    std::int64_t number = nanoseconds / unit;
    if (nanoseconds % unit < 0) {
      --number;
    }
    auto bits = static_cast<std::uint64_t>(number);
    const NumberMap whole{.from = Primitive::int64, .to = map.to};
    static_cast<void>(whole.convert(bits, counters_));
    put(op.width, bits);
  }

  /// All of a part whose types are alike on both sides, but for bounds.
  void copy(const FieldType& from, const FieldType& to) {
    std::uint64_t count = from.array == ArrayKind::none ? 1 : from.array_size;
    const bool is_sequence = from.array == ArrayKind::bounded || from.array == ArrayKind::unbounded;
    if (is_sequence) {
      count = in_.count();
      if (to.array == ArrayKind::bounded && count > to.array_size) {
        in_.fail(ConversionFault::bound_exceeded);
        return;
      }
      write_cdr_u32(out_, static_cast<std::uint32_t>(count));
    }
    if (from.primitive && !is_text(from)) {
      const std::size_t bytes = width(*from.primitive);
      const std::size_t at = in_.numbers(count, bytes);
      if (!in_.failed()) {
        numbers({.width = static_cast<std::uint8_t>(bytes)}, {at, static_cast<std::size_t>(count)});
      }
      return;
    }
    const std::uint32_t bound =
        to.string_bound == 0 ? std::numeric_limits<std::uint32_t>::max() : to.string_bound;
    for (std::uint64_t i = 0; i < count && !in_.failed(); ++i) {
      if (!from.primitive) {
        copy_message(program_.from.messages[from.message_index], program_.to.messages[to.message_index]);
      } else if (*from.primitive == Primitive::string) {
        string(bound);
      } else {
        wstring(bound);
      }
    }
  }

  void copy_message(const MessageDefinition& from, const MessageDefinition& to) {
    if (from.fields.empty()) {
      in_.take(1, 1);
      *out_.room(1) = std::byte{0};
    }
    for (std::size_t i = 0; i < from.fields.size() && !in_.failed(); ++i) {
      copy(from.fields[i].type, to.fields[i].type);
    }
  }

  const MapProgram& program_;
  Reader& in_;
  std::chrono::nanoseconds received_;
  Output& out_;
  std::vector<Slot>& slots_;
  MapCounters& counters_;
};

/// Of a fault in a write: bounds are those of what is made, everything else concerns what is read.
ConversionError write_error(const MapProgram& program, std::size_t write, ConversionFault fault,
                            std::size_t at) {
  const bool is_bound = fault == ConversionFault::bound_exceeded || fault == ConversionFault::bad_length;
  const std::string& source = program.write_sources[write];
  return {.fault = fault,
          .offset = at,
          .field = is_bound || source.empty() ? program.write_labels[write] : source,
          .expected = fault == ConversionFault::not_in_table
                          ? fmt::format("the table of `map` has no such value, and no `otherwise`")
                          : std::string{}};
}

}  // namespace

tl::expected<Gathered, ConversionError> FieldMap::convert(ByteView sample, std::chrono::nanoseconds received,
                                                          std::size_t reference_from, MapScratch& scratch,
                                                          MapCounters& counters) const {
  if (sample.size() < encapsulation_bytes) {
    return tl::unexpected{ConversionError{.fault = ConversionFault::truncated}};
  }
  if (sample.size() > max_converted_bytes) {
    return tl::unexpected{ConversionError{.fault = ConversionFault::too_large}};
  }
  if (sample[0] != std::byte{0} || sample[1] > std::byte{1}) {
    return tl::unexpected{ConversionError{.fault = ConversionFault::bad_encapsulation}};
  }
  Reader reader{sample, sample[1] == std::byte{1} ? std::endian::little : std::endian::big};
  scratch.slots.resize(program_.slots);
  Output& out = scratch.output;
  out.begin(reference_from);
  std::ranges::copy(encapsulation, out.room(encapsulation_bytes));
  Mapper mapper{program_, reader, received, scratch, counters};
  if (const std::size_t done = mapper.read(); reader.failed()) {
    return tl::unexpected{
        ConversionError{.fault = reader.fault(), .offset = reader.at(), .field = program_.read_labels[done]}};
  }
  if (reader.left() > 3 && !program_.may_be_longer) {
    return tl::unexpected{ConversionError{.fault = ConversionFault::trailing_bytes, .offset = reader.at()}};
  }
  if (const std::size_t done = mapper.write(); reader.failed()) {
    const std::uint32_t slot = program_.writes[done].slot;
    return tl::unexpected{
        write_error(program_, done, reader.fault(), slot == no_slot ? reader.at() : scratch.slots[slot].at)};
  }
  return out.finish();
}

}  // namespace trestle::messages
