#include "fuzz/mutate/mutate.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <optional>

#include "someip/wire/bytes.hpp"

namespace trestle::fuzz {
namespace {

constexpr std::size_t header_bytes = 16;
constexpr std::size_t entry_bytes = 16;
constexpr std::size_t no_limit = SIZE_MAX;

/// Numbers at which parsers err, of any width.
constexpr std::array<std::uint64_t, 24> edges{
    0,      1,      2,      3,      4,           7,           8,           9,
    15,     16,     17,     0x1f,   0x7f,        0x80,        0xff,        0x100,
    0x7fff, 0x8000, 0xfffe, 0xffff, 0x7fff'ffff, 0x8000'0000, 0xffff'fff0, 0xffff'ffff};

constexpr std::array<std::uint8_t, 14> message_types{0x00, 0x01, 0x02, 0x20, 0x21, 0x22, 0x40,
                                                     0x80, 0x81, 0xa0, 0xa1, 0xc0, 0x42, 0xff};
constexpr std::array<std::uint8_t, 12> entry_types{0x00, 0x01, 0x02, 0x04, 0x05, 0x06,
                                                   0x07, 0x08, 0x10, 0x7f, 0x80, 0xff};
constexpr std::array<std::uint8_t, 14> option_types{0x00, 0x01, 0x02, 0x03, 0x04, 0x06, 0x14,
                                                    0x15, 0x16, 0x24, 0x26, 0x77, 0x80, 0xff};

template <typename T>
T load(const Bytes& from, std::size_t at) {
  return someip::load<T>(from.data() + at);
}

template <typename T>
void store(Bytes& to, std::size_t at, T number) {
  someip::store<T>(to.data() + at, number);
}

/// Another value for a number: an edge, a neighbour, another bit, or anything.
template <typename T>
T changed(T number, Random& random) {
  switch (random.below(4)) {
    case 0:
      return static_cast<T>(random.pick(edges));
    case 1:
      return static_cast<T>(number + 1 - 2 * static_cast<T>(random.below(2)));
    case 2:
      return static_cast<T>(number ^ (T{1} << random.below(8 * sizeof(T))));
    default:
      return static_cast<T>(random.next());
  }
}

template <typename T>
void change(Bytes& message, std::size_t at, Random& random) {
  if (at + sizeof(T) <= message.size()) {
    store<T>(message, at, changed(load<T>(message, at), random));
  }
}

std::ptrdiff_t offset(std::size_t at) {
  return static_cast<std::ptrdiff_t>(at);
}

void erase(Bytes& message, std::size_t at, std::size_t count) {
  const std::size_t from = std::min(at, message.size());
  const std::size_t to = from + std::min(count, message.size() - from);
  message.erase(message.begin() + offset(from), message.begin() + offset(to));
}

void insert(Bytes& message, std::size_t at, const Bytes& more) {
  message.insert(message.begin() + offset(std::min(at, message.size())), more.begin(), more.end());
}

Bytes part(const Bytes& of, std::size_t at, std::size_t count) {
  const std::size_t from = std::min(at, of.size());
  return {of.begin() + offset(from), of.begin() + offset(from + std::min(count, of.size() - from))};
}

// --- Any bytes --------------------------------------------------------------------------------------------

/// From `first` on.
void change_bytes(Bytes& message, std::size_t first, Random& random) {
  if (message.size() <= first) {
    message.push_back(static_cast<std::byte>(random.next()));
    return;
  }
  const std::size_t at = first + random.below(message.size() - first);
  switch (random.below(8)) {
    case 0:
      message[at] ^= std::byte{1} << random.below(8);
      break;
    case 1:
      change<std::uint8_t>(message, at, random);
      break;
    case 2:
      change<std::uint16_t>(message, at, random);
      break;
    case 3:
      change<std::uint32_t>(message, at, random);
      break;
    case 4:
      erase(message, at, 1 + random.below(16));
      break;
    case 5: {
      Bytes more(1 + random.below(24));
      const bool same = random.chance(50);
      const auto fill = static_cast<std::byte>(random.pick(edges));
      for (std::byte& one : more) {
        one = same ? fill : static_cast<std::byte>(random.next());
      }
      insert(message, at, more);
      break;
    }
    case 6:
      insert(message, first + random.below(message.size() - first), part(message, at, 1 + random.below(64)));
      break;
    default:
      message.resize(at);
      break;
  }
}

// --- Service discovery ------------------------------------------------------------------------------------

/// A message of service discovery, taken apart.
struct Discovery {
  Bytes head;  ///< SOME/IP header, flags, reserved
  std::vector<Bytes> entries;
  std::vector<Bytes> options;
  Bytes tail;  ///< what belongs to none of these
};

std::optional<Discovery> take_apart(const Bytes& message) {
  if (message.size() < header_bytes + 12 || load<std::uint32_t>(message, 0) != 0xffff'8100) {
    return std::nullopt;
  }
  Discovery all{.head = part(message, 0, header_bytes + 4), .entries = {}, .options = {}, .tail = {}};
  std::size_t at = header_bytes + 8;
  const std::size_t entries_end = at + load<std::uint32_t>(message, header_bytes + 4);
  while (at + entry_bytes <= std::min(entries_end, message.size())) {
    all.entries.push_back(part(message, at, entry_bytes));
    at += entry_bytes;
  }
  if (at + 4 <= message.size()) {
    const std::size_t options_end = at + 4 + std::size_t{load<std::uint32_t>(message, at)};
    at += 4;
    while (at + 3 <= std::min(options_end, message.size())) {
      const std::size_t size = 3 + std::size_t{load<std::uint16_t>(message, at)};
      all.options.push_back(part(message, at, size));
      at += size;
    }
  }
  all.tail = part(message, at, no_limit);
  return all;
}

Bytes put_together(const Discovery& all) {
  Bytes message = all.head;
  const auto append_array = [&](const std::vector<Bytes>& array) {
    const std::size_t length_at = message.size();
    message.resize(length_at + 4);
    for (const Bytes& one : array) {
      insert(message, message.size(), one);
    }
    store<std::uint32_t>(message, length_at, static_cast<std::uint32_t>(message.size() - length_at - 4));
  };
  append_array(all.entries);
  append_array(all.options);
  insert(message, message.size(), all.tail);
  store<std::uint32_t>(message, 4, static_cast<std::uint32_t>(message.size() - 8));
  return message;
}

void change_entry(Bytes& entry, Random& random) {
  switch (random.below(10)) {
    case 0:
      entry[0] = static_cast<std::byte>(random.pick(entry_types));
      break;
    case 1:
      change<std::uint8_t>(entry, 1, random);  // index of the first run
      break;
    case 2:
      change<std::uint8_t>(entry, 2, random);  // of the second
      break;
    case 3:
      change<std::uint8_t>(entry, 3, random);  // how many options of each
      break;
    case 4:
      change<std::uint16_t>(entry, 4, random);  // service
      break;
    case 5:
      change<std::uint16_t>(entry, 6, random);  // instance
      break;
    case 6:
      change<std::uint8_t>(entry, 8, random);  // major
      break;
    case 7: {  // TTL, of three bytes
      constexpr std::array<std::uint32_t, 5> times{0, 1, 3, 0x00ff'fffe, 0x00ff'ffff};
      const std::uint32_t major = load<std::uint32_t>(entry, 8) & 0xff00'0000U;
      store<std::uint32_t>(entry, 8, major | random.pick(times));
      break;
    }
    default:
      change<std::uint16_t>(entry, random.chance(30) ? 12 : 14, random);  // counter; eventgroup, minor
      break;
  }
}

void change_option(Bytes& option, Random& random) {
  switch (random.below(7)) {
    case 0:
      option[2] = static_cast<std::byte>(random.pick(option_types));
      break;
    case 1:
      change<std::uint16_t>(option, 0, random);  // its length
      break;
    case 2:
      change_bytes(option, 3, random);
      store<std::uint16_t>(option, 0, static_cast<std::uint16_t>(option.size() - 3));
      break;
    case 3:
      change<std::uint32_t>(option, 4, random);  // the address
      break;
    case 4:
      change<std::uint16_t>(option, option.size() < 5 ? 3 : option.size() - 2, random);  // the port
      break;
    case 5:
      change<std::uint8_t>(option, option.size() < 6 ? 3 : option.size() - 3, random);  // the protocol
      break;
    default:
      change<std::uint8_t>(option, 3 + random.below(option.size() - 2), random);
      break;
  }
}

/// Another one, a copy, one less, or two in another order.
void rearrange(std::vector<Bytes>& array, Random& random) {
  if (array.empty()) {
    return;
  }
  const std::size_t at = random.below(array.size());
  const std::size_t other = random.below(array.size());
  switch (random.below(4)) {
    case 0:
      array.insert(array.begin() + offset(other), Bytes{array[at]});
      break;
    case 1:
      array.erase(array.begin() + offset(at));
      break;
    case 2:
      std::swap(array[at], array[other]);
      break;
    default:
      array.insert(array.end(), 1 + random.below(40), Bytes{array[at]});
      break;
  }
}

void change_discovery(Discovery& all, Random& random) {
  const bool of_options = !all.options.empty() && random.chance(40);
  std::vector<Bytes>& array = of_options ? all.options : all.entries;
  switch (random.below(10)) {
    case 0:
      change<std::uint32_t>(all.head, header_bytes, random);  // flags and reserved bits
      break;
    case 1:
      change<std::uint16_t>(all.head, 10, random);  // session
      break;
    case 2:
    case 3:
      rearrange(array, random);
      break;
    case 4:
      change_bytes(all.tail, 0, random);
      break;
    default:
      if (!array.empty()) {
        Bytes& one = array[random.below(array.size())];
        if (of_options && one.size() > 2) {
          change_option(one, random);
        } else if (!of_options) {
          change_entry(one, random);
        }
      }
      break;
  }
}

/// One of the lengths is wrong.
void change_length(Bytes& message, bool is_discovery, Random& random) {
  if (is_discovery && random.chance(60)) {
    const std::size_t entries_at = header_bytes + 4;
    const std::size_t options_at = entries_at + 4 + std::size_t{load<std::uint32_t>(message, entries_at)};
    change<std::uint32_t>(message, random.chance(50) ? entries_at : options_at, random);
  } else {
    change<std::uint32_t>(message, 4, random);
  }
}

// --- Any message ------------------------------------------------------------------------------------------

void change_header(Bytes& message, Random& random) {
  switch (random.below(8)) {
    case 0:
      change<std::uint16_t>(message, 0, random);  // service
      break;
    case 1:
      change<std::uint16_t>(message, 2, random);  // method
      break;
    case 2:
      change<std::uint16_t>(message, 8, random);  // client
      break;
    case 3:
      change<std::uint16_t>(message, 10, random);  // session
      break;
    case 4:
      change<std::uint8_t>(message, 12, random);  // protocol version
      break;
    case 5:
      change<std::uint8_t>(message, 13, random);  // interface version
      break;
    case 6:
      message[14] = static_cast<std::byte>(random.pick(message_types));
      break;
    default:
      change<std::uint8_t>(message, 15, random);  // return code
      break;
  }
}

bool is_segment(const Bytes& message) {
  return message.size() >= header_bytes + 4 && (message[14] & std::byte{0x20}) != std::byte{};
}

/// Its offset, of 28 bits that count 16 bytes each, three reserved bits, and the flag that more follow.
void change_segment(Bytes& message, Random& random) {
  const auto word = load<std::uint32_t>(message, header_bytes);
  constexpr std::array<std::uint32_t, 8> steps{0, 1, 2, 86, 87, 88, 0x0fff'ffff, 0x0fff'fff0};
  switch (random.below(5)) {
    case 0:
      store<std::uint32_t>(message, header_bytes, word ^ 1U);
      break;
    case 1:
      store<std::uint32_t>(message, header_bytes, (word & 0xfU) | (random.pick(steps) << 4U));
      break;
    case 2:
      store<std::uint32_t>(message, header_bytes, word + (random.chance(50) ? 0x10U : 0xffff'fff0U));
      break;
    case 3:
      message.resize(std::max<std::size_t>(header_bytes + 4, message.size() - random.below(20)));
      break;
    default:
      store<std::uint32_t>(message, header_bytes, word ^ (1U << random.below(32)));
      break;
  }
}

/// The message becomes a segment of one, or no longer is.
void toggle_segment(Bytes& message, Random& random) {
  const bool was = is_segment(message);
  message[14] ^= std::byte{0x20};
  if (was) {
    erase(message, header_bytes, 4);
  } else {
    insert(message, header_bytes,
           {std::byte{}, std::byte{}, std::byte{}, random.chance(70) ? std::byte{1} : std::byte{}});
  }
}

void change_message(Bytes& message, Random& random) {
  if (auto discovery = take_apart(message); discovery && random.chance(75)) {
    change_discovery(*discovery, random);
    message = put_together(*discovery);
  } else if (is_segment(message) && random.chance(60)) {
    change_segment(message, random);
  } else {
    switch (random.below(10)) {
      case 0:
        toggle_segment(message, random);
        break;
      case 1:
        insert(message, message.size(), part(message, 0, no_limit));  // the same once more behind it
        return;                                                       // with its own length
      case 2:
      case 3:
      case 4:
        change_header(message, random);
        break;
      default:
        change_bytes(message, header_bytes, random);
        break;
    }
  }
  repair_lengths(message);
}

}  // namespace

void repair_lengths(Bytes& message) {
  if (message.size() < header_bytes) {
    return;
  }
  if (const auto discovery = take_apart(message)) {
    message = put_together(*discovery);
  }
  store<std::uint32_t>(message, 4, static_cast<std::uint32_t>(message.size() - 8));
}

void mutate(Bytes& message, std::size_t max_size, Random& random) {
  if (message.size() < header_bytes || random.chance(8)) {
    change_bytes(message, 0, random);
  } else if (random.chance(12)) {
    change_length(message, take_apart(message).has_value(), random);
  } else {
    change_message(message, random);
  }
  message.resize(std::min(message.size(), max_size));
}

Bytes cross_over(std::span<const std::byte> one, std::span<const std::byte> other, std::size_t max_size,
                 Random& random) {
  Bytes first{one.begin(), one.end()};
  const Bytes second{other.begin(), other.end()};
  auto mine = take_apart(first);
  const auto theirs = take_apart(second);
  if (mine && theirs) {
    // Entries refer to options by their place, so that those of the second message mean something else now.
    mine->entries.insert(mine->entries.end(), theirs->entries.begin(), theirs->entries.end());
    mine->options.insert(mine->options.end(), theirs->options.begin(), theirs->options.end());
    first = put_together(*mine);
  } else {
    first.resize(random.below(first.size() + 1));
    insert(first, first.size(), part(second, random.below(second.size() + 1), no_limit));
    if (random.chance(70)) {
      repair_lengths(first);
    }
  }
  first.resize(std::min(first.size(), max_size));
  return first;
}

std::size_t mutate_in_place(std::uint8_t* data, std::size_t size, std::size_t max_size, std::uint64_t seed) {
  Random random{seed};
  const auto given = std::as_bytes(std::span{data, size});
  Bytes message{given.begin(), given.end()};
  mutate(message, max_size, random);
  std::memcpy(data, message.data(), message.size());
  return message.size();
}

}  // namespace trestle::fuzz
