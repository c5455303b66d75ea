#include "sd/core/configuration.hpp"

#include <algorithm>
#include <cassert>

namespace trestle::sd {

std::string_view otherserv_of(ByteView configuration) noexcept {
  std::string_view name;
  std::size_t count = 0;
  ConfigurationCursor cursor{{OptionType::configuration, configuration}};
  while (const auto item = cursor.next()) {
    if (item->key == otherserv) {
      name = item->value.value_or(std::string_view{});
      ++count;
    }
  }
  return count == 1 ? name : std::string_view{};
}

MergedConfiguration merge_configurations(const SdMessage& message, const Entry& entry,
                                         ByteSpan room) noexcept {
  MergedConfiguration merged;
  someip::ByteWriter out{room};
  for (std::size_t position = 0; position < entry.option_count(); ++position) {
    const auto option = message.option_of(entry, position);
    if (!option || option->type != OptionType::configuration) {
      continue;
    }
    if (out.position() == 0) {
      if (room.size() < 2) {
        return {{}, false};
      }
      out.u8(0);  // the reserved byte
    }
    ConfigurationCursor cursor{*option};
    std::size_t begin = cursor.offset();
    while (cursor.next()) {
      const ByteView item = option->body.subspan(begin, cursor.offset() - begin);
      begin = cursor.offset();
      if (out.position() + item.size() < room.size()) {  // and the end mark
        out.bytes(item);
      } else {
        merged.whole = false;
      }
    }
  }
  if (out.position() > 0) {
    out.u8(0);  // the end mark
  }
  merged.body = out.written();
  return merged;
}

ByteSpan ConfigurationPool::block(std::size_t index) const noexcept {
  return bytes_.subspan(index * block_bytes_).first(block_bytes_);
}

ByteView ConfigurationPool::operator[](std::uint16_t index) const noexcept {
  if (index == unkept) {
    return unkept_;
  }
  return index == none ? ByteView{} : ByteView{block(index).first(blocks_[index].bytes)};
}

std::optional<std::uint16_t> ConfigurationPool::find(ByteView body) const noexcept {
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    if (std::ranges::equal(block(i).first(blocks_[i].bytes), body)) {
      return static_cast<std::uint16_t>(i);
    }
  }
  return std::nullopt;
}

std::optional<std::uint16_t> ConfigurationPool::store(ByteView body) noexcept {
  const auto free = std::ranges::find(blocks_, false, &slots::ConfigurationBlock::referenced);
  if (free == blocks_.end()) {
    return std::nullopt;
  }
  const auto index = static_cast<std::size_t>(free - blocks_.begin());
  std::ranges::copy(body, block(index).begin());
  free->bytes = static_cast<std::uint16_t>(body.size());
  return static_cast<std::uint16_t>(index);
}

}  // namespace trestle::sd
