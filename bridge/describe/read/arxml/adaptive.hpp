#pragma once
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "bridge/describe/read/arxml/types.hpp"

namespace trestle::describe::arxml {

/// What one place says of the protection of an element.
struct SaidProtection {
  Protection e2e{};
  const Node* node = nullptr;
  std::set<someip::InstanceId> instances{};  ///< of which; empty: that is not known
};

/// Service interfaces, SOME/IP deployments, instances and machines of the Adaptive Platform.
class Adaptive {
 public:
  Adaptive(const Tree& tree, Problems& problems, const Contexts& contexts, Copies& copies, Types& types,
           const ArxmlOptions& options, Model& model)
      : tree_{tree},
        problems_{problems},
        contexts_{contexts},
        copies_{copies},
        types_{types},
        options_{options},
        model_{model} {}

  void read();

 private:
  /// Where the parts of a service came from, while it is read.
  struct Parts {
    Service service{};
    std::map<const Node*, Event*> events{};      ///< by prototype and by deployment
    std::map<const Node*, Method*> methods{};    ///< by operation and by deployment
    std::map<const Node*, Field*> fields{};      ///< by prototype, deployment and notifier
    std::map<const Node*, Protection*> calls{};  ///< those of getters and setters, by their deployment
  };
  /// How a deployment was read.
  struct Deployed {
    std::string service{};
    std::optional<someip::ServiceId> id{};
  };

  void read_service(const Node* interface, const Node* deployment, bool further);
  void read_interface(const Node& interface, Parts& parts);
  void read_deployment(const Node& deployment, Parts& parts, bool with_interface);
  void read_events(const Node& deployment, Parts& parts, bool with_interface);
  void read_methods(const Node& deployment, Parts& parts, bool with_interface);
  void read_fields(const Node& deployment, Parts& parts, bool with_interface);
  void read_eventgroups(const Node& deployment, Parts& parts);
  void find_protections();
  void add_protections(const Node* target, std::vector<SaidProtection>& said);
  void read_protections(const Parts& parts);
  [[nodiscard]] Method read_method(const Node& operation);
  void read_transfer(const Node& deployment, Tag segment, Tag separation, Transfer& transfer);
  [[nodiscard]] std::optional<someip::MethodId> method_id(const Node* id, Place& place);
  [[nodiscard]] std::optional<someip::MethodId> event_id(const Node* id, std::size_t& changed, Place& place);

  void read_machines();
  void read_instance(const Node& node, Instance::Role role);
  void read_collection(const Node& node, const Instance& instance);
  void read_places();
  [[nodiscard]] std::optional<Endpoint> multicast_group(const Node* text, const Node& beside);
  [[nodiscard]] std::optional<std::uint16_t> port(const Node& mapping, Tag direct, Tag reference, Tag tp,
                                                  Tag tp_port);

  const Tree& tree_;
  Problems& problems_;
  const Contexts& contexts_;
  Copies& copies_;
  Types& types_;
  const ArxmlOptions& options_;
  Model& model_;
  /// By event, field or method, or its deployment. Each instance has its own ones.
  std::map<const Node*, std::vector<const Node*>> protections_{};
  std::map<const Node*, Deployed> deployed_{};
  std::map<const Node*, std::size_t> instances_{};
  std::map<const Node*, std::vector<Multicast>> groups_without_address_{};  ///< by instance
};

/// The number from `least` to `most` in the text of `node`; nothing, and an error, when it is none. Nothing
/// without an error when there is no node.
[[nodiscard]] std::optional<std::uint32_t> number_in(const Node* node, std::uint32_t least,
                                                     std::uint32_t most, Problems& problems);
/// Timing of service discovery: of the Adaptive configurations, which are elements of their own, and of
/// Classic's, which stand in the instance. `node` may be nothing.
[[nodiscard]] std::optional<sd::Timing> timing_of(const Node* node, Problems& problems,
                                                  std::map<std::string_view, Place>& said_at);
/// Where a number is said, if it is.
template <typename Number>
[[nodiscard]] std::optional<Place> said_at(const std::optional<Number>& number, const Node& node) {
  return number ? std::optional{node.place()} : std::nullopt;
}
/// What a client asks of versions beyond a number, as far as Find can say it.
void read_version_rules(const Node& node, Instance& instance, Problems& problems);
/// The lifetime of subscriptions to an eventgroup that was added to `instance`.
void read_subscription(const Tree& tree, const Node& group, Instance& instance, Problems& problems);
/// The address of a NETWORK-ENDPOINT.
[[nodiscard]] std::optional<IpAddress> address_of(const Node* endpoint, Problems& problems);
/// Of E2E-PROFILE-CONFIGURATION or END-TO-END-TRANSFORMATION-DESCRIPTION, and what protects one element.
/// @param compatibility  E-2-E-PROFILE-COMPATIBILITY-PROPS of the profile.
/// Each of them may be nothing.
[[nodiscard]] Protection protection_of(const Node* profile, const Node* properties, const Node* compatibility,
                                       Problems& problems);
/// All that is said of one element, with what instances have otherwise.
[[nodiscard]] Protection joined(const std::vector<SaidProtection>& all, Problems& problems);
/// The id that an instance has; nothing: any, or none. Tells nothing of what is wrong with it.
[[nodiscard]] std::optional<someip::InstanceId> said_instance_id(const Node* instance);
/// CAPABILITY-RECORDS.
[[nodiscard]] std::map<std::string, std::string, std::less<>> records_of(const Node& node);

}  // namespace trestle::describe::arxml
