#pragma once
#include <algorithm>
#include <cstring>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "bridge/messages/convert/program/byte_swap.hpp"
#include "bridge/messages/convert/program/gathered.hpp"
#include "dds_adapter/copy_bytes.hpp"
#include "someip/wire/types.hpp"

namespace trestle::messages {

/// As memcpy, and quicker for the few bytes of a name or a number: for those a call costs more than the copy.
inline void copy_few(std::byte* to, const std::byte* from, std::size_t size) noexcept {
  if (size > 16) {
    copy_bytes(to, from, size);
  } else {
    copy_few_bytes(to, from, size);
  }
}

/// What a conversion writes, one message after another: each begins by forgetting the one before. The memory
/// grows with the largest message seen and is kept, so that in steady state nothing is allocated.
class Output {
 public:
  /// Makes room for results of which `bytes` are copied, not referenced.
  void reserve(std::size_t bytes) {
    if (bytes > capacity_) {
      reallocate(bytes);
    }
  }

  /// Forgets the last result. Runs of `reference_from` bytes and more are referenced from now on.
  void begin(std::size_t reference_from) noexcept {
    reference_from_ = reference_from;
    used_ = slice_begin_ = referenced_ = 0;
    slices_.clear();
  }

  [[nodiscard]] std::size_t reference_from() const noexcept { return reference_from_; }

  /// The next `size` bytes of the result, for the caller to fill at once: the next call may move them.
  [[nodiscard]] std::byte* room(std::size_t size) {
    if (size > capacity_ - used_) {
      reallocate(used_ + size);
    }
    std::byte* const place = memory_.get() + used_;
    used_ += size;
    return place;
  }

  /// The room that there is without getting more memory, and how much of its front has been filled.
  [[nodiscard]] std::span<std::byte> left() noexcept { return {memory_.get() + used_, capacity_ - used_}; }
  void use(std::size_t size) noexcept { used_ += size; }

  /// Takes back the last `size` bytes that room() gave.
  void give_back(std::size_t size) noexcept { used_ -= size; }

  /// Takes out `size` bytes that room() gave, at `place` (see below): what stands behind them moves up. Only
  /// what was copied before `place` keeps its place.
  void cut(std::size_t place, std::size_t size) noexcept {
    std::memmove(memory_.get() + place, memory_.get() + place + size, used_ - place - size);
    for (ByteView& slice : slices_) {
      if (const auto begin = offset(slice); begin && *begin > place) {
        slice = {slice.data() - size, slice.size()};
      } else if (begin && *begin + slice.size() > place) {
        slice = slice.first(slice.size() - size);
      }
    }
    slice_begin_ -= slice_begin_ > place ? size : 0;
    used_ -= size;
  }

  /// Appends bytes of the input, by reference when they are many.
  void put(ByteView bytes) {
    if (bytes.size() >= reference_from_) {
      reference(bytes);
    } else if (!bytes.empty()) {
      copy_few(room(bytes.size()), bytes.data(), bytes.size());
    }
  }

  /// Bytes of the result so far.
  [[nodiscard]] std::size_t position() const noexcept { return used_ + referenced_; }
  /// A place that room() gave, told by what copied() was before that call; valid as long as room()'s.
  [[nodiscard]] std::byte* place(std::size_t copied) noexcept { return memory_.get() + copied; }
  [[nodiscard]] std::size_t copied() const noexcept { return used_; }

  /// @return the same in memory of its own if its second slice, an array, is too small to be referenced.
  [[nodiscard]] Gathered referencing_from(std::size_t bytes, const Gathered& message) {
    if (message.slices[1].size() >= bytes) {
      return message;
    }
    begin(bytes);
    copy_to(message, room(message.bytes));
    return finish();
  }

  [[nodiscard]] Gathered finish() {
    close_slice();
    return {slices_, position()};
  }

 private:
  void reference(ByteView bytes) {
    if (bytes.empty()) {
      return;
    }
    close_slice();
    slices_.push_back(bytes);
    referenced_ += bytes.size();
  }

  /// Where a slice begins in memory_; nothing: it is not in there.
  [[nodiscard]] std::optional<std::size_t> offset(ByteView slice) const noexcept {
    const auto from = reinterpret_cast<std::uintptr_t>(memory_.get());
    const auto at = reinterpret_cast<std::uintptr_t>(slice.data());
    return at >= from && at < from + used_ ? std::optional{at - from} : std::nullopt;
  }

  void close_slice() {
    if (used_ > slice_begin_) {
      slices_.emplace_back(memory_.get() + slice_begin_, used_ - slice_begin_);
      slice_begin_ = used_;
    }
  }

  __attribute__((noinline, cold)) void reallocate(std::size_t needed) {
    const std::size_t bytes = std::max({needed, 2 * capacity_, std::size_t{4096}});
    std::unique_ptr<std::byte[]> memory{
        new std::byte[bytes]};  // not value-initialised: no page is touched early
    if (used_ > 0) {
      std::memcpy(memory.get(), memory_.get(), used_);
    }
    for (ByteView& slice : slices_) {
      if (const auto begin = offset(slice)) {
        slice = {memory.get() + *begin, slice.size()};
      }
    }
    memory_ = std::move(memory);
    capacity_ = bytes;
  }

  std::unique_ptr<std::byte[]> memory_;
  std::size_t capacity_ = 0;
  std::size_t used_ = 0;
  std::size_t slice_begin_ = 0;  ///< where in memory_ the open slice begins
  std::size_t referenced_ = 0;   ///< bytes in slices that are not in memory_
  std::size_t reference_from_ = 0;
  std::vector<ByteView> slices_;
};

}  // namespace trestle::messages
