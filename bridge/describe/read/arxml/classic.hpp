#pragma once
#include <chrono>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <utility>

#include "bridge/describe/read/arxml/adaptive.hpp"

namespace trestle::describe::arxml {

/// System descriptions of the Classic Platform: sockets, service instances, PDUs and what they carry.
/// Messages are found by their HEADER-IDs, which are whole Message IDs.
class Classic {
 public:
  Classic(const Tree& tree, Problems& problems, Copies& copies, Types& types, Contexts& contexts,
          Model& model)
      : tree_{tree},
        problems_{problems},
        copies_{copies},
        types_{types},
        contexts_{contexts},
        model_{model} {}

  void read();

 private:
  /// A port of a host.
  struct Socket {
    std::optional<IpAddress> address{};
    std::optional<std::uint16_t> udp{};
    std::optional<std::uint16_t> tcp{};
    std::string machine{};
    [[nodiscard]] Transport transport() const noexcept {
      return tcp && !udp ? Transport::tcp : Transport::udp;
    }
  };
  /// A PDU with its HEADER-ID.
  struct Message {
    std::uint32_t id = 0;
    const Node* pdu = nullptr;               ///< I-PDU, or nothing
    const Node* triggering = nullptr;        ///< PDU-TRIGGERING
    const Node* identifier = nullptr;        ///< what has the HEADER-ID
    std::optional<Transport> transport{};    ///< nothing: nobody says
    std::chrono::microseconds retention{0};  ///< how long it may be collected with others
    std::vector<someip::EventgroupId> groups{};
    std::set<someip::InstanceId> instances{};  ///< whose it is; empty: nobody says
  };
  /// What is said of the protection of a method: of its requests, or of its answers.
  struct SaidOfCalls {
    bool of_answers = false;
    std::vector<SaidProtection> said{};
  };

  void read_machines();
  void read_instances(Tag tag, Instance::Role role);
  void read_eventgroups();
  void read_segmentation();
  void read_signal_mappings();
  void read_messages();
  /// @param ends  the sockets that it goes through.
  void read_identifier(const Node& identifier, std::optional<Transport> transport,
                       const std::vector<const Node*>& ends = {});
  void note_instance(const Node* at, const Node* instance);
  void join_protections();
  [[nodiscard]] std::chrono::microseconds retention_of(const Node& identifier);
  void make_message(const Message& message);
  void make_event(Service& here, const Message& message, const Node* signal, const Node* prototype);
  void make_method(Service& here, const Message& message, const Node* signal, const Node* mapping,
                   const Node* trigger, bool is_answer, bool fire_and_forget);
  void add_transfer(const Message& message, Transfer& transfer) const;
  void add_protection(const Message& message, const Node* signal, std::vector<SaidProtection>& said);
  /// Of a PDU with one signal, as SOME/IP transformation makes them.
  [[nodiscard]] const Node* signal_of(const Message& message);
  [[nodiscard]] std::optional<std::chrono::microseconds> cycle_of(const Message& message);
  [[nodiscard]] const Node* rules_node(const Node* signal) const;
  [[nodiscard]] const Node* description(const Node* signal, const Node* properties, Tag tag) const;
  [[nodiscard]] Context context_of(const Node* signal);
  [[nodiscard]] Socket socket(const Node* endpoint);
  [[nodiscard]] const Node* pdu_of(const Node* triggering) const;
  [[nodiscard]] std::optional<someip::EventgroupId> eventgroup_id(const Node& handler);
  [[nodiscard]] Service& service(someip::ServiceId id, std::string_view name, Place place, Place id_place);
  void merge(Instance instance);

  const Tree& tree_;
  Problems& problems_;
  Copies& copies_;
  Types& types_;
  Contexts& contexts_;
  Model& model_;
  std::map<someip::ServiceId, std::size_t> services_{};
  std::map<someip::ServiceId, std::string> described_{};  ///< by Adaptive elements: full name of the first
  std::set<std::string, std::less<>> plain_names_{};      ///< of services without a scope
  using InstanceKey = std::tuple<Instance::Role, std::optional<someip::ServiceId>,
                                 std::optional<someip::InstanceId>, std::string, std::optional<IpAddress>>;
  std::map<InstanceKey, std::size_t> instances_{};
  std::map<std::pair<someip::ServiceId, someip::MethodId>, std::size_t> events_{};  ///< of a service
  std::map<std::pair<someip::ServiceId, someip::MethodId>, std::size_t> methods_{};
  std::set<std::pair<someip::ServiceId, std::string>> event_names_{};
  std::map<const Node*, const Node*> call_mappings_{};    ///< by SYSTEM-SIGNAL of the request
  std::map<const Node*, const Node*> return_mappings_{};  ///< of the answer
  std::map<const Node*, const Node*> data_mappings_{};    ///< by SYSTEM-SIGNAL: the data element or trigger
  std::map<const Node*, Transfer> transfers_{};           ///< segmentation, by I-PDU
  std::set<const Node*> without_signal_{};       ///< PDUs of which it was told that they have several
  std::map<const Node*, const Node*> wholes_{};  ///< what is segmented, by the segments' PDU
  std::map<const Node*, std::vector<someip::EventgroupId>> group_ids_{};       ///< by SO-AD-ROUTING-GROUP
  std::map<const Node*, std::vector<someip::EventgroupId>> identifier_ids_{};  ///< by SO-CON-I-PDU-IDENTIFIER
  /// Of a service, by what messages refer to: SO-AD-ROUTING-GROUP, SO-CON-I-PDU-IDENTIFIER and
  /// APPLICATION-ENDPOINT.
  std::map<std::pair<const Node*, someip::ServiceId>, std::set<someip::InstanceId>> instance_ids_{};
  std::map<std::pair<someip::ServiceId, someip::MethodId>, std::vector<SaidProtection>> said_of_events_{};
  std::map<std::pair<someip::ServiceId, someip::MethodId>, SaidOfCalls> said_of_methods_{};
  std::map<std::uint32_t, std::vector<Message>> messages_{};
  std::set<const Node*> used_operations_{};
};

}  // namespace trestle::describe::arxml
