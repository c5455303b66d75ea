#pragma once
#include <pcap/pcap.h>

#include <stdexcept>
#include <string>

#include "pcaps/frame.hpp"

namespace trestle::pcaps {

/// What a number of libpcap (DLT_...) means.
[[nodiscard]] LinkType link_type(int data_link) noexcept;

/// What stands before the network layer of the frames that a handle gives.
/// @param name  of the capture, for the error.
/// @throws std::runtime_error when we cannot read such frames.
[[nodiscard]] LinkType link_type_of(pcap* handle, const std::string& name);

/// A frame as libpcap hands it out, with time stamps in nanoseconds.
[[nodiscard]] Frame to_frame(std::uint64_t number, LinkType link, const pcap_pkthdr& header,
                             const unsigned char* bytes) noexcept;

}  // namespace trestle::pcaps
