#include "sd/wire/writer.hpp"

#include <algorithm>
#include <cstring>

namespace trestle::sd {
using someip::ByteWriter;

namespace {

constexpr std::size_t entries_begin = someip::header_bytes + 8;
constexpr std::size_t max_run = 15;
constexpr std::size_t max_index = 255;

std::size_t bytes_of(std::span<const Option> run) noexcept {
  std::size_t sum = 0;
  for (const Option& option : run) {
    sum += option.size();
  }
  return sum;
}

bool length_fits(const Option& option) noexcept {
  return option.body.size() <= 0xffff;
}

OptionRun run_of(std::size_t index, std::size_t count) noexcept {
  return count == 0 ? OptionRun{}
                    : OptionRun{static_cast<std::uint8_t>(index), static_cast<std::uint8_t>(count)};
}

}  // namespace

// While the message grows, the options array stands right behind the entries and moves by 16 bytes with each
// new entry. A datagram is small, so this is cheap and needs no second buffer.
SdWriter::SdWriter(ByteSpan room) noexcept : room_{room} {
  assert(room.size() >= min_room_bytes);
}

std::size_t SdWriter::entries_end() const noexcept {
  return entries_begin + entry_count_ * entry_bytes;
}

ByteView SdWriter::options() const noexcept {
  return room_.subspan(entries_end() + 4, options_bytes_);
}

SdWriter::Place SdWriter::locate(std::span<const Option> run, bool may_continue_the_end) const noexcept {
  OptionCursor at{options(), 0};
  for (std::size_t start = 0; start < option_count_; ++start) {
    std::size_t same = 0;
    OptionCursor ahead = at;
    std::optional<Option> option = ahead.next();
    while (same < run.size() && option && *option == run[same]) {
      ++same;
      option = ahead.next();
    }
    // The whole run stands here, or its front is at the end of the array and the rest can be appended.
    if (same == run.size() || (may_continue_the_end && same > 0 && start + same == option_count_)) {
      return {start, same};
    }
    static_cast<void>(at.next());
  }
  return {option_count_, 0};
}

bool SdWriter::add(const Entry& entry, std::span<const Option> options) noexcept {
  if (options.size() > 2 * max_run || !std::ranges::all_of(options, length_fits)) {
    return false;
  }
  // Tries all ways to cut the options into two runs; the one that adds the fewest bytes wins, or one run.
  struct Choice {
    std::size_t cut = 0;
    Place first;
    Place second;
    std::size_t added_bytes = 0;
  };
  std::optional<Choice> best;
  for (std::size_t cut = std::min(options.size(), max_run); options.size() - cut <= max_run; --cut) {
    Choice choice;
    choice.cut = cut;
    choice.first = locate(options.first(cut), true);
    choice.second = locate(options.subspan(cut), choice.first.shared == cut);
    choice.added_bytes = bytes_of(options.subspan(choice.first.shared, cut - choice.first.shared)) +
                         bytes_of(options.subspan(cut + choice.second.shared));
    if (!best || choice.added_bytes < best->added_bytes) {
      best = choice;
    }
    if (cut == 0) {
      break;
    }
  }
  const std::size_t added_first = best->cut - best->first.shared;
  if (best->second.shared == 0) {
    best->second.index += added_first;  // both runs are appended: the second follows the first
  }
  const bool index_fits = best->first.index <= max_index && best->second.index <= max_index;
  if (!index_fits || !fits(1, best->added_bytes)) {
    return false;
  }
  std::byte* const array = room_.data() + entries_end() + 4;
  std::memmove(array + entry_bytes, array, options_bytes_);
  ++entry_count_;
  append(options.subspan(best->first.shared, added_first));
  append(options.subspan(best->cut + best->second.shared));
  Entry written = entry;
  written.first_run = run_of(best->first.index, best->cut);
  written.second_run = run_of(best->second.index, options.size() - best->cut);
  encode(written, room_.subspan(entries_end() - entry_bytes).first<entry_bytes>());
  return true;
}

bool SdWriter::add_unreferenced(const Option& option) noexcept {
  if (!length_fits(option) || !fits(0, option.size())) {
    return false;
  }
  append(std::span{&option, 1});
  return true;
}

void SdWriter::append(std::span<const Option> run) noexcept {
  ByteWriter out{room_.subspan(entries_end() + 4 + options_bytes_)};
  for (const Option& option : run) {
    out.u16(static_cast<std::uint16_t>(option.body.size()));
    out.u8(static_cast<std::uint8_t>(option.type));
    out.bytes(option.body);
  }
  assert(!out.failed());
  option_count_ += run.size();
  options_bytes_ += out.position();
}

ByteView SdWriter::finish(std::uint8_t flags, SessionId session, someip::ClientId client) noexcept {
  const std::size_t size = entries_end() + 4 + options_bytes_;
  const auto header = encode_header(sd_header(session, client), size - someip::header_bytes, room_);
  assert(header);
  static_cast<void>(header);
  ByteWriter out{room_.subspan(someip::header_bytes)};
  out.u32(std::uint32_t{flags} << 24U);
  out.u32(static_cast<std::uint32_t>(entry_count_ * entry_bytes));
  someip::store(room_.data() + entries_end(), static_cast<std::uint32_t>(options_bytes_));
  return room_.first(size);
}

}  // namespace trestle::sd
