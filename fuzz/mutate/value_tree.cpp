#include "fuzz/mutate/value_tree.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace trestle::fuzz {
namespace {

using Kind = Shape::Kind;

constexpr std::size_t bytes_in_front = 16;
constexpr std::uint32_t tag_bytes = 2;
/// Elements without bytes would be without end, and so would lists in lists of tiny elements take long.
constexpr std::size_t most_values = 20'000;

std::size_t unit_of(const Shape& shape) {
  return shape.encoding == Shape::Encoding::utf8 ? 1 : 2;
}

std::span<const std::byte> bom_of(const Shape& shape) {
  static constexpr std::array utf8{std::byte{0xef}, std::byte{0xbb}, std::byte{0xbf}};
  static constexpr std::array big{std::byte{0xfe}, std::byte{0xff}};
  static constexpr std::array little{std::byte{0xff}, std::byte{0xfe}};
  switch (shape.encoding) {
    case Shape::Encoding::utf8:
      return utf8;
    case Shape::Encoding::utf16be:
      return big;
    case Shape::Encoding::utf16le:
      break;
  }
  return little;
}

bool is_tagged(const Shape& structure) {
  return std::ranges::any_of(structure.parts, [](const Shape& one) { return one.tag.has_value(); });
}

/// A list of a fixed number of elements, in front of which no length stands.
bool is_fixed(const Shape& list) {
  return list.length == 0 && list.fewest == list.most;
}

std::uint16_t id_of(std::uint16_t tag) {
  return static_cast<std::uint16_t>(tag & 0x0fffU);
}

/// The length field that a tag announces: those of the wire types 5 to 7 are told by it.
std::uint8_t length_of(unsigned wire_type, const Shape& shape) {
  switch (wire_type) {
    case 5:
      return 1;
    case 6:
      return 2;
    case 7:
      return 4;
    default:
      return shape.length;
  }
}

/// How many bits of a number of so many go into the byte that comes first: in big endian what is left over.
unsigned first_chunk(unsigned bits, std::endian order) {
  return order == std::endian::big && bits % 8 != 0 ? bits % 8 : std::min(bits, 8U);
}

// --- Writing ----------------------------------------------------------------------------------------------

class Writer {
 public:
  void write(const ValueTree& value) {
    const Shape& shape = *value.shape;
    switch (shape.kind) {
      case Kind::number:
        return number(shape, value.number);
      case Kind::text:
        return text(value);
      case Kind::list:
        length_field(value, [&] { parts(value); });
        if (!is_fixed(shape)) {
          pad(shape);
        }
        return;
      case Kind::structure:
        return length_field(value, [&] { is_tagged(shape) ? tagged(value) : parts(value); });
      case Kind::choice:
        return choice(value);
    }
  }

  Bytes take() {
    end_bits();
    return std::move(bytes_);
  }

 private:
  void put(std::uint64_t number, std::size_t width, std::endian order) {
    end_bits();
    for (std::size_t at = 0; at < width; ++at) {
      const std::size_t shift = 8 * (order == std::endian::big ? width - 1 - at : at);
      bytes_.push_back(static_cast<std::byte>(number >> shift));
    }
  }
  void put(std::span<const std::byte> more) {
    end_bits();
    bytes_.insert(bytes_.end(), more.begin(), more.end());
  }
  void overwrite(std::size_t at, std::uint64_t number, std::size_t width, std::endian order) {
    for (std::size_t i = 0; i < width; ++i) {
      const std::size_t shift = 8 * (order == std::endian::big ? width - 1 - i : i);
      bytes_[at + i] = static_cast<std::byte>(number >> shift);
    }
  }
  void end_bits() { bit_ = 0; }

  void number(const Shape& shape, std::uint64_t number) {
    if (shape.bits == 0 && bit_ == 0) {
      return put(number, shape.bytes, shape.order);
    }
    const unsigned bits = shape.bits != 0 ? shape.bits : shape.bytes * 8U;
    unsigned taken = 0;
    for (unsigned part = first_chunk(bits, shape.order); taken < bits; part = std::min(bits - taken, 8U)) {
      const unsigned shift = shape.order == std::endian::big ? bits - taken - part : taken;
      for (unsigned at = 0; at < part; ++at) {
        if (bit_ == 0) {
          bytes_.push_back(std::byte{});
        }
        bytes_.back() |= static_cast<std::byte>((number >> (shift + at) & 1U) << bit_);
        bit_ = (bit_ + 1) % 8;
      }
      taken += part;
    }
  }

  /// @param extra  bytes behind the length field that `inside` writes and that it does not count.
  template <typename Inside>
  void length_field(const ValueTree& value, const Inside& inside, std::size_t extra = 0) {
    const Shape& shape = *value.shape;
    const std::size_t at = bytes_.size();
    put(0, shape.length, shape.length_order);
    inside();
    end_bits();
    const std::size_t count = bytes_.size() - at - shape.length - extra;
    overwrite(at, value.flaw == Flaw::length ? value.wrong : count, shape.length, shape.length_order);
  }

  void parts(const ValueTree& value) {
    for (const ValueTree& one : value.parts) {
      write(one);
    }
  }

  void tagged(const ValueTree& value) {
    for (const ValueTree& one : value.parts) {
      put(one.flaw == Flaw::tag ? one.wrong : one.shape->tag.value_or(0), tag_bytes, std::endian::big);
      write(one);
      end_bits();
    }
  }

  void text(const ValueTree& value) {
    const Shape& shape = *value.shape;
    const bool is_filled_up = shape.length == 0 && shape.fixed_bytes != 0;
    const auto content = [&] {
      const std::size_t begin = bytes_.size();
      if (shape.bom && value.flaw != Flaw::no_bom && value.flaw != Flaw::bare) {
        put(bom_of(shape));
      }
      put(value.text);
      const std::size_t last = is_filled_up ? begin + shape.fixed_bytes : bytes_.size();
      if (shape.terminator && (value.flaw == Flaw::no_terminator || value.flaw == Flaw::bare)) {
        return bytes_.resize(last, std::byte{'x'});
      }
      if (shape.terminator && is_filled_up) {
        bytes_.resize(
            std::min(bytes_.size(), last - std::min<std::size_t>(unit_of(shape), shape.fixed_bytes)));
      }
      if (shape.terminator) {
        put(0, unit_of(shape), std::endian::big);
      }
      if (is_filled_up) {
        bytes_.resize(last);
      }
    };
    length_field(value, content);
    if (shape.length != 0) {
      pad(shape);
    }
  }

  void choice(const ValueTree& value) {
    const Shape& shape = *value.shape;
    const auto selector = [&] {
      const std::uint64_t right = value.number < shape.selectors.size() ? shape.selectors[value.number] : 0;
      put(value.flaw == Flaw::selector ? value.wrong : right, shape.selector, shape.length_order);
    };
    const auto data = [&] {
      const std::size_t begin = bytes_.size();
      put(value.text);
      parts(value);
      end_bits();
      if (shape.length == 0 && shape.fixed_bytes != 0) {
        bytes_.resize(begin + shape.fixed_bytes);
      }
    };
    if (shape.length_first) {
      length_field(
          value,
          [&] {
            selector();
            data();
          },
          shape.length_counts_selector ? 0 : shape.selector);
    } else {
      selector();
      length_field(value, data);
    }
    if (shape.length != 0) {
      pad(shape);
    }
  }

  void pad(const Shape& shape) {
    end_bits();
    while (shape.alignment > 1 && (bytes_in_front + bytes_.size()) % shape.alignment != 0) {
      bytes_.push_back(std::byte{});
    }
  }

  Bytes bytes_;
  unsigned bit_ = 0;  ///< bits of the last byte that are taken; 0: all of it
};

// --- Reading ----------------------------------------------------------------------------------------------

class Reader {
 public:
  explicit Reader(std::span<const std::byte> payload) : bytes_{payload}, end_{payload.size()} {}

  ValueTree read(const Shape& shape) { return read(shape, shape.length); }
  [[nodiscard]] bool is_used_up() {
    end_bits();
    return !failed_ && at_ == end_;
  }

 private:
  ValueTree read(const Shape& shape, std::uint8_t length) {
    ValueTree value{.shape = &shape};
    failed_ = failed_ || ++values_ > most_values;
    switch (shape.kind) {
      case Kind::number:
        value.number = number(shape);
        break;
      case Kind::text:
        text(value, length);
        break;
      case Kind::list:
        list(value, length);
        break;
      case Kind::structure:
        within(length == 0 ? left() : count(length, shape), length != 0,
               [&] { is_tagged(shape) ? tagged(value) : members(value); });
        break;
      case Kind::choice:
        choice(value, length);
        break;
    }
    return value;
  }

  [[nodiscard]] std::size_t left() const { return end_ - at_; }
  std::span<const std::byte> take(std::size_t size) {
    end_bits();
    if (failed_ || size > left()) {
      failed_ = true;
      return {};
    }
    return bytes_.subspan(std::exchange(at_, at_ + size), size);
  }
  std::uint64_t integer(std::size_t width, std::endian order) {
    const std::span<const std::byte> from = take(width);
    std::uint64_t number = 0;
    for (std::size_t i = 0; i < from.size(); ++i) {
      const std::byte one = order == std::endian::big ? from[i] : from[from.size() - 1 - i];
      number = number << 8U | std::to_integer<std::uint64_t>(one);
    }
    return number;
  }
  std::size_t count(std::uint8_t length, const Shape& shape) {
    return static_cast<std::size_t>(integer(length, shape.length_order));
  }
  void end_bits() {
    if (bit_ != 0) {
      bit_ = 0;
      ++at_;
    }
  }

  std::uint64_t number(const Shape& shape) {
    if (shape.bits == 0 && bit_ == 0) {
      return integer(shape.bytes, shape.order);
    }
    const unsigned bits = shape.bits != 0 ? shape.bits : shape.bytes * 8U;
    std::uint64_t number = 0;
    unsigned taken = 0;
    for (unsigned part = first_chunk(bits, shape.order); taken < bits; part = std::min(bits - taken, 8U)) {
      const unsigned shift = shape.order == std::endian::big ? bits - taken - part : taken;
      for (unsigned i = 0; i < part; ++i) {
        if (failed_ || at_ >= end_) {
          failed_ = true;
          return 0;
        }
        number |= (std::to_integer<std::uint64_t>(bytes_[at_]) >> bit_ & 1U) << (shift + i);
        if (++bit_ == 8) {
          bit_ = 0;
          ++at_;
        }
      }
      taken += part;
    }
    return number;
  }

  /// Runs `inside` with the next `size` bytes as all that there is.
  /// @param all  what `inside` leaves of them is skipped.
  template <typename Inside>
  void within(std::size_t size, bool all, const Inside& inside) {
    end_bits();
    if (failed_ || size > left()) {
      failed_ = true;
      return;
    }
    const std::size_t outer = std::exchange(end_, at_ + size);
    inside();
    end_bits();
    if (all && !failed_) {
      at_ = end_;
    }
    end_ = outer;
  }

  void members(ValueTree& value) {
    for (const Shape& part : value.shape->parts) {
      if (!failed_) {
        value.parts.push_back(read(part));
      }
    }
  }

  /// Those that are not known are left out.
  void tagged(ValueTree& value) {
    while (!failed_ && left() > 0) {
      const auto tag = static_cast<std::uint16_t>(integer(tag_bytes, std::endian::big));
      const auto wire_type = static_cast<unsigned>(tag >> 12U & 7U);
      const auto& parts = value.shape->parts;
      const auto found = std::ranges::find_if(
          parts, [&](const Shape& one) { return one.tag && id_of(*one.tag) == id_of(tag); });
      if (found != parts.end()) {
        value.parts.push_back(read(*found, length_of(wire_type, *found)));
        end_bits();
      } else if (wire_type < 4) {
        (void)take(std::size_t{1} << wire_type);
      } else {
        const Shape unknown{.length = 4};
        (void)take(count(length_of(wire_type, unknown), unknown));
      }
    }
  }

  void list(ValueTree& value, std::uint8_t length) {
    const Shape& shape = *value.shape;
    const bool is_counted = length == 0 && shape.fewest == shape.most;
    within(length == 0 ? left() : count(length, shape), length != 0, [&] {
      while (!failed_ && (is_counted ? value.parts.size() < shape.most : left() > 0)) {
        const std::size_t begin = at_;
        value.parts.push_back(read(shape.parts.front()));
        failed_ = failed_ || (!is_counted && at_ == begin && bit_ == 0);
      }
    });
    if (!is_fixed(shape)) {
      skip_padding(shape);
    }
  }

  void text(ValueTree& value, std::uint8_t length) {
    const Shape& shape = *value.shape;
    const std::size_t unit = unit_of(shape);
    std::span<const std::byte> all;
    if (length != 0) {
      all = take(count(length, shape));
    } else if (shape.fixed_bytes != 0) {
      all = take(shape.fixed_bytes);
    } else {
      all = to_terminator(unit);
    }
    if (std::ranges::equal(all.first(std::min(all.size(), bom_of(shape).size())), bom_of(shape))) {
      all = all.subspan(bom_of(shape).size());
    } else if (shape.bom) {
      value.flaw = Flaw::no_bom;
    }
    if (length == 0 && shape.fixed_bytes != 0) {
      while (all.size() >= unit && is_zero(all.last(unit))) {
        all = all.first(all.size() - unit);
      }
    } else if (shape.terminator && all.size() >= unit && is_zero(all.last(unit))) {
      all = all.first(all.size() - unit);
    } else if (shape.terminator) {
      value.flaw = value.flaw == Flaw::no_bom ? Flaw::bare : Flaw::no_terminator;
    }
    value.text.assign(all.begin(), all.end());
    if (length != 0) {
      skip_padding(shape);
    }
  }
  static bool is_zero(std::span<const std::byte> unit) {
    return std::ranges::all_of(unit, [](std::byte one) { return one == std::byte{}; });
  }
  std::span<const std::byte> to_terminator(std::size_t unit) {
    end_bits();
    std::size_t size = 0;
    while (size + unit <= left() && !is_zero(bytes_.subspan(at_ + size, unit))) {
      size += unit;
    }
    return take(std::min(size + unit, left()));
  }

  void choice(ValueTree& value, std::uint8_t length) {
    const Shape& shape = *value.shape;
    std::size_t size = shape.length_first && length != 0 ? count(length, shape) : 0;
    const auto selector = static_cast<std::uint32_t>(integer(shape.selector, shape.length_order));
    if (!shape.length_first && length != 0) {
      size = count(length, shape);
    } else if (shape.length_counts_selector) {
      size -= std::min<std::size_t>(size, shape.selector);
    }
    if (length == 0) {
      size = shape.fixed_bytes != 0 ? shape.fixed_bytes : left();
    }
    const auto known = std::ranges::find(shape.selectors, selector);
    value.number = static_cast<std::uint64_t>(known - shape.selectors.begin());
    within(size, length != 0 || shape.fixed_bytes != 0, [&] {
      if (known != shape.selectors.end()) {
        value.parts.push_back(read(shape.parts[value.number]));
      } else {
        const auto data = take(left());
        value.text.assign(data.begin(), data.end());
        value.flaw = Flaw::selector;
        value.wrong = selector;
      }
    });
    if (length != 0) {
      skip_padding(shape);
    }
  }

  /// Where what holds it ends, it may be missing.
  void skip_padding(const Shape& shape) {
    end_bits();
    while (!failed_ && shape.alignment > 1 && left() > 0 && (bytes_in_front + at_) % shape.alignment != 0) {
      ++at_;
    }
  }

  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
  std::size_t end_;
  unsigned bit_ = 0;  ///< bits of the byte at `at_` that are taken
  bool failed_ = false;
  std::size_t values_ = 0;
};

}  // namespace

std::optional<ValueTree> read_values(std::span<const std::byte> payload, const Shape& shape) {
  Reader reader{payload};
  ValueTree values = reader.read(shape);
  return reader.is_used_up() ? std::optional{std::move(values)} : std::nullopt;
}

Bytes write_values(const ValueTree& values) {
  Writer writer;
  writer.write(values);
  return writer.take();
}

}  // namespace trestle::fuzz
