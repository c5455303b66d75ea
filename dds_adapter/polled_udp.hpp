#pragma once
#include <memory>

#include "dds_adapter/fastdds_compat.hpp"
#include "dds_adapter/sample_sockets.hpp"

namespace trestle::dds::detail {

/// The same transport, but that these sockets receive what is for readers and writers. What is discovery's or
/// comes by multicast is still received by threads of DDS.
[[nodiscard]] std::shared_ptr<fast::TransportDescriptor> received_by(
    std::shared_ptr<SampleSockets> sockets, std::shared_ptr<fast::UdpV4Descriptor> udp);

/// Nothing, if it is not of UDP.
[[nodiscard]] const fast::UdpDescriptor* udp_of(const fast::TransportDescriptor& transport);
/// Whether received_by() made it.
[[nodiscard]] bool is_polled(const fast::TransportDescriptor& transport);

}  // namespace trestle::dds::detail
