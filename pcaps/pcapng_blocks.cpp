#include "pcaps/pcapng_blocks.hpp"

#include <span>

#include "someip/wire/bytes.hpp"

namespace trestle::pcaps {
namespace {

using Bytes = std::vector<std::byte>;

/// Options of all blocks.
constexpr std::uint16_t end_of_options = 0;
constexpr std::uint16_t opt_comment = 1;

template <typename T>
void put(Bytes& out, T number) {
  const std::size_t at = out.size();
  out.resize(at + sizeof(T));
  someip::store<T>(out.data() + at, number, std::endian::little);
}

/// Blocks and options are padded to whole words.
void put_padded(Bytes& out, ByteView bytes) {
  out.insert(out.end(), bytes.begin(), bytes.end());
  out.resize((out.size() + 3) / 4 * 4);
}

void put_option(Bytes& out, std::uint16_t code, ByteView value) {
  put(out, code);
  put(out, static_cast<std::uint16_t>(value.size()));
  put_padded(out, value);
}

void put_comment(Bytes& out, std::string_view comment) {
  if (!comment.empty()) {
    put_option(out, opt_comment, std::as_bytes(std::span{comment.substr(0, 60'000)}));
    put_option(out, end_of_options, {});
  }
}

/// A block has its length at both ends.
template <typename PutBody>
void put_block(Bytes& out, std::uint32_t type, const PutBody& put_body) {
  const std::size_t begin = out.size();
  put(out, type);
  put(out, std::uint32_t{0});
  put_body();
  const auto length = static_cast<std::uint32_t>(out.size() - begin + 4);
  someip::store(out.data() + begin + 4, length, std::endian::little);
  put(out, length);
}

/// The numbers that the format has for link layers, as libpcap calls them LINKTYPE_...
std::uint16_t number_of(LinkType link) {
  switch (link) {
    case LinkType::linux_sll:
      return 113;
    case LinkType::linux_sll2:
      return 276;
    case LinkType::raw_ip:
      return 101;
    case LinkType::null_loopback:
      return 0;
    case LinkType::wlan:
      return 105;
    case LinkType::ppi:
      return 192;
    case LinkType::ethernet:
    case LinkType::unsupported:
      break;
  }
  return 1;
}

}  // namespace

void put_pcapng_section(Bytes& out, std::string_view comment) {
  put_block(out, 0x0a0d'0d0a, [&] {
    put(out, std::uint32_t{0x1a2b'3c4d});  // by which readers know the byte order
    put(out, std::uint16_t{1});            // version 1.0
    put(out, std::uint16_t{0});
    put(out, ~std::uint64_t{0});  // the length of the section is not told
    put_comment(out, comment);
  });
}

void put_pcapng_interface(Bytes& out, LinkType link) {
  put_block(out, 1, [&] {
    put(out, number_of(link));
    put(out, std::uint16_t{0});
    put(out, std::uint32_t{0});  // frames are not cut
    constexpr std::byte nanoseconds{9};
    put_option(out, 9, {&nanoseconds, 1});  // if_tsresol
    put_option(out, end_of_options, {});
  });
}

void put_pcapng_packet(Bytes& out, Timestamp time, ByteView bytes, std::size_t wire_bytes,
                       std::string_view comment) {
  const auto since_1970 = static_cast<std::uint64_t>(time.time_since_epoch().count());
  put_block(out, 6, [&] {
    put(out, std::uint32_t{0});  // the interface
    put(out, static_cast<std::uint32_t>(since_1970 >> 32U));
    put(out, static_cast<std::uint32_t>(since_1970));
    put(out, static_cast<std::uint32_t>(bytes.size()));
    put(out, static_cast<std::uint32_t>(wire_bytes));
    put_padded(out, bytes);
    put_comment(out, comment);
  });
}

}  // namespace trestle::pcaps
