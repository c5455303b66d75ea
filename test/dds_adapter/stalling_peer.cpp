// A participant of Fast DDS as it is, without Trestle's guards, for a test that stops it or itself:
//
//     stalling_peer DOMAIN LEASE_MS
//
// has the writer "rt/theirs", and others that come and go every 20 ms, so that discovery always has something
// to say. It writes its process id, then "+" and "-" when a writer of "rt/ours" comes and goes, each in a
// line of its own, and stays until its input ends.
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <poll.h>
#include <unistd.h>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>

#include <cstdio>
#include <cstdlib>
#include <memory>

namespace fast = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;

namespace {

/// Of which nothing is ever written.
class Type : public fast::TopicDataType {
 public:
  Type() {
    setName("Type");
    m_typeSize = 4;
  }
  bool serialize(void*, rtps::SerializedPayload_t*) override { return false; }
  bool deserialize(rtps::SerializedPayload_t*, void*) override { return false; }
  std::function<std::uint32_t()> getSerializedSizeProvider(void*) override {
    return [] { return 4U; };
  }
  void* createData() override { return nullptr; }
  void deleteData(void*) override {}
  bool getKey(void*, rtps::InstanceHandle_t*, bool) override { return false; }
};

class Watcher : public fast::DomainParticipantListener {
 public:
  void on_publisher_discovery(fast::DomainParticipant*, rtps::WriterDiscoveryInfo&& info) override {
    using Info = rtps::WriterDiscoveryInfo;
    if (info.info.topicName() == "rt/ours" && info.status != Info::CHANGED_QOS_WRITER) {
      std::puts(info.status == Info::DISCOVERED_WRITER ? "+" : "-");
    }
  }
};

}  // namespace

int main(int, char** argv) {
  std::setvbuf(stdout, nullptr, _IOLBF, BUFSIZ);
  std::printf("%d\n", getpid());
  fast::DomainParticipantQos qos;
  qos.transport().use_builtin_transports = false;
  const auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
  udp->interfaceWhiteList = {"127.0.0.1"};
  qos.transport().user_transports.push_back(udp);
  const double lease_s = std::atof(argv[2]) / 1000;
  auto& discovery = qos.wire_protocol().builtin.discovery_config;
  discovery.leaseDuration = eprosima::fastrtps::Duration_t{lease_s};
  discovery.leaseDuration_announcementperiod = eprosima::fastrtps::Duration_t{lease_s / 4};
  Watcher watcher;
  auto* participant = fast::DomainParticipantFactory::get_instance()->create_participant(
      static_cast<std::uint32_t>(std::atoi(argv[1])), qos, &watcher, fast::StatusMask::none());
  const fast::TypeSupport support{new Type};
  support.register_type(participant);
  auto* publisher = participant->create_publisher(fast::PUBLISHER_QOS_DEFAULT);
  auto* topic = participant->create_topic("rt/theirs", "Type", fast::TOPIC_QOS_DEFAULT);
  publisher->create_datawriter(topic, fast::DATAWRITER_QOS_DEFAULT);
  auto* busy_topic = participant->create_topic("rt/busy", "Type", fast::TOPIC_QOS_DEFAULT);
  pollfd input{STDIN_FILENO, POLLIN, 0};
  while (true) {
    auto* busy = publisher->create_datawriter(busy_topic, fast::DATAWRITER_QOS_DEFAULT);
    if (poll(&input, 1, 20) > 0) {
      std::_Exit(0);
    }
    publisher->delete_datawriter(busy);
  }
}
