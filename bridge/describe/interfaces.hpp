#pragma once
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <utility>
#include <vector>

#include "bridge/describe/protection.hpp"
#include "bridge/describe/system.hpp"
#include "bridge/messages/types/type_library.hpp"
#include "bridge/messages/values/message_values.hpp"

/// A system's interfaces for tools: what names mean, what ids are called, and what payloads say.
namespace trestle::describe {

/// What a service has under one id.
struct ServiceElement {
  enum class Part : std::uint8_t { event, method, getter, setter, notifier };
  Part part = Part::event;
  std::size_t service = 0;  ///< index of Model::services
  std::size_t member = 0;   ///< index of its events, methods or fields
  someip::MethodId id{};
  std::string member_name{};  ///< "moved", "opening"; "open:slowly" of those that FIDL overloads
  std::string name{};         ///< "Door.moved", "Door.opening.get"
  std::vector<someip::EventgroupId> eventgroups{};
  Transport transport = Transport::udp;  ///< of the request, or of the event
  bool fire_and_forget = false;

  [[nodiscard]] bool is_event() const noexcept { return part == Part::event || part == Part::notifier; }
  [[nodiscard]] bool is_field() const noexcept { return part != Part::event && part != Part::method; }
};

/// "get", "set", "notify"; empty for what is no part of a field.
[[nodiscard]] const char* field_part(ServiceElement::Part part) noexcept;

/// What one kind of message carries.
struct Content {
  std::optional<messages::MessageValues> values{};  ///< nothing: not known
  std::string unknown{};                            ///< why, where `values` is nothing
  bool is_empty = false;                            ///< by the description it has no values
  /// It has bytes that Trestle does not make, beside its values or alone: `unknown` says which.
  bool has_crc = false;
  ProtectionHeader e2e{};  ///< its header, which is not one of the values

  /// The payload without its E2E header, which is given in `header`. Shorter payloads stay as they are.
  [[nodiscard]] std::vector<std::byte> without_header(ByteView payload,
                                                      std::vector<std::byte>* header = nullptr) const;
};

class Interfaces {
 public:
  /// @param system  a good one.
  explicit Interfaces(System system);

  [[nodiscard]] const System& system() const noexcept { return system_; }
  [[nodiscard]] const Model& model() const noexcept { return system_.model; }

  /// What a text means.
  struct Meaning {
    std::size_t service = 0;
    std::optional<someip::InstanceId> instance{};   ///< that the text names
    std::vector<const ServiceElement*> elements{};  ///< of the service: none; of a field: its parts
  };
  /// Finds a service ("Door", "car.Door", "/Services/Door"), one of its instances ("Door.0x0001") or one of
  /// its elements ("Door.moved", "Door.0x0001.moved", "Door.opening", "Door.opening.get").
  /// @return what it means; or an error of several lines with what is near, or with all there is.
  [[nodiscard]] tl::expected<Meaning, std::string> find(std::string_view text) const;
  /// An element of a service: "moved", "opening.set".
  [[nodiscard]] tl::expected<Meaning, std::string> find_in(std::size_t service, std::string_view text) const;

  /// By ids; of several versions the one with this major version, or else any.
  [[nodiscard]] const Service* service(someip::ServiceId id,
                                       std::optional<std::uint8_t> major = std::nullopt) const;
  [[nodiscard]] const ServiceElement* element(someip::ServiceId service, std::uint8_t major,
                                              someip::MethodId id) const;
  /// All of a service, in the order of the description: events, methods, fields.
  [[nodiscard]] std::vector<const ServiceElement*> elements_of(std::size_t service) const;

  /// Instances of a service with an id, each once.
  [[nodiscard]] std::vector<const Instance*> instances_of(std::size_t service) const;
  /// "Door", "car.Door" where there are several; "0x4711" for an id that nobody describes.
  [[nodiscard]] std::string name_of(someip::ServiceId id,
                                    std::optional<std::uint8_t> major = std::nullopt) const;
  [[nodiscard]] const std::string& name_of(std::size_t service) const { return names_[service]; }
  /// Empty: it has no name.
  [[nodiscard]] std::string eventgroup_name(someip::ServiceId service, someip::EventgroupId eventgroup) const;

  /// Its end-to-end protection in one instance; null: it has none. Of a field it is that of the notifier
  /// alone.
  /// @param instance  nothing, or any: what is not of a certain instance.
  [[nodiscard]] const Protection* protection(const ServiceElement& element,
                                             std::optional<someip::InstanceId> instance) const;

  /// What a request to an element carries, or an event.
  [[nodiscard]] const Content& content(const ServiceElement& element) const {
    return content(element, false);
  }
  /// What the answer to a request carries.
  [[nodiscard]] const Content& answer(const ServiceElement& element) const { return content(element, true); }

 private:
  using Ids = std::pair<someip::ServiceId, someip::MethodId>;

  void add_elements(std::size_t service);
  void add(ServiceElement element, const std::optional<someip::MethodId>& id);
  [[nodiscard]] std::vector<std::string> known_names(std::optional<std::size_t> service) const;
  [[nodiscard]] std::string not_found(std::string_view text, std::optional<std::size_t> service) const;
  [[nodiscard]] const Protection& protection_of(const ServiceElement& element) const;
  [[nodiscard]] const Content& content(const ServiceElement& element, bool is_answer) const;
  [[nodiscard]] Content make_content(const ServiceElement& element, bool is_answer) const;

  System system_;
  std::vector<std::string> names_{};  ///< of services
  std::vector<bool> has_types_{};     ///< of services
  ServiceNames service_names_;
  std::vector<std::unique_ptr<const ServiceElement>> elements_{};  ///< those of a service together
  std::vector<std::size_t> first_elements_{};                      ///< of each service, and the end
  std::multimap<Ids, const ServiceElement*> by_ids_{};
  mutable messages::TypeLibrary library_;
  mutable std::map<std::pair<const ServiceElement*, bool>, std::unique_ptr<const Content>> contents_{};
};

}  // namespace trestle::describe
