// A participant of Fast DDS that announces a type together with its description: a structure that holds a
// sequence of structures. It writes a line when its writer is there, and stays until its input ends.
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/types/TypeObject.h>
#include <fastrtps/types/TypeObjectFactory.h>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>

#include <cstdio>
#include <cstdlib>
#include <memory>

#include "dds_adapter/fastdds_compat.hpp"

namespace fast = eprosima::fastdds::dds;
namespace types = eprosima::fastrtps::types;
namespace rtps = eprosima::fastrtps::rtps;

namespace {

/// A description of a structure with one member, as generated code makes it. The hash in its identifier may
/// be anything here.
types::TypeObject* describe(const char* name, const char* member_name,
                            const types::TypeIdentifier& member_type, std::uint8_t hash,
                            types::TypeIdentifier& identifier) {
  auto* object = new types::TypeObject;
  object->_d(types::EK_COMPLETE);
  object->complete()._d(types::TK_STRUCTURE);
  auto& structure = object->complete().struct_type();
  structure.header().detail().type_name(name);
  types::CompleteStructMember member;
  member.common().member_id(0);
  member.common().member_type_id(member_type);
  member.detail().name(member_name);
  structure.member_seq().push_back(member);
  identifier._d(types::EK_COMPLETE);
  identifier.equivalence_hash()[0] = hash;
  types::TypeObjectFactory::get_instance()->add_type_object(name, &identifier, object);
  return object;
}

/// A type that is never written.
class Described : public fast::TopicDataType {
 public:
  Described() {
    setName("Outer");
    m_typeSize = 4;
    auto* factory = types::TypeObjectFactory::get_instance();
    types::TypeIdentifier inner;
    types::TypeIdentifier outer;
    describe("Inner", "number", *factory->get_type_identifier("uint32_t", false), 1, inner);
    const auto* inners = factory->get_sequence_identifier("Inner", 10, true);
    type_object(*describe("Outer", "inners", *inners, 2, outer));
    type_identifier(outer);
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

}  // namespace

int main(int, char** argv) {
  trestle::dds::fast::link_type_object_guard();  // or it would be its own victim
  fast::DomainParticipantQos qos;
  qos.transport().use_builtin_transports = false;
  const auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
  udp->interfaceWhiteList = {"127.0.0.1"};
  qos.transport().user_transports.push_back(udp);
  auto* participant = fast::DomainParticipantFactory::get_instance()->create_participant(
      static_cast<std::uint32_t>(std::atoi(argv[1])), qos);

  const fast::TypeSupport support{new Described};
  support.register_type(participant);
  auto* topic = participant->create_topic("rt/outers", "Outer", fast::TOPIC_QOS_DEFAULT);
  auto* writer = participant->create_publisher(fast::PUBLISHER_QOS_DEFAULT)
                     ->create_datawriter(topic, fast::DATAWRITER_QOS_DEFAULT);
  std::puts(writer != nullptr ? "ready" : "failed");
  std::fflush(stdout);
  while (std::getchar() != EOF) {
  }
  return 0;
}
