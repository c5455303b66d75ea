#pragma once
/// Private to dds_adapter/: the one place that knows which Fast DDS this is. 2.x and 3.x differ in header
/// names, namespaces, return values and the virtual functions of a type; the rest of the folder uses only
/// the names below, in namespace trestle::dds::fast.
#if __has_include(<fastdds/config.hpp>)
#define TRESTLE_FASTDDS_3 1
#include <fastdds/config.hpp>
#define TRESTLE_FASTDDS_VERSION \
  (FASTDDS_VERSION_MAJOR * 10000 + FASTDDS_VERSION_MINOR * 100 + FASTDDS_VERSION_MICRO)
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
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.hpp>
#include <fastdds/rtps/transport/shared_mem/SharedMemTransportDescriptor.hpp>
#else
#define TRESTLE_FASTDDS_3 0
#include <fastrtps/config.h>
#define TRESTLE_FASTDDS_VERSION \
  (FASTRTPS_VERSION_MAJOR * 10000 + FASTRTPS_VERSION_MINOR * 100 + FASTRTPS_VERSION_MICRO)
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastdds/rtps/transport/shared_mem/SharedMemTransportDescriptor.h>
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

#include <cstdint>
#include <functional>
#include <mutex>
#include <string>

namespace trestle::dds::fast {

using namespace eprosima::fastdds::dds;

#if TRESTLE_FASTDDS_3
namespace rtps = eprosima::fastdds::rtps;
using Code = ReturnCode_t;
inline bool is_ok(Code code) {
  return code == RETCODE_OK;
}
inline bool is_timeout(Code code) {
  return code == RETCODE_TIMEOUT;
}
inline bool is_out_of_resources(Code code) {
  return code == RETCODE_OUT_OF_RESOURCES;
}
using Duration = eprosima::fastdds::dds::Duration_t;
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
inline bool is_ok(const Code& code) {
  return code == Code::RETCODE_OK;
}
inline bool is_timeout(const Code& code) {
  return code == Code::RETCODE_TIMEOUT;
}
inline bool is_out_of_resources(const Code& code) {
  return code == Code::RETCODE_OUT_OF_RESOURCES;
}
using Duration = eprosima::fastrtps::Duration_t;
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

/// A volatile, reliable writer whose reader leaves while samples wait to be sent can stop for ever, and
/// discovery with it (Fast DDS pull request 5432; cured in 2.10.7, 2.14.5, 3.0.2 and 3.1.1).
constexpr bool leaving_reader_blocks(int version) {
  return version < 21007 || (version >= 21100 && version < 21405) || (version >= 30000 && version < 30002) ||
         version == 30100;
}
/// The same of the Fast DDS that this is compiled with.
inline constexpr bool leaving_reader_can_block = leaving_reader_blocks(TRESTLE_FASTDDS_VERSION);

using Guid = rtps::GUID_t;
using Payload = rtps::SerializedPayload_t;

inline Guid guid_of(const rtps::InstanceHandle_t& handle) {
  return rtps::iHandle2GUID(handle);
}
inline std::uint64_t number_of(const rtps::SequenceNumber_t& sequence) {
  return sequence.to64long();
}
/// Since 1970; 0 when the time is not known.
inline std::int64_t nanoseconds_of(const rtps::Time_t& time) {
  return time == rtps::c_RTPSTimeInvalid ? 0 : time.to_ns();
}

/// Sees whether the next write() of a reliable, keep-last writer overwrites a sample that a reliable reader
/// has not acknowledged. Since 2.10 the listener is told of that; before, write() succeeds and nobody says a
/// word, so the layer below is asked.
class UnacknowledgedProbe {
 public:
#if TRESTLE_FASTDDS_VERSION < 21000
  UnacknowledgedProbe(const DataWriter& writer, std::uint32_t depth)
      : writer_{static_cast<rtps::StatefulWriter*>(
            rtps::RTPSDomainImpl::find_local_writer(writer.guid()))},  // as all reliable ones are
        depth_{depth} {}

  [[nodiscard]] bool next_overwrites() const {
    const rtps::SequenceNumber_t oldest = writer_->get_seq_num_min();
    if (oldest == rtps::SequenceNumber_t::unknown() ||
        number_of(writer_->get_seq_num_max()) - number_of(oldest) + 1 < depth_) {
      return false;
    }
    // Not is_acked_by_all(): that asks those of best effort too, who never say what they have got.
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
  UnacknowledgedProbe(const DataWriter& /*writer*/, std::uint32_t /*depth*/) {}
  [[nodiscard]] bool next_overwrites() const {
    return false;
  }
#endif
};

/// A writer's callbacks, whichever Fast DDS this is.
class WriterListener : public DataWriterListener {
 protected:
  /// A sample was overwritten that some reader had not acknowledged.
  virtual void on_overwritten() = 0;

#if TRESTLE_FASTDDS_VERSION >= 21000
 private:
  void on_unacknowledged_sample_removed(DataWriter* /*writer*/,
                                        const rtps::InstanceHandle_t& /*instance*/) final {
    on_overwritten();
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

/// What is to be known of a discovered reader or writer.
struct FoundEndpoint {
  Guid guid;
  std::string topic;
  std::string type;
  bool writer = false;
  bool there = false;  ///< else it has left
};

/// What is to be known of a discovered participant.
struct FoundPeer {
  enum class Change : std::uint8_t { found, lost, other };
  Guid guid;
  std::string name;
  Change change = Change::other;
};

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
         status == Status::REMOVED_PARTICIPANT || status == Status::DROPPED_PARTICIPANT);
  }
  void on_data_reader_discovery(DomainParticipant*, rtps::ReaderDiscoveryStatus status,
                                const SubscriptionBuiltinTopicData& data, bool&) final {
    on_endpoint({data.guid, data.topic_name.to_string(), data.type_name.to_string(), false,
                 status != rtps::ReaderDiscoveryStatus::REMOVED_READER});
  }
  void on_data_writer_discovery(DomainParticipant*, rtps::WriterDiscoveryStatus status,
                                const PublicationBuiltinTopicData& data, bool&) final {
    on_endpoint({data.guid, data.topic_name.to_string(), data.type_name.to_string(), true,
                 status != rtps::WriterDiscoveryStatus::REMOVED_WRITER});
  }
#else
  void on_participant_discovery(DomainParticipant*, rtps::ParticipantDiscoveryInfo&& found) final {
    using Info = rtps::ParticipantDiscoveryInfo;
    peer(found.info.m_guid, found.info.m_participantName.to_string(),
         found.status == Info::DISCOVERED_PARTICIPANT,
         found.status == Info::REMOVED_PARTICIPANT || found.status == Info::DROPPED_PARTICIPANT);
  }
  void on_subscriber_discovery(DomainParticipant*, rtps::ReaderDiscoveryInfo&& found) final {
    on_endpoint({found.info.guid(), found.info.topicName().to_string(), found.info.typeName().to_string(),
                 false, found.status != rtps::ReaderDiscoveryInfo::REMOVED_READER});
  }
  void on_publisher_discovery(DomainParticipant*, rtps::WriterDiscoveryInfo&& found) final {
    on_endpoint({found.info.guid(), found.info.topicName().to_string(), found.info.typeName().to_string(),
                 true, found.status != rtps::WriterDiscoveryInfo::REMOVED_WRITER});
  }
#endif
  void peer(const Guid& guid, std::string name, bool found, bool lost) {
    using Change = FoundPeer::Change;
    on_peer({guid, std::move(name), found ? Change::found : lost ? Change::lost : Change::other});
  }
};

}  // namespace trestle::dds::fast
