#include "bridge/messages/convert/quick/shape.hpp"

#include <cstddef>
#include <cstring>

#include "bridge/messages/convert/program/byte_swap.hpp"
#include "bridge/messages/convert/program/wire_forms.hpp"

namespace trestle::messages::quick {
namespace {

/// The number of bytes that are compared at once.
constexpr std::size_t block = 32;
static_assert(Shape::least_bytes >= block);

constexpr std::byte all{0xff};
constexpr std::byte none{0};

/// Fits a vector register, if the processor has one of this width.
using Words = std::uint64_t __attribute__((vector_size(16)));

Words words(const std::byte* from) noexcept {
  Words numbers;
  std::memcpy(&numbers, from, sizeof numbers);
  return numbers;
}

/// Whether a block of `a` and `b` differs where `mask` has bits.
bool differs(const std::byte* a, const std::byte* b, const std::byte* mask) noexcept {
  Words difference{};
  for (std::size_t i = 0; i < block; i += sizeof difference) {
    difference |= (words(a + i) ^ words(b + i)) & words(mask + i);
  }
  return (difference[0] | difference[1]) != 0;
}

}  // namespace

__attribute__((hot)) bool Shape::fits(const Conversion& conversion, ByteView input) noexcept {
  if (key(conversion) != key_ || input.size() < reads_ ||
      ((conversion.position ^ position_) & (alignment_ - 1)) != 0) {
    return false;
  }
  bool other_numbers = false;
  const std::size_t last = reads_ - block;  // overlaps the one before it
  for (std::size_t at = 0;; at = std::min(at + block, last)) {
    if (differs(&input[at], &input_[at], &compared_[at])) {
      if (differs(&input[at], &input_[at], &fixed_[at])) {
        return false;
      }
      other_numbers = true;
    }
    if (at == last) {
      break;
    }
  }
  if (other_numbers) {
    set_loose(input.data());
  }
  misses_ = 0;
  patience_ = std::max(2U, patience_ - 1);
  return true;
}

/// From now on the numbers that differ are not compared any more.
__attribute__((noinline)) void Shape::set_loose(const std::byte* input) noexcept {
  for (std::uint32_t i = loose_; i < places_; ++i) {
    const Place place = place_[i];
    if (std::memcmp(input + place.from, &input_[place.from], place.bytes) != 0) {
      std::fill_n(&compared_[place.from], place.bytes, none);
      std::swap(place_[i], place_[loose_]);
      ++loose_;
    }
  }
}

void Shape::write(const std::byte* input, std::byte* to) const noexcept {
  std::memcpy(to, &output_[room_in_front], writes_);
  put_numbers(input, to);
}

__attribute__((hot)) void Shape::put_numbers(const std::byte* input, std::byte* to) const noexcept {
  for (std::uint32_t i = 0; i < loose_; ++i) {
    const Place place = place_[i];
    const std::byte* from = input + place.from;
    std::byte* out = to + place.to;
    // Number by number, to keep the code small: in a running bridge it is not in the cache.
    for (const std::byte* const end = from + place.bytes; from != end;
         from += place.width, out += place.width) {
      copy_few_numbers(out, from, 1, place.width, place.swap);
    }
  }
}

void Shape::fetch() const noexcept {
  constexpr std::size_t line = 64;
  constexpr std::size_t usual_bytes = 256;
  const auto ask = [](const void* from, std::size_t bytes) {
    for (std::size_t i = 0; i < bytes; i += line) {
      __builtin_prefetch(static_cast<const std::byte*>(from) + i);
    }
  };
  ask(this, offsetof(Shape, place_) + line);
  ask(output_.data(), usual_bytes);
  ask(input_.data(), usual_bytes);
  ask(compared_.data(), usual_bytes);
}

void Shape::begin(const Conversion& conversion, std::size_t operation, std::size_t input_at,
                  std::size_t output_at) noexcept {
  key_ = 0;
  next_key_ = key(conversion);
  position_ = static_cast<std::uint32_t>(conversion.position % 8);
  alignment_ = 4;
  first_ = end_ = operation;
  input_begin_ = input_at;
  output_begin_ = output_at;
  reads_ = writes_ = loose_ = places_ = noted_ = 0;
  misses_ = 0;
  patience_ = std::min(2 * patience_, most_patience);
  compared_.fill(all);
  fixed_.fill(all);
}

bool Shape::numbers(std::size_t input_at, std::size_t output_at, std::size_t count, std::size_t width,
                    bool swap) noexcept {
  const std::size_t from = input_at - input_begin_;
  const std::size_t to = output_at - output_begin_;
  if (count > most_number_bytes / width || noted_ == most_places || from + count * width > most_bytes ||
      to + count * width > most_bytes) {
    return false;
  }
  const std::size_t bytes = count * width;
  place_[noted_++] = {static_cast<std::uint16_t>(from), static_cast<std::uint16_t>(to),
                      static_cast<std::uint16_t>(bytes), static_cast<std::uint8_t>(width), swap};
  alignment_ = std::max(alignment_, static_cast<std::uint32_t>(width));
  std::fill_n(&fixed_[from], bytes, none);
  return true;
}

void Shape::padding(std::size_t from, std::size_t to) noexcept {
  const std::size_t end = std::min(to - input_begin_, most_bytes);
  for (std::size_t i = from - input_begin_; i < end; ++i) {
    compared_[i] = fixed_[i] = none;
  }
}

bool Shape::keep(std::size_t operation, std::size_t input_at, std::size_t written) noexcept {
  const std::size_t read = input_at - input_begin_;
  if (read > most_bytes || written > most_bytes) {
    return false;
  }
  end_ = operation;
  reads_ = static_cast<std::uint32_t>(read);
  writes_ = static_cast<std::uint32_t>(written);
  places_ = noted_;
  return true;
}

void Shape::finish(const std::byte* input, const std::byte* output) noexcept {
  if (reads_ < least_bytes || end_ - first_ < least_operations) {
    return;
  }
  std::memcpy(input_.data(), input, reads_);
  std::memcpy(output_.data(), encapsulation.data(), room_in_front);
  std::memcpy(&output_[room_in_front], output, writes_);
  std::fill_n(&output_[room_in_front + writes_], room_behind, none);
  key_ = next_key_;
}

}  // namespace trestle::messages::quick
