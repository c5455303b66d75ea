#pragma once
#include <memory>
#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "bridge/describe/load_e2e.hpp"
#include "bridge/describe/model_source.hpp"
#include "bridge/describe/system.hpp"
#include "bridge/messages/convert/message_rules.hpp"
#include "bridge/messages/types/message_definition.hpp"
#include "bridge/messages/values/message_values.hpp"

namespace trestle::generate {

/// What the files and edits of a question make.
struct PageSystem {
  describe::System system{};
  describe::IdLock lock{};
  bool was_read = false;                                 ///< there is a model
  std::shared_ptr<const describe::ModelSource> types{};  ///< null: there is no model
};

/// One payload of a member, with the ROS message that its values are.
struct PagePart {
  describe::Payload payload{};  ///< an error of the method among its values
  std::string type{};           ///< the ROS message; empty: it has none
  std::string why_no_type{};    ///< then
  messages::MessageRules rules{};
  describe::Protection e2e{};  ///< of a field that of the notifier
  describe::E2eUse use = describe::E2eUse::sent_event;

  /// The message; or why there is none.
  [[nodiscard]] tl::expected<messages::TypeTree, std::string> tree(const PageSystem& system) const;
  /// What the fields of the message are in the description: the values of the payload, or the members of the
  /// structure that is the payload itself.
  [[nodiscard]] std::vector<describe::Value> values(const describe::System& system,
                                                    const messages::MessageDefinition& root) const;
  /// The payload that a JSON text means.
  [[nodiscard]] tl::expected<std::vector<std::byte>, messages::ValueError> bytes(
      messages::TypeTree tree, const std::string& json) const;
  /// A payload as YAML; or what is wrong with it.
  [[nodiscard]] tl::expected<std::string, std::string> yaml(const PageSystem& system, ByteView bytes) const;
};

/// A method, event or field of a model.
class PageMember {
 public:
  /// @param kind    "methods", "events", "fields"
  /// @param member  describe::member_key(), or the name of a field.
  /// @return nothing when there is none.
  [[nodiscard]] static std::optional<PageMember> of(const PageSystem& system, const std::string& service,
                                                    const std::string& kind, const std::string& member);

  [[nodiscard]] const describe::Service& service() const noexcept { return *service_; }
  /// Null: it is something else.
  [[nodiscard]] const describe::Method* method() const noexcept { return method_; }
  [[nodiscard]] const describe::Field* field() const noexcept { return field_; }
  /// "Door.open"
  [[nodiscard]] std::string name() const;
  /// End-to-end protection of calls: of the method, or of a getter or setter.
  [[nodiscard]] const describe::Protection& protection(bool gets) const;
  /// @param response  that of a method; all others have one payload.
  [[nodiscard]] PagePart part(const describe::Model& model, bool response) const;

 private:
  const describe::Service* service_ = nullptr;
  const describe::Method* method_ = nullptr;
  const describe::Event* event_ = nullptr;
  const describe::Field* field_ = nullptr;
  const describe::LoweredMember* lowered_ = nullptr;  ///< null: it has no form in ROS
  std::string why_not_lowered_{};                     ///< then
};

}  // namespace trestle::generate
