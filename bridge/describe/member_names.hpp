#pragma once
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/describe/lower.hpp"
#include "bridge/describe/model.hpp"

/// What names of services and members mean. One for all who take such names: tools, route files, `explain`,
/// the page.
namespace trestle::describe {

/// Tells methods of one service apart, and events: the name; of those that FIDL overloads, "name:selector".
[[nodiscard]] std::string member_key(const std::string& name, const std::string& selector);

/// A member of a service, or a part of one.
struct NamedMember {
  enum class Part : std::uint8_t {
    whole,
    request,   ///< of a method: "open.request"
    response,  ///< of a method with an answer: "open.response"
    getter,    ///< of a field: "label.get"
    setter,    ///< "label.set"
    notifier,  ///< "label.notify"
  };
  LoweredMember::Kind kind = LoweredMember::Kind::event;
  std::size_t index = 0;  ///< of the service's events, methods or fields
  Part part = Part::whole;
  friend bool operator==(const NamedMember&, const NamedMember&) = default;
};

/// The members that a text names: by member_key(), and maybe a part of it that is there. Those of different
/// kinds may have one name; events first, then methods, then fields.
[[nodiscard]] std::vector<NamedMember> named_members(const Service& service, std::string_view text);

/// All members of a service by their names, methods and events with their selectors.
[[nodiscard]] std::vector<std::string> member_names(const Service& service);

/// One way to read a text that begins with the name of a service.
struct NamedService {
  std::size_t service = 0;  ///< index of Model::services
  std::optional<someip::InstanceId>
      instance{};           ///< "Door.0x0001.moved"; nothing: none, or any, "Door.*.moved"
  std::string_view rest{};  ///< "moved"; points into the text
};

/// The services of a model by their names: "Door", "car.Door", "/Services/Door".
class ServiceNames {
 public:
  explicit ServiceNames(const Model& model);

  /// All services that a text begins with, in the order of the model: there may be several of one short name,
  /// and several versions of one service.
  [[nodiscard]] std::vector<NamedService> find(std::string_view text) const;

 private:
  std::map<std::string, std::vector<std::size_t>, std::less<>> services_;
  std::size_t longest_ = 0;
};

/// "there are car.Door and bus.Door: write the full name", for a text that means something in both.
[[nodiscard]] std::string several_services(const Service& one, const Service& other);

}  // namespace trestle::describe
