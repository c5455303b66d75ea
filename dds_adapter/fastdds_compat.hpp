#pragma once
/// Private to dds_adapter/: the one place that knows which Fast DDS this is. 2.x and 3.x differ in header
/// names, namespaces, return values and the virtual functions of a type; the rest of the folder uses only
/// the names below, in namespace trestle::dds::fast.
#if __has_include(<fastdds/config.hpp>)
#define TRESTLE_FASTDDS_3 1
#include <fastdds/config.hpp>
#define TRESTLE_FASTDDS_VERSION \
  (FASTDDS_VERSION_MAJOR * 10000 + FASTDDS_VERSION_MINOR * 100 + FASTDDS_VERSION_MICRO)
#include <fastdds/rtps/common/WriteParams.hpp>
#include <fastdds/rtps/transport/ChainingTransport.hpp>
#include <fastdds/rtps/transport/ChainingTransportDescriptor.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.hpp>
#include <fastdds/rtps/transport/UDPv6TransportDescriptor.hpp>
#include <fastdds/rtps/transport/shared_mem/SharedMemTransportDescriptor.hpp>
#include <fastdds/utils/IPLocator.hpp>
#else
#define TRESTLE_FASTDDS_3 0
#include <fastrtps/config.h>
#define TRESTLE_FASTDDS_VERSION \
  (FASTRTPS_VERSION_MAJOR * 10000 + FASTRTPS_VERSION_MINOR * 100 + FASTRTPS_VERSION_MICRO)
#include <fastdds/rtps/attributes/ServerAttributes.h>
#include <fastdds/rtps/transport/ChainingTransport.h>
#include <fastdds/rtps/transport/ChainingTransportDescriptor.h>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastdds/rtps/transport/UDPv6TransportDescriptor.h>
#include <fastdds/rtps/transport/shared_mem/SharedMemTransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>
#if TRESTLE_FASTDDS_VERSION < 21000
#include <fastdds/rtps/writer/ReaderProxy.h>
#include <fastdds/rtps/writer/StatefulWriter.h>

// The library has this function but no header for it; see UnacknowledgedProbe.
namespace eprosima::fastrtps::rtps {
class RTPSDomainImpl {
 public:
  static RTPSWriter* find_local_writer(const GUID_t& writer);
};
}  // namespace eprosima::fastrtps::rtps
#endif
#endif
#include <fastdds/dds/core/LoanableSequence.hpp>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/DataWriterListener.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "dds_adapter/participant.hpp"

/// Whether match_guard.cpp knows the functions of this Fast DDS.
#define TRESTLE_REFUSES_READERS \
  (TRESTLE_FASTDDS_VERSION < 21000 || (TRESTLE_FASTDDS_VERSION >= 30000 && TRESTLE_FASTDDS_VERSION < 30200))

namespace trestle::dds::fast {

using namespace eprosima::fastdds::dds;

#if TRESTLE_FASTDDS_3
namespace rtps = eprosima::fastdds::rtps;
using Code = ReturnCode_t;
using Duration = eprosima::fastdds::dds::Duration_t;
inline constexpr auto dynamic_reserve = rtps::DYNAMIC_RESERVE_MEMORY_MODE;
inline constexpr auto dynamic_reusable = rtps::DYNAMIC_REUSABLE_MEMORY_MODE;
inline void set_heartbeat_period(DataWriterQos& qos, const Duration& period) {
  qos.reliable_writer_qos().times.heartbeat_period = period;
}
inline void set_nack_delay(DataWriterQos& qos, const Duration& delay) {
  qos.reliable_writer_qos().times.nack_response_delay = delay;
}
inline void set_heartbeat_delay(DataReaderQos& qos, const Duration& delay) {
  qos.reliable_reader_qos().times.heartbeat_response_delay = delay;
}
#else
namespace rtps = eprosima::fastrtps::rtps;
using Code = eprosima::fastrtps::types::ReturnCode_t;
using enum Code::ReturnCodeValue;
using Duration = eprosima::fastrtps::Duration_t;
inline constexpr auto dynamic_reserve = rtps::DYNAMIC_RESERVE_MEMORY_MODE;
inline constexpr auto dynamic_reusable = rtps::DYNAMIC_REUSABLE_MEMORY_MODE;
inline void set_heartbeat_period(DataWriterQos& qos, const Duration& period) {
  qos.reliable_writer_qos().times.heartbeatPeriod = period;
}
inline void set_nack_delay(DataWriterQos& qos, const Duration& delay) {
  qos.reliable_writer_qos().times.nackResponseDelay = delay;
}
inline void set_heartbeat_delay(DataReaderQos& qos, const Duration& delay) {
  qos.reliable_reader_qos().times.heartbeatResponseDelay = delay;
}
#endif

inline bool is_ok(const Code& code) {
  return code == RETCODE_OK;
}
inline bool is_timeout(const Code& code) {
  return code == RETCODE_TIMEOUT;
}
inline bool is_out_of_resources(const Code& code) {
  return code == RETCODE_OUT_OF_RESOURCES;
}

/// A volatile, reliable writer whose reader leaves while samples wait to be sent can stop for ever, and
/// discovery with it (Fast DDS pull request 5432; cured in 2.10.7, 2.14.5, 3.0.2 and 3.1.1).
constexpr bool leaving_reader_blocks(int version) {
  return version < 21007 || (version >= 21100 && version < 21405) || (version >= 30000 && version < 30002) ||
         version == 30100;
}
/// The same of the Fast DDS that this is compiled with.
inline constexpr bool leaving_reader_can_block = leaving_reader_blocks(TRESTLE_FASTDDS_VERSION);

/// A thread that receives by shared memory waits for a lock in it for at most a second, and ends the process
/// by an exception that nobody catches when it does not get it (cured in 2.10.2 and 2.11.2).
constexpr bool stalled_peer_aborts(int version) {
  return version < 21002 || (version >= 21100 && version < 21102);
}

/// Tells the sanitizers about Fast DDS. Does nothing; calling it makes the linker take sanitizers.cpp from
/// the static library.
void link_sanitizer_hints() noexcept;

/// Tells the thread sanitizer that a received sample is no longer read here: Fast DDS, which is not
/// instrumented, counts who has it and frees it in the thread that comes last. Does nothing without it.
void given_back(std::span<const std::byte> payload) noexcept;

/// Keeps peers from ending the process by describing their types; 3.x does not need it. Does nothing; calling
/// it makes the linker take type_object_guard.cpp from the static library.
#if TRESTLE_FASTDDS_3
inline void link_type_object_guard() noexcept {}
#else
void link_type_object_guard() noexcept;
#endif

/// Lets a participant that gave up another, which did not notice, find all of it again:
/// rediscovery_guard.cpp. Newer ones need it, too, but are not open to it. To be called likewise.
#if TRESTLE_FASTDDS_3
inline void link_rediscovery_guard() noexcept {}
#else
void link_rediscovery_guard() noexcept;
#endif

/// Keeps a reader that is deleted while it is matched from ending the process: listener_guard.cpp. To be
/// called likewise.
#if TRESTLE_FASTDDS_3
inline void link_listener_guard() noexcept {}
#else
void link_listener_guard() noexcept;
#endif

/// From now on no writer of this participant matches a reader whose user data tells another type hash than
/// the writer's: nothing is sent there. Readers match such writers all the same, and have to drop what comes:
/// a writer that keeps all would wait for one that does not acknowledge.
///
/// With Fast DDS before 2.10, 3.0 and 3.1; with others there is no way: that discovery can be told to ignore
/// an endpoint, as 3.x has it, means nothing there.
#if !TRESTLE_REFUSES_READERS
inline void refuse_readers_of_other_types(const rtps::GuidPrefix_t& /*participant*/) {}
inline void forget_refusals(const rtps::GuidPrefix_t& /*participant*/) noexcept {}
#else
void refuse_readers_of_other_types(const rtps::GuidPrefix_t& participant);
/// Of a participant that has gone.
void forget_refusals(const rtps::GuidPrefix_t& participant) noexcept;
#endif

using Locator = eprosima::fastdds::rtps::Locator;
using LocatorList = eprosima::fastdds::rtps::LocatorList;
using Transport = eprosima::fastdds::rtps::TransportInterface;
using TransportDescriptor = eprosima::fastdds::rtps::TransportDescriptorInterface;
using TransportReceiver = eprosima::fastdds::rtps::TransportReceiverInterface;
using ForwardingDescriptor = eprosima::fastdds::rtps::ChainingTransportDescriptor;
using UdpDescriptor = eprosima::fastdds::rtps::UDPTransportDescriptor;
using UdpV4Descriptor = eprosima::fastdds::rtps::UDPv4TransportDescriptor;

/// Does what another transport does. Channels and senders are that one's own: Fast DDS's base class would
/// wrap them, and open a new sender for each peer, as it does not know the wrapped ones again.
class ForwardingTransport : public eprosima::fastdds::rtps::ChainingTransport {
 public:
  using ChainingTransport::ChainingTransport;
  bool OpenInputChannel(const Locator& locator, TransportReceiver* receiver,
                        std::uint32_t max_bytes) override {
    return low_level_transport_->OpenInputChannel(locator, receiver, max_bytes);
  }
  bool OpenOutputChannel(eprosima::fastdds::rtps::SendResourceList& senders,
                         const Locator& locator) override {
    return low_level_transport_->OpenOutputChannel(senders, locator);
  }
  TransportDescriptor* get_configuration() override { return low_level_transport_->get_configuration(); }

 private:
  // Of what is wrapped: never called.
#if TRESTLE_FASTDDS_3
  bool send(rtps::SenderResource* sender, const std::vector<rtps::NetworkBuffer>& buffers,
            std::uint32_t bytes, rtps::LocatorsIterator* begin, rtps::LocatorsIterator* end,
            const std::chrono::steady_clock::time_point& until) override {
    return sender->send(buffers, bytes, begin, end, until);
  }
#else
  bool send(rtps::SenderResource* sender, const rtps::octet* data, std::uint32_t bytes,
            rtps::LocatorsIterator* begin, rtps::LocatorsIterator* end,
            const std::chrono::steady_clock::time_point& until) override {
    return sender->send(data, bytes, begin, end, until);
  }
#endif
  void receive(TransportReceiver* receiver, const rtps::octet* data, std::uint32_t bytes,
               const Locator& local, const Locator& remote) override {
    receiver->OnDataReceived(data, bytes, local, remote);
  }
};

using Guid = rtps::GUID_t;
using Prefix = decltype(Guid::guidPrefix);
using Payload = rtps::SerializedPayload_t;

inline Guid guid_of(const rtps::InstanceHandle_t& handle) {
  return rtps::iHandle2GUID(handle);
}
inline std::uint64_t number_of(const rtps::SequenceNumber_t& sequence) {
  return sequence.to64long();
}
/// Writes a sample that belongs to another one, whose writer or number may be unknown: its number, or 0 when
/// DDS refuses it, which it does not say why. On the wire the other one is the parameter 0x800f of
/// eProsima's; from 2.14 on the standard's 0x0083 goes with it. Earlier versions read only eProsima's.
inline std::uint64_t write_related(DataWriter& writer, void* sample, const Guid& related_writer,
                                   std::uint64_t related_sequence) {
  rtps::WriteParams params;
  params.related_sample_identity().writer_guid() = related_writer;
  if (related_sequence != 0) {
    params.related_sample_identity().sequence_number() = rtps::SequenceNumber_t{related_sequence};
  }
#if TRESTLE_FASTDDS_3
  const bool written = is_ok(writer.write(sample, params));
#else
  const bool written = writer.write(sample, params);
#endif
  return written ? number_of(params.sample_identity().sequence_number()) : 0;
}
/// Since 1970; 0 when the time is not known.
inline std::int64_t nanoseconds_of(const rtps::Time_t& time) {
  return time == rtps::c_RTPSTimeInvalid ? 0 : time.to_ns();
}

/// `qos`: of a participant, reader or writer.
template <typename EntityQos>
void set_user_data(EntityQos& qos, const std::string& text) {
  qos.user_data().data_vec({text.begin(), text.end()});
}

inline Duration duration_of(std::chrono::nanoseconds time) {
  constexpr std::int64_t second = 1'000'000'000;
  return {static_cast<std::int32_t>(time.count() / second),
          static_cast<std::uint32_t>(time.count() % second)};
}
/// 0: for ever, which is longer than any other time.
inline std::chrono::nanoseconds nanoseconds_of(const Duration& time) {
  return time.is_infinite() ? std::chrono::nanoseconds{0} : std::chrono::nanoseconds{time.to_ns()};
}

/// What readers and writers have in common. `qos`: of a new reader or writer.
template <typename EntityQos>
void set_common(EntityQos& qos, const Qos& wanted) {
  qos.reliability().kind = wanted.reliable ? RELIABLE_RELIABILITY_QOS : BEST_EFFORT_RELIABILITY_QOS;
  qos.durability().kind = wanted.transient_local ? TRANSIENT_LOCAL_DURABILITY_QOS : VOLATILE_DURABILITY_QOS;
  if (wanted.deadline.count() > 0) {
    qos.deadline().period = duration_of(wanted.deadline);
  }
  qos.liveliness().kind =
      wanted.manual_liveliness ? MANUAL_BY_TOPIC_LIVELINESS_QOS : AUTOMATIC_LIVELINESS_QOS;
  if (wanted.liveliness_lease.count() > 0) {
    qos.liveliness().lease_duration = duration_of(wanted.liveliness_lease);
    qos.liveliness().announcement_period = duration_of(wanted.liveliness_lease / 3);
  }
}

/// What must go together with the counterparts' of a discovered reader or writer.
inline Qos found_qos_of(ReliabilityQosPolicyKind reliability, DurabilityQosPolicyKind durability,
                        const Duration& deadline, const LivelinessQosPolicy& liveliness) {
  Qos result;
  result.reliable = reliability == RELIABLE_RELIABILITY_QOS;
  result.transient_local = durability != VOLATILE_DURABILITY_QOS;
  result.deadline = nanoseconds_of(deadline);
  result.manual_liveliness = liveliness.kind != AUTOMATIC_LIVELINESS_QOS;
  result.liveliness_lease = nanoseconds_of(liveliness.lease_duration);
  return result;
}
#if TRESTLE_FASTDDS_3
template <typename BuiltinData>
Qos found_qos(const BuiltinData& found) {
  return found_qos_of(found.reliability.kind, found.durability.kind, found.deadline.period, found.liveliness);
}
#else
template <typename FoundQos>
Qos found_qos(const FoundQos& found) {
  return found_qos_of(found.m_reliability.kind, found.m_durability.kind, found.m_deadline.period,
                      found.m_liveliness);
}
#endif

/// @throws DdsError  when nobody knows a host of that name.
inline rtps::Locator_t locator_of(const DiscoveryServer& server) {
  std::string address = server.address;
  if (!rtps::IPLocator::isIPv4(address) && !rtps::IPLocator::isIPv6(address)) {
    const auto [v4, v6] = rtps::IPLocator::resolveNameDNS(address);
    if (v4.empty() && v6.empty()) {
      throw DdsError{"the discovery server " + address + " is not known: no host has this name"};
    }
    address = v4.empty() ? *v6.begin() : *v4.begin();
  }
  rtps::Locator_t locator;
  if (rtps::IPLocator::isIPv4(address)) {
    rtps::IPLocator::setIPv4(locator, address);
  } else {
    locator.kind = LOCATOR_KIND_UDPv6;
    rtps::IPLocator::setIPv6(locator, address);
  }
  rtps::IPLocator::setPhysicalPort(locator, server.port);
  return locator;
}

/// Finds others by these servers. A server's number, which stands for its GUID before 3.x, is its place in
/// the list. Mere clients are told only of the topics that they have endpoints of.
inline void use_discovery_servers(const std::vector<DiscoveryServer>& servers, DomainParticipantQos& qos) {
  auto& discovery = qos.wire_protocol().builtin.discovery_config;
#if TRESTLE_FASTDDS_3
  discovery.discoveryProtocol = rtps::DiscoveryProtocol::SUPER_CLIENT;
#else
  discovery.discoveryProtocol = rtps::DiscoveryProtocol_t::SUPER_CLIENT;
#endif
  bool has_v6 = false;
  for (std::size_t number = 0; number < servers.size(); ++number) {
    if (servers[number].address.empty()) {
      continue;
    }
    const rtps::Locator_t locator = locator_of(servers[number]);
    if (locator.kind == LOCATOR_KIND_UDPv6 && !std::exchange(has_v6, true)) {
      qos.transport().user_transports.push_back(
          std::make_shared<eprosima::fastdds::rtps::UDPv6TransportDescriptor>());
    }
#if TRESTLE_FASTDDS_3
    discovery.m_DiscoveryServers.push_back(locator);
#else
    rtps::RemoteServerAttributes remote;
    rtps::get_server_client_default_guidPrefix(static_cast<int>(number), remote.guidPrefix);
    remote.metatrafficUnicastLocatorList.push_back(locator);
    discovery.m_DiscoveryServers.push_back(remote);
#endif
  }
}

/// From now on each reader is sent a copy that names it. One copy for several readers names none, and a
/// reader that is refused (match_guard.cpp) would accept it if it shares a participant with one of them. With
/// 3.x, all writers of a participant that may refuse readers do so from the beginning (match_guard.cpp); in
/// between there is no way.
inline void send_to_each_reader_alone([[maybe_unused]] const DataWriter& writer) {
#if TRESTLE_FASTDDS_VERSION < 21000
  rtps::RTPSWriter* const inner = rtps::RTPSDomainImpl::find_local_writer(writer.guid());
  const std::lock_guard lock{inner->getMutex()};
  inner->set_separate_sending(true);
#endif
}

/// What the readers of a reliable writer have not acknowledged.
class UnacknowledgedProbe {
 public:
#if TRESTLE_FASTDDS_VERSION < 21000
  UnacknowledgedProbe(DataWriter& writer, std::uint32_t depth)
      : writer_{static_cast<rtps::StatefulWriter*>(
            rtps::RTPSDomainImpl::find_local_writer(writer.guid()))},  // as all reliable ones are
        depth_{depth} {}

  /// Whether no reader lacks anything. Fast DDS's own function for that waits, which takes a change of
  /// threads also when it is told to wait for no time at all; so the layer below is asked.
  [[nodiscard]] bool none() const {
    bool lacking = false;
    const std::lock_guard lock{writer_->getMutex()};
    writer_->for_each_reader_proxy(
        [&](const rtps::ReaderProxy* reader) { lacking = lacking || reader->has_changes(); });
    return !lacking;
  }

  /// Whether the next write() of a keep-last writer overwrites a sample that a reliable reader has not
  /// acknowledged. Since 2.10 the listener is told of that; before, write() succeeds and nobody says a word.
  [[nodiscard]] bool next_overwrites() const {
    const rtps::SequenceNumber_t oldest = writer_->get_seq_num_min();
    if (oldest == rtps::SequenceNumber_t::unknown() ||
        number_of(writer_->get_seq_num_max()) - number_of(oldest) + 1 < depth_) {
      return false;
    }
    // Not is_acked_by_all(): that also asks best effort readers, which never acknowledge anything.
    bool lacking = false;
    const std::lock_guard lock{writer_->getMutex()};
    writer_->for_each_reader_proxy([&](const rtps::ReaderProxy* reader) {
      lacking = lacking || (reader->is_reliable() && !reader->change_is_acked(oldest));
    });
    return lacking;
  }

 private:
  rtps::StatefulWriter* writer_;
  std::uint64_t depth_;
#else
  UnacknowledgedProbe(DataWriter& writer, std::uint32_t /*depth*/) : writer_{writer} {}
  [[nodiscard]] bool none() const {
    return is_ok(writer_.wait_for_acknowledgments(Duration{0, 0}));
  }
  [[nodiscard]] bool next_overwrites() const {
    return false;
  }

 private:
  DataWriter& writer_;
#endif
};

/// How far a reader has come, as its writer sees it.
struct ReaderProgress {
  bool is_there = false;
  bool acknowledges_nothing = false;
  std::uint64_t acknowledged = 0;  ///< everything up to this number
};

/// Keeps from all readers what a reliable writer writes as belonging to one of its own samples, and sees what
/// they acknowledge, those too. Only before 2.10 is there a way to do so.
#if TRESTLE_FASTDDS_VERSION < 21000
class HiddenSamples final : private eprosima::fastdds::rtps::IReaderDataFilter {
 public:
  static constexpr bool are_possible = true;
  /// @param writer  is deleted before this.
  explicit HiddenSamples(const DataWriter& writer)
      : writer_{static_cast<rtps::StatefulWriter*>(
            rtps::RTPSDomainImpl::find_local_writer(writer.guid()))} {  // as all reliable ones are
    const std::lock_guard lock{writer_->getMutex()};
    others_ = writer_->reader_data_filter();
    writer_->reader_data_filter(this);
  }
  HiddenSamples(const HiddenSamples&) = delete;
  HiddenSamples& operator=(const HiddenSamples&) = delete;

  [[nodiscard]] ReaderProgress progress_of(const Guid& reader) const {
    ReaderProgress progress;
    const std::lock_guard lock{writer_->getMutex()};
    writer_->for_each_reader_proxy([&](const rtps::ReaderProxy* proxy) {
      if (proxy->guid() == reader) {
        progress = {true, !proxy->is_reliable() || proxy->disable_positive_acks(),
                    number_of(proxy->changes_low_mark())};
      }
    });
    return progress;
  }

  /// Has all readers tell what they have acknowledged. Fast DDS itself asks no more when the newest sample is
  /// a hidden one, which it tells of in a GAP: a reader that learns of the sample from that one has no reason
  /// to answer.
  void ask_readers() { writer_->send_periodic_heartbeat(/*final=*/false, /*liveliness=*/true); }

 private:
  [[nodiscard]] bool is_relevant(const rtps::CacheChange_t& change, const Guid& reader) const override {
    return change.write_params.related_sample_identity().writer_guid() != change.writerGUID &&
           (others_ == nullptr || others_->is_relevant(change, reader));
  }

  rtps::StatefulWriter* const writer_;
  const eprosima::fastdds::rtps::IReaderDataFilter* others_ = nullptr;
};
#else
class HiddenSamples {
 public:
  static constexpr bool are_possible = false;
  explicit HiddenSamples(const DataWriter& /*writer*/) {}
  [[nodiscard]] static ReaderProgress progress_of(const Guid& /*reader*/) { return {}; }
  static void ask_readers() {}
};
#endif

/// A writer's callbacks, whichever Fast DDS this is.
class WriterListener : public DataWriterListener {
 protected:
  /// A sample was overwritten that some reliable reader had not acknowledged.
  virtual void on_overwritten() = 0;
  /// Whether some reliable reader gets what is written.
  [[nodiscard]] virtual bool has_reliable_reader() const = 0;

#if TRESTLE_FASTDDS_VERSION >= 21000
 private:
  void on_unacknowledged_sample_removed(DataWriter* /*writer*/,
                                        const rtps::InstanceHandle_t& /*instance*/) final {
    if (has_reliable_reader()) {  // else it was not sent yet to those who say nothing
      on_overwritten();
    }
  }
#endif
};

/// A keyless, unbounded type without a type description, whichever Fast DDS this is.
class AnyType : public TopicDataType {
 public:
  explicit AnyType(const std::string& name) {
    // Only a starting size: all payloads are of dynamic size. 0 would make Fast DDS refuse the type.
    constexpr std::uint32_t starting_size = 4;
#if TRESTLE_FASTDDS_3
    set_name(name);
    max_serialized_type_size = starting_size;
    is_compute_key_provided = false;
#else
    setName(name.c_str());
    m_typeSize = starting_size;
    m_isGetKeyDefined = false;
    auto_fill_type_object(false);
    auto_fill_type_information(false);
#endif
  }

 protected:
  virtual std::uint32_t encoded_size(const void* sample) = 0;
  /// Fills `payload.data`, which has room for encoded_size(), and sets its length and encapsulation.
  virtual bool encode(const void* sample, Payload& payload) = 0;
  virtual bool decode(Payload& payload, void* sample) = 0;
  virtual void* make() = 0;
  virtual void destroy(void* sample) = 0;

 private:
#if TRESTLE_FASTDDS_3
  bool serialize(const void* const data, Payload& payload, DataRepresentationId_t) final {
    return encode(data, payload);
  }
  bool deserialize(Payload& payload, void* data) final {
    return decode(payload, data);
  }
  std::uint32_t calculate_serialized_size(const void* const data, DataRepresentationId_t) final {
    return encoded_size(data);
  }
  void* create_data() final {
    return make();
  }
  void delete_data(void* data) final {
    destroy(data);
  }
  bool compute_key(Payload&, rtps::InstanceHandle_t&, bool) final {
    return false;
  }
  bool compute_key(const void* const, rtps::InstanceHandle_t&, bool) final {
    return false;
  }
#else
  bool serialize(void* data, Payload* payload) final {
    return encode(data, *payload);
  }
  bool deserialize(Payload* payload, void* data) final {
    return decode(*payload, data);
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) final {
    return [this, data] { return encoded_size(data); };
  }
  void* createData() final {
    return make();
  }
  void deleteData(void* data) final {
    destroy(data);
  }
  bool getKey(void*, rtps::InstanceHandle_t*, bool) final {
    return false;
  }
#endif
};

template <typename Policy>
std::string user_data_text(const Policy& policy) {
  const auto& octets = policy.data_vec();
  return {octets.begin(), octets.end()};
}

struct FoundEndpoint {
  Guid guid;
  std::string topic;
  std::string type;
  bool writer = false;
  bool there = false;  ///< else it has left
  Qos qos;             ///< what must go together with that of its counterparts
  std::string user_data;
};

struct FoundPeer {
  enum class Change : std::uint8_t { found, lost, other };
  Guid guid;
  std::string name;
  Change change = Change::other;
  std::array<std::uint8_t, 2> vendor{};
  /// Where it says that it is reached, each once, without ports. Of this host Fast DDS makes 127.0.0.1.
  std::vector<std::string> addresses{};
};

/// Of `Data`, what discovery tells of a participant.
template <typename Data>
std::vector<std::string> addresses_of(const Data& data) {
  std::vector<std::string> result;
  for (const auto* locators : {&data.default_locators, &data.metatraffic_locators}) {
    for (const auto& locator : locators->unicast) {
      const bool v6 = locator.kind == LOCATOR_KIND_UDPv6 || locator.kind == LOCATOR_KIND_TCPv6;
      if (!v6 && locator.kind != LOCATOR_KIND_UDPv4 && locator.kind != LOCATOR_KIND_TCPv4) {
        continue;
      }
      std::string one = v6 ? rtps::IPLocator::toIPv6string(locator) : rtps::IPLocator::toIPv4string(locator);
      if (std::find(result.begin(), result.end(), one) == result.end()) {
        result.push_back(std::move(one));
      }
    }
  }
  return result;
}

/// Discovery callbacks, whichever Fast DDS this is.
class DiscoveryListener : public DomainParticipantListener {
 protected:
  virtual void on_peer(const FoundPeer& peer) = 0;
  virtual void on_endpoint(const FoundEndpoint& endpoint) = 0;

 private:
#if TRESTLE_FASTDDS_3
  void on_participant_discovery(DomainParticipant*, rtps::ParticipantDiscoveryStatus status,
                                const ParticipantBuiltinTopicData& data, bool&) final {
    using Status = rtps::ParticipantDiscoveryStatus;
    peer(data.guid, data.participant_name.to_string(), status == Status::DISCOVERED_PARTICIPANT,
         status == Status::REMOVED_PARTICIPANT || status == Status::DROPPED_PARTICIPANT, data.vendor_id,
         addresses_of(data));
  }
  void on_data_reader_discovery(DomainParticipant*, rtps::ReaderDiscoveryStatus status,
                                const SubscriptionBuiltinTopicData& data, bool&) final {
    on_endpoint({data.guid, data.topic_name.to_string(), data.type_name.to_string(), false,
                 status != rtps::ReaderDiscoveryStatus::REMOVED_READER, found_qos(data),
                 user_data_text(data.user_data)});
  }
  void on_data_writer_discovery(DomainParticipant*, rtps::WriterDiscoveryStatus status,
                                const PublicationBuiltinTopicData& data, bool&) final {
    on_endpoint({data.guid, data.topic_name.to_string(), data.type_name.to_string(), true,
                 status != rtps::WriterDiscoveryStatus::REMOVED_WRITER, found_qos(data),
                 user_data_text(data.user_data)});
  }
#else
  void on_participant_discovery(DomainParticipant*, rtps::ParticipantDiscoveryInfo&& found) final {
    using Info = rtps::ParticipantDiscoveryInfo;
    peer(found.info.m_guid, found.info.m_participantName.to_string(),
         found.status == Info::DISCOVERED_PARTICIPANT,
         found.status == Info::REMOVED_PARTICIPANT || found.status == Info::DROPPED_PARTICIPANT,
         found.info.m_VendorId, addresses_of(found.info));
  }
  void on_subscriber_discovery(DomainParticipant*, rtps::ReaderDiscoveryInfo&& found) final {
    on_endpoint({found.info.guid(), found.info.topicName().to_string(), found.info.typeName().to_string(),
                 false, found.status != rtps::ReaderDiscoveryInfo::REMOVED_READER,
                 found_qos(found.info.m_qos), user_data_text(found.info.m_qos.m_userData)});
  }
  void on_publisher_discovery(DomainParticipant*, rtps::WriterDiscoveryInfo&& found) final {
    on_endpoint({found.info.guid(), found.info.topicName().to_string(), found.info.typeName().to_string(),
                 true, found.status != rtps::WriterDiscoveryInfo::REMOVED_WRITER, found_qos(found.info.m_qos),
                 user_data_text(found.info.m_qos.m_userData)});
  }
#endif
  void peer(const Guid& guid, std::string name, bool found, bool lost,
            const std::array<std::uint8_t, 2>& vendor, std::vector<std::string> addresses) {
    using Change = FoundPeer::Change;
    on_peer({guid, std::move(name),
             found  ? Change::found
             : lost ? Change::lost
                    : Change::other,
             vendor, std::move(addresses)});
  }
};

}  // namespace trestle::dds::fast
