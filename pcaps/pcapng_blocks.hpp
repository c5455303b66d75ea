#pragma once
#include <string_view>
#include <vector>

#include "pcaps/frame.hpp"

/// The blocks of a pcapng capture, each put behind what is there. Numbers are little endian, times are in
/// nanoseconds, and comments, which Wireshark shows, are cut at 60,000 bytes; an empty one is none.
namespace trestle::pcaps {

/// The first block.
void put_pcapng_section(std::vector<std::byte>& out, std::string_view comment = {});
/// The second one.
/// @param link  of all frames; not LinkType::unsupported.
void put_pcapng_interface(std::vector<std::byte>& out, LinkType link);
/// @param wire_bytes  what the frame had, of which `bytes` may be the beginning.
void put_pcapng_packet(std::vector<std::byte>& out, Timestamp time, ByteView bytes, std::size_t wire_bytes,
                       std::string_view comment = {});

}  // namespace trestle::pcaps
