#include "bridge/generate/service_explanation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "bridge/describe/layout.hpp"
#include "bridge/describe/member_names.hpp"
#include "bridge/describe/model_json.hpp"
#include "bridge/documents/problems.hpp"

namespace trestle::generate {
namespace {

using Message = ServiceExplanation::Message;
using Member = ServiceExplanation::Member;

template <typename Id>
std::string text(const std::optional<Id>& id) {
  return id ? fmt::format("0x{:04x}", static_cast<unsigned>(*id)) : "without id";
}

class Maker {
 public:
  Maker(const describe::Model& model, const describe::Service& service)
      : model_{model}, service_{service}, labels_{type_labels(model)} {}

  ServiceExplanation make() const {
    ServiceExplanation made{.name = describe::full_name(service_.scope, service_.name),
                            .id = text(service_.id),
                            .version = fmt::format("{}.{}", service_.major, service_.minor)};
    for (const describe::Method& method : service_.methods) {
      Member member{"method", describe::member_key(method.name, method.selector), text(method.id)};
      member.messages.push_back({"request", values(method.request)});
      if (!method.fire_and_forget) {
        member.messages.push_back({"response", values(describe::response_of(model_, method))});
      }
      made.members.push_back(std::move(member));
    }
    for (const describe::Event& event : service_.events) {
      made.members.push_back({"event",
                              describe::member_key(event.name, event.selector),
                              text(event.id),
                              {{"payload", values(event.payload)}}});
    }
    for (const describe::Field& field : service_.fields) {
      made.members.push_back({"field", field.name, ids(field), {{"payload", values(field.payload)}}});
    }
    return made;
  }

 private:
  static std::string ids(const describe::Field& field) {
    std::string all;
    const auto add = [&](const char* part, bool is_there, const std::optional<someip::MethodId>& id) {
      if (is_there) {
        all += fmt::format("{}{} {}", all.empty() ? "" : ", ", part, text(id));
      }
    };
    add("get", field.has_getter, field.getter);
    add("set", field.has_setter, field.setter);
    add("notify", field.has_notifier, field.notifier);
    return all;
  }

  std::string values(const describe::Payload& payload) const {
    if (!payload.known) {
      return "not known";
    }
    std::string all;
    for (const describe::Value& value : payload.values) {
      all += fmt::format("{}{}{}{}", all.empty() ? "" : ", ", label(value.type, 0),
                         value.name.empty() ? "" : " ", value.name);
    }
    return all;
  }

  std::string label(describe::TypeIndex index, int deep) const {
    constexpr int deepest = 8;
    if (static_cast<std::size_t>(index) >= labels_.size()) {
      return "unknown";
    }
    const describe::Type& type = model_.at(index);
    return type.kind == describe::Kind::array && type.name.empty() && deep < deepest
               ? label(type.element.type, deep + 1) + "[]"
               : labels_[static_cast<std::size_t>(index)];
  }

  const describe::Model& model_;
  const describe::Service& service_;
  std::vector<std::string> labels_;
};

}  // namespace

tl::expected<std::optional<ServiceExplanation>, std::string> explain_service(const describe::System& system,
                                                                             std::string_view name) {
  const describe::Service* found = nullptr;
  for (const describe::NamedService& named : describe::ServiceNames{system.model}.find(name)) {
    if (!named.rest.empty()) {
      continue;
    }
    const describe::Service& service = system.model.services[named.service];
    if (found != nullptr) {
      return tl::unexpected{describe::several_services(*found, service)};
    }
    found = &service;
  }
  if (found == nullptr) {
    return std::nullopt;
  }
  return Maker{system.model, *found}.make();
}

std::string to_text(const ServiceExplanation& explanation) {
  std::size_t name_width = 0;
  std::size_t ids_width = 0;
  for (const Member& member : explanation.members) {
    name_width = std::max(name_width, member.name.size());
    ids_width = std::max(ids_width, member.ids.size());
  }
  std::string text = fmt::format("{} {}, version {}:{}\n", explanation.name, explanation.id,
                                 explanation.version, explanation.members.empty() ? " no members" : "");
  for (const Member& member : explanation.members) {
    text += fmt::format("  {:6}  {:{}}  {:{}} ", member.kind, member.name, name_width, member.ids, ids_width);
    for (const Message& message : member.messages) {
      text += fmt::format(" {}({})", message.part, message.values);
    }
    text += "\n";
  }
  return text;
}

std::string to_json_text(const ServiceExplanation& explanation) {
  using OrderedJson = nlohmann::ordered_json;
  OrderedJson json{{"service", explanation.name}, {"id", explanation.id}, {"version", explanation.version}};
  json["members"] = OrderedJson::array();
  for (const Member& member : explanation.members) {
    OrderedJson one{{"kind", member.kind}, {"name", member.name}, {"ids", member.ids}};
    for (const Message& message : member.messages) {
      one[message.part] = message.values;
    }
    json["members"].push_back(std::move(one));
  }
  return documents::printable_json(json.dump(2, ' ', false, OrderedJson::error_handler_t::replace)) + "\n";
}

}  // namespace trestle::generate
