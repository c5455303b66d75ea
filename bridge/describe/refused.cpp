#include "bridge/describe/refused.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bridge/describe/model_source.hpp"
#include "bridge/messages/convert/service_plans.hpp"
#include "bridge/messages/types/field_service.hpp"
#include "bridge/messages/types/type_library.hpp"

namespace trestle::describe {
namespace {

using messages::FieldAccess;

/// The messages of a model that is being lowered.
class LoweredMessages : public messages::TypeSource {
 public:
  explicit LoweredMessages(const Lowered& lowered) : lowered_{lowered} {}
  [[nodiscard]] tl::expected<std::optional<messages::InterfaceMessages>, messages::TypeError> find(
      const messages::InterfaceName& interface) const override {
    return messages_of(lowered_, interface, "the description");
  }

 private:
  const Lowered& lowered_;
};

class Judge {
 public:
  explicit Judge(const Lowered& lowered)
      : library_{messages::TypeLibrary::of({std::make_shared<LoweredMessages>(lowered)})} {
    // Messages that others are made of stand before these.
    for (const messages::MessageDefinition& one : lowered.definitions) {
      std::size_t size = 1 + one.constants.size();
      for (const messages::Field& field : one.fields) {
        const auto nested = sizes_.find(field.type.message);
        size += 1 + (nested == sizes_.end() ? 0 : nested->second);
      }
      sizes_.emplace(one.name, std::min(size, max_judged_fields + 1));
    }
  }

  /// Why a bridge refuses it; empty: it does not.
  std::string fault_of(const LoweredMember& member, bool has_getter, bool has_setter) {
    const bool is_method = member.kind == LoweredMember::Kind::method;
    // Many members of a service have the same type and rules.
    std::vector<Judged>& known = known_[member.type];
    for (const Judged& one : known) {
      if (one.rules == member.rules && one.has_getter == has_getter && one.has_setter == has_setter) {
        return one.fault;
      }
    }
    const std::size_t size = is_method
                                 ? size_of(member.type + "_Request") + size_of(member.type + "_Response")
                                 : size_of(member.type);
    if (size > left_) {
      return fmt::format("the members before it and it have more than {} fields", max_judged_fields);
    }
    left_ -= size;
    Judged judged{member.rules, has_getter, has_setter, {}};
    judged.fault = is_method ? of_method(member) : of_value(member);
    for (const auto& [is_there, access] :
         {std::pair{has_getter, FieldAccess::get}, {has_setter, FieldAccess::set}}) {
      if (is_there && judged.fault.empty()) {
        judged.fault = of_access(member, access);
      }
    }
    constexpr std::size_t most = 16;  // each is compared with all
    if (known.size() < most) {
      known.push_back(judged);
    }
    return judged.fault;
  }

 private:
  struct Judged {
    messages::MessageRules rules;
    bool has_getter;
    bool has_setter;
    std::string fault;
  };

  [[nodiscard]] std::size_t size_of(const std::string& message) const {
    const auto found = sizes_.find(message);
    return found == sizes_.end() ? 0 : found->second;
  }

  std::string of_value(const LoweredMember& member) {
    const auto tree = library_.resolve(member.type);
    if (!tree) {
      return to_string(tree.error());
    }
    const auto plan = messages::ConversionPlan::compile(*tree, member.rules);
    return plan ? std::string{} : plan.error();
  }
  std::string of_method(const LoweredMember& member) {
    const auto types = library_.resolve_service(member.type);
    if (!types) {
      return to_string(types.error());
    }
    const auto plans = messages::compile_service(*types, member.rules);
    return plans ? std::string{} : plans.error();
  }
  std::string of_access(const LoweredMember& member, FieldAccess access) {
    const auto types = messages::resolve_field_service(
        library_, messages::field_service_name(member.type, access), member.type, access);
    if (!types) {
      return types.error();
    }
    const auto plans = messages::compile_field_service(*types, access, member.rules);
    return plans ? std::string{} : plans.error();
  }

  messages::TypeLibrary library_;
  std::map<std::string, std::size_t, std::less<>> sizes_{};
  std::map<std::string, std::vector<Judged>, std::less<>> known_{};
  std::size_t left_ = max_judged_fields;
};

}  // namespace

void leave_out_refused(const Model& model, Lowered& lowered) {
  Judge judge{lowered};
  std::vector<NotCarried> lost;
  std::erase_if(lowered.members, [&](const LoweredMember& member) {
    const Service& service = model.services[member.service];
    const Field* const field =
        member.kind == LoweredMember::Kind::field ? &service.fields[member.member] : nullptr;
    std::string fault =
        judge.fault_of(member, field != nullptr && field->has_getter, field != nullptr && field->has_setter);
    if (fault.empty()) {
      return false;
    }
    const auto tell = [&](const auto& element) {
      lost.push_back({full_name(service.scope, service.name) + "." + element.name,
                      "a bridge refuses it: " + fault, element.place});
    };
    switch (member.kind) {
      case LoweredMember::Kind::event:
        tell(service.events[member.member]);
        break;
      case LoweredMember::Kind::method:
        tell(service.methods[member.member]);
        break;
      case LoweredMember::Kind::field:
        tell(*field);
        break;
    }
    return true;
  });
  lowered.not_carried.insert(lowered.not_carried.end(), std::make_move_iterator(lost.begin()),
                             std::make_move_iterator(lost.end()));
}

std::string why_not_carried(const Lowered& lowered, const Service& service, std::string_view member) {
  // What is told first may be less: that its name is too long for a file.
  const std::string_view name = member.substr(0, member.find(':'));  // without a selector
  const std::string element = fmt::format("{}.{}", full_name(service.scope, service.name), name);
  const auto why = std::find_if(lowered.not_carried.rbegin(), lowered.not_carried.rend(),
                                [&](const NotCarried& one) { return one.element == element; });
  return why == lowered.not_carried.rend() ? "its type has no form in ROS 2" : why->what;
}

}  // namespace trestle::describe
