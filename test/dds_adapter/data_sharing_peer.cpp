// A participant of Fast DDS whose writer shares its history with readers of other processes (data sharing),
// as it is by default where a type has a bound. It says its GUID, writes on and on, and ends with its input.
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>

#include <poll.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>

#include "dds_adapter/fastdds_compat.hpp"

namespace fast = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;

namespace {

/// An encapsulation header and four bytes.
class Bounded : public fast::TopicDataType {
 public:
  Bounded() {
    setName("Bounded");
    m_typeSize = 8;
    auto_fill_type_object(false);
    auto_fill_type_information(false);
  }
  bool is_bounded() const override { return true; }
  bool serialize(void*, rtps::SerializedPayload_t* payload) override {
    constexpr unsigned char bytes[] = {0, 1, 0, 0, 'd', 'a', 't', 'a'};
    std::memcpy(payload->data, bytes, sizeof(bytes));
    payload->length = sizeof(bytes);
    payload->encapsulation = CDR_LE;
    return true;
  }
  bool deserialize(rtps::SerializedPayload_t*, void*) override { return false; }
  std::function<std::uint32_t()> getSerializedSizeProvider(void*) override {
    return [] { return 8U; };
  }
  void* createData() override { return nullptr; }
  void deleteData(void*) override {}
  bool getKey(void*, rtps::InstanceHandle_t*, bool) override { return false; }
};

}  // namespace

int main(int, char** argv) {
  trestle::dds::fast::link_type_object_guard();
  trestle::dds::fast::link_sanitizer_hints();
  fast::DomainParticipantQos qos;
  qos.transport().use_builtin_transports = false;
  const auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
  udp->interfaceWhiteList = {"127.0.0.1"};
  qos.transport().user_transports.push_back(udp);
  auto* factory = fast::DomainParticipantFactory::get_instance();
  auto* participant = factory->create_participant(static_cast<std::uint32_t>(std::atoi(argv[1])), qos);

  const fast::TypeSupport support{new Bounded};
  support.register_type(participant);
  auto* topic = participant->create_topic("rt/bounded", "Bounded", fast::TOPIC_QOS_DEFAULT);
  fast::DataWriterQos shared;
  shared.data_sharing().on(argv[2]);  // fails where it cannot be
  auto* writer = participant->create_publisher(fast::PUBLISHER_QOS_DEFAULT)->create_datawriter(topic, shared);
  if (writer == nullptr) {
    return 1;
  }
  pollfd input{STDIN_FILENO, POLLIN, 0};
  while (poll(&input, 1, 20) == 0) {
    int nothing = 0;
    writer->write(&nothing);
  }
  participant->delete_contained_entities();
  factory->delete_participant(participant);
  return 0;
}
