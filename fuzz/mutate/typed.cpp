#include "fuzz/mutate/typed.hpp"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "fuzz/mutate/value_tree.hpp"

namespace trestle::fuzz {
namespace {

using Kind = Shape::Kind;

/// Of one payload: lists in lists would have no end.
constexpr std::size_t most_new_values = 1'500;
/// Elements that a list has without a reason.
constexpr std::size_t usual_elements = 4;
/// Numbers of elements at which devices err.
constexpr std::array<std::uint32_t, 9> counts{0, 1, 2, 7, 8, 31, 127, 255, 256};

constexpr std::array<std::uint64_t, 14> number_edges{0,
                                                     1,
                                                     2,
                                                     0x7f,
                                                     0x80,
                                                     0xff,
                                                     0x100,
                                                     0x7fff,
                                                     0x8000,
                                                     0xffff,
                                                     0x7fff'ffff,
                                                     0x8000'0000,
                                                     0x7fff'ffff'ffff'ffff,
                                                     0xffff'ffff'ffff'ffff};
/// Not a number, the infinities, -0, the smallest and the largest number.
constexpr std::array<std::uint64_t, 7> floats32{0x7fc0'0000, 0x7f80'0000, 0xff80'0000, 0x8000'0000,
                                                0x0000'0001, 0x7f7f'ffff, 0x3f80'0000};
constexpr std::array<std::uint64_t, 7> floats64{
    0x7ff8'0000'0000'0000, 0x7ff0'0000'0000'0000, 0xfff0'0000'0000'0000, 0x8000'0000'0000'0000,
    0x0000'0000'0000'0001, 0x7fef'ffff'ffff'ffff, 0x3ff0'0000'0000'0000};

/// Pieces of text in UTF-8: of one to four bytes a character, a mark of byte order, and no text at all.
constexpr std::array<std::string_view, 9> pieces{
    "a", "%s%n", "\xc3\xa4", "\xe2\x82\xac", "\xf0\x9f\x9a\x97", "\"\\", "../", " ", "x"};
constexpr std::array<std::string_view, 5> no_pieces{"\xff", "\xc0\x80", "\xed\xa0\x80", "\xf4\x90\x80\x80",
                                                    std::string_view{"\0", 1}};
/// The same in UTF-16, as numbers: surrogates that stand alone are no text.
constexpr std::array<std::uint16_t, 6> units{0x0061, 0x00e4, 0x20ac, 0x0025, 0x002e, 0xfeff};
constexpr std::array<std::uint16_t, 4> no_units{0xd800, 0xdc00, 0x0000, 0xffff};

std::uint64_t any_number(const Shape& shape, Random& random) {
  if (shape.is_float && random.chance(60)) {
    return shape.bytes == 4 ? random.pick(floats32) : random.pick(floats64);
  }
  switch (random.below(3)) {
    case 0:
      return random.pick(number_edges);
    case 1:
      return random.below(16);
    default:
      return random.next();
  }
}

/// @param beyond  in percent: how often it is a value that it should not have.
std::uint64_t make_number(const Shape& shape, unsigned beyond, Random& random) {
  if (shape.known.empty()) {
    return any_number(shape, random);
  }
  if (!random.chance(beyond)) {
    return random.pick(shape.known);
  }
  // Most often those beside the known ones.
  return random.chance(60) ? random.pick(shape.known) + 1 - 2 * random.below(2) : any_number(shape, random);
}

void append_unit(Bytes& text, std::uint16_t unit, Shape::Encoding encoding) {
  const std::array<std::byte, 2> big{static_cast<std::byte>(unit >> 8U),
                                     static_cast<std::byte>(unit & 0xffU)};
  const bool swapped = encoding == Shape::Encoding::utf16le;
  text.push_back(big[swapped ? 1 : 0]);
  text.push_back(big[swapped ? 0 : 1]);
}

Bytes make_text(const Shape& shape, unsigned beyond, Random& random) {
  Bytes text;
  std::size_t size = random.below(12);
  const bool has_bound = shape.fixed_bytes != 0 || shape.most < 4'096;
  const std::size_t bound = shape.fixed_bytes != 0 ? shape.fixed_bytes : shape.most;
  if (has_bound && random.chance(30)) {
    size = bound;
  } else if (random.chance(5)) {
    size = random.pick(counts);
  }
  if (has_bound && !random.chance(beyond)) {
    size = std::min(size, bound);
  } else if (has_bound) {
    size = bound + 1 + random.below(3);
  }
  while (text.size() < size) {
    if (shape.encoding != Shape::Encoding::utf8) {
      append_unit(text, random.chance(beyond) ? random.pick(no_units) : random.pick(units), shape.encoding);
      continue;
    }
    const std::string_view piece = random.chance(beyond) ? random.pick(no_pieces) : random.pick(pieces);
    std::ranges::transform(piece, std::back_inserter(text),
                           [](char one) { return static_cast<std::byte>(one); });
  }
  return text;
}

class Maker {
 public:
  /// @param beyond  in percent: how often a value is one that it should not have.
  Maker(unsigned beyond, Random& random) : beyond_{beyond}, random_{random} {}

  ValueTree make(const Shape& shape) {
    ++made_;
    ValueTree value{.shape = &shape};
    switch (shape.kind) {
      case Kind::number:
        value.number = make_number(shape, beyond_, random_);
        break;
      case Kind::text:
        value.text = make_text(shape, beyond_, random_);
        break;
      case Kind::list:
        for (std::size_t left = elements(shape); left > 0; --left) {
          value.parts.push_back(make(shape.parts.front()));
        }
        break;
      case Kind::structure:
        for (const Shape& part : shape.parts) {
          if (!part.optional || random_.chance(60)) {
            value.parts.push_back(make(part));
          }
        }
        break;
      case Kind::choice:
        value.number = random_.below(shape.parts.size());
        value.parts.push_back(make(shape.parts[value.number]));
        break;
    }
    return value;
  }

 private:
  std::size_t elements(const Shape& list) {
    if (list.fewest == list.most && !random_.chance(beyond_)) {
      return made_ < most_new_values ? list.most : std::min<std::size_t>(list.most, usual_elements);
    }
    if (made_ > most_new_values) {
      return list.fewest;
    }
    std::size_t count = list.fewest + random_.below(usual_elements + 1);
    if (random_.chance(5)) {
      count = random_.pick(counts);
    } else if (list.most < 300 && random_.chance(15)) {
      count = list.most;
    }
    if (random_.chance(beyond_)) {
      return list.most < 300 ? std::size_t{list.most} + 1 : list.fewest - std::min(list.fewest, 1U);
    }
    return std::clamp<std::size_t>(count, list.fewest, list.most);
  }

  unsigned beyond_;
  Random& random_;
  std::size_t made_ = 0;
};

constexpr unsigned never = 0;
constexpr unsigned rarely = 2;
constexpr unsigned often = 30;

// --- Changing ---------------------------------------------------------------------------------------------

/// All values that are in it, itself among them.
void collect(ValueTree& value, std::vector<ValueTree*>& into) {
  into.push_back(&value);
  for (ValueTree& one : value.parts) {
    collect(one, into);
  }
}

auto place_in(std::vector<ValueTree>& parts, std::size_t at) {
  return parts.begin() + static_cast<std::ptrdiff_t>(at);
}

/// The size of what is in it, as its length field should have it, or nearly so.
std::uint32_t length_of(const ValueTree& value) {
  ValueTree inside = value;
  inside.flaw = Flaw::none;
  const std::size_t size = write_values(inside).size();
  return static_cast<std::uint32_t>(size - std::min<std::size_t>(size, value.shape->length));
}

void spoil_length(ValueTree& value, Random& random) {
  const std::uint32_t right = length_of(value);
  value.flaw = Flaw::length;
  switch (random.below(5)) {
    case 0:
      value.wrong = right + 1 + static_cast<std::uint32_t>(random.below(4));
      break;
    case 1:
      value.wrong = right - std::min(right, 1 + static_cast<std::uint32_t>(random.below(4)));
      break;
    case 2:
      value.wrong = 0;
      break;
    case 3:
      value.wrong = 0xffff'ffffU - static_cast<std::uint32_t>(random.below(8));
      break;
    default:
      value.wrong = static_cast<std::uint32_t>(random.pick(number_edges));
      break;
  }
}

void change_list(ValueTree& list, Random& random) {
  auto& parts = list.parts;
  const std::size_t at = random.below(parts.size());
  if (parts.empty()) {
    parts.push_back(Maker{often, random}.make(list.shape->parts.front()));
    return;
  }
  switch (random.below(4)) {
    case 0:
      parts.erase(place_in(parts, at));
      break;
    case 1:
      parts.insert(place_in(parts, at), ValueTree{parts[at]});
      break;
    case 2:
      std::swap(parts[at], parts[random.below(parts.size())]);
      break;
    default:
      parts.insert(parts.end(), random.pick(counts), ValueTree{parts[at]});
      break;
  }
}

/// One of its members is there, or not, or twice; or stands elsewhere; or has another tag.
void change_tagged(ValueTree& structure, Random& random) {
  auto& parts = structure.parts;
  const Shape& part = structure.shape->parts[random.below(structure.shape->parts.size())];
  const auto known = std::ranges::find(parts, &part, &ValueTree::shape);
  if (known == parts.end()) {
    parts.insert(place_in(parts, random.below(parts.size() + 1)), Maker{often, random}.make(part));
    return;
  }
  switch (random.below(4)) {
    case 0:
      parts.erase(known);
      break;
    case 1:
      parts.insert(place_in(parts, random.below(parts.size() + 1)), ValueTree{*known});
      break;
    case 2:
      std::swap(*known, parts[random.below(parts.size())]);
      break;
    default:
      known->flaw = Flaw::tag;
      known->wrong = part.tag.value_or(0) ^ (1U << random.below(16));
      break;
  }
}

void change_structure(ValueTree& structure, Random& random) {
  if (structure.shape->parts.empty()) {
    return;
  }
  if (structure.shape->parts.front().tag) {
    change_tagged(structure, random);
  } else if (!structure.parts.empty() && random.chance(50)) {
    structure.parts.pop_back();  // an older interface
  } else {
    structure.parts.push_back(Maker{often, random}.make(structure.shape->parts.back()));  // a newer one
  }
}

void change(ValueTree& value, Random& random) {
  const Shape& shape = *value.shape;
  if (shape.length != 0 && random.chance(25)) {
    spoil_length(value, random);
    return;
  }
  switch (shape.kind) {
    case Kind::text:
      if (random.chance(70)) {
        value.flaw = random.pick(std::array{Flaw::no_bom, Flaw::no_terminator, Flaw::bare});
        return;
      }
      break;
    case Kind::list:
      if (random.chance(60)) {
        change_list(value, random);
        return;
      }
      break;
    case Kind::structure:
      if (random.chance(50)) {
        change_structure(value, random);
        return;
      }
      break;
    case Kind::choice:
      if (random.chance(50)) {
        value.flaw = Flaw::selector;
        value.wrong = random.chance(60) ? static_cast<std::uint32_t>(random.below(shape.selectors.size() + 2))
                                        : static_cast<std::uint32_t>(random.pick(number_edges));
        return;
      }
      break;
    case Kind::number:
      break;
  }
  value = Maker{often, random}.make(shape);
}

struct WrongValue {
  Flaw flaw = Flaw::none;
  std::uint32_t wrong = 0;
};

/// All that can be wrong with a value itself.
std::vector<WrongValue> wrongs_of(const ValueTree& value) {
  const Shape& shape = *value.shape;
  std::vector<WrongValue> all;
  if (shape.length != 0 && shape.kind != Kind::number) {
    const std::uint32_t right = length_of(value);
    for (const std::uint32_t wrong : {right + 1, right - std::min(right, 1U), 0U, 0xffff'ffffU}) {
      all.push_back({Flaw::length, wrong});
    }
  }
  if (shape.kind == Kind::text) {
    for (const Flaw flaw : {Flaw::no_bom, Flaw::no_terminator, Flaw::bare}) {
      all.push_back({flaw});
    }
  }
  if (shape.kind == Kind::choice && !shape.selectors.empty()) {
    const auto most = *std::ranges::max_element(shape.selectors);
    for (const std::uint32_t wrong : {most + 1, 0U, 0xffff'ffffU}) {
      all.push_back({Flaw::selector, wrong});
    }
  }
  if (shape.tag) {
    all.push_back({Flaw::tag, *shape.tag ^ 0x0800U});
  }
  return all;
}

void cut(Bytes& payload, std::size_t max_bytes) {
  payload.resize(std::min(payload.size(), max_bytes));
}

}  // namespace

Bytes make_payload(const Shape& shape, std::size_t max_bytes, Random& random) {
  Bytes payload = write_values(Maker{rarely, random}.make(shape));
  cut(payload, max_bytes);
  return payload;
}

void mutate_payload(Bytes& payload, const Shape& shape, std::size_t max_bytes, Random& random) {
  auto values = read_values(payload, shape);
  if (!values) {
    values = Maker{rarely, random}.make(shape);
  }
  std::vector<ValueTree*> all;
  collect(*values, all);
  change(*all[random.below(all.size())], random);
  payload = write_values(*values);
  if (random.chance(4)) {
    payload.resize(random.below(payload.size() + 1));  // it ends within a value
  }
  cut(payload, max_bytes);
}

std::vector<Bytes> make_spoilt_payloads(const Shape& shape, std::size_t max_bytes, Random& random) {
  constexpr std::size_t most = 100;
  ValueTree values = Maker{never, random}.make(shape);
  std::vector<ValueTree*> all;
  collect(values, all);
  std::vector<Bytes> spoilt;
  for (ValueTree* const one : all) {
    for (const auto& [flaw, wrong] : wrongs_of(*one)) {
      if (spoilt.size() == most) {
        return spoilt;
      }
      one->flaw = flaw;
      one->wrong = wrong;
      spoilt.push_back(write_values(values));
      cut(spoilt.back(), max_bytes);
    }
    one->flaw = Flaw::none;
  }
  return spoilt;
}

bool has_shape(std::span<const std::byte> payload, const Shape& shape) {
  return read_values(payload, shape).has_value();
}

}  // namespace trestle::fuzz
