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

using Id = ServiceExplanation::Id;
using Message = ServiceExplanation::Message;
using Member = ServiceExplanation::Member;

template <typename Number>
std::string text(const std::optional<Number>& id) {
  return id ? fmt::format("0x{:04x}", static_cast<unsigned>(*id)) : "without id";
}

/// "0x0010"; of a field "get 0x0001, notify 0x8001".
/// @param chosen  stands behind those that Trestle chose.
std::string text(const std::vector<Id>& ids, std::string_view chosen) {
  std::string all;
  for (const Id& id : ids) {
    all += fmt::format("{}{}{}{}{}", all.empty() ? "" : ", ", id.part, id.part.empty() ? "" : " ", id.text,
                       id.is_chosen ? chosen : "");
  }
  return all;
}

class Maker {
 public:
  /// @param labels  describe::type_labels() of the model.
  Maker(const describe::Model& model, const describe::Service& service,
        const std::vector<std::string>& labels)
      : model_{model}, service_{service}, labels_{labels} {}

  ServiceExplanation make() const {
    ServiceExplanation made{.name = describe::full_name(service_.scope, service_.name),
                            .id = {{}, text(service_.id), service_.id_is_chosen},
                            .version = fmt::format("{}.{}", service_.major, service_.minor)};
    for (const describe::Method& method : service_.methods) {
      Member member{"method", describe::member_key(method.name, method.selector), {id({}, method.id)}};
      member.messages.push_back({"request", values(method.request)});
      if (!method.fire_and_forget) {
        member.messages.push_back({"response", values(describe::response_of(model_, method))});
      }
      made.members.push_back(std::move(member));
    }
    for (const describe::Event& event : service_.events) {
      made.members.push_back({"event",
                              describe::member_key(event.name, event.selector),
                              {id({}, event.id)},
                              {{"payload", values(event.payload)}}});
    }
    for (const describe::Field& field : service_.fields) {
      made.members.push_back({"field", field.name, ids(field), {{"payload", values(field.payload)}}});
    }
    return made;
  }

 private:
  Id id(std::string part, const std::optional<someip::MethodId>& id) const {
    return {std::move(part), text(id), id && service_.chosen_ids.contains(*id)};
  }

  std::vector<Id> ids(const describe::Field& field) const {
    std::vector<Id> all;
    const auto add = [&](const char* part, bool is_there, const std::optional<someip::MethodId>& number) {
      if (is_there) {
        all.push_back(id(part, number));
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
    if (payload.crc_bytes != 0) {
      all += fmt::format("{}CRC of {} byte{}", all.empty() ? "" : ", ", payload.crc_bytes,
                         payload.crc_bytes == 1 ? "" : "s");
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
  const std::vector<std::string>& labels_;
};

using OrderedJson = nlohmann::ordered_json;

OrderedJson json_of(const ServiceExplanation& explanation) {
  OrderedJson json{
      {"service", explanation.name}, {"id", explanation.id.text}, {"version", explanation.version}};
  if (explanation.id.is_chosen) {
    json["id_is_chosen"] = true;
  }
  json["members"] = OrderedJson::array();
  for (const Member& member : explanation.members) {
    OrderedJson one{{"kind", member.kind}, {"name", member.name}, {"ids", text(member.ids, {})}};
    for (const Id& id : member.ids) {
      if (id.is_chosen) {
        one["chosen_ids"].push_back(id.text);
      }
    }
    for (const Message& message : member.messages) {
      one[message.part] = message.values;
    }
    json["members"].push_back(std::move(one));
  }
  return json;
}

std::string text_of(const OrderedJson& json) {
  return documents::printable_json(json.dump(2, ' ', false, OrderedJson::error_handler_t::replace)) + "\n";
}

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
  return Maker{system.model, *found, describe::type_labels(system.model)}.make();
}

Contents contents_of(const describe::System& system) {
  const describe::Model& model = system.model;
  const std::vector<std::string> labels = describe::type_labels(model);
  Contents contents;
  for (const describe::Service& service : model.services) {
    contents.services.push_back(Maker{model, service, labels}.make());
  }
  for (std::size_t at = 0; at < model.types.size(); ++at) {
    const describe::Type& type = model.types[at];
    // A label with "#2" is that of a type which no name finds.
    if (!type.name.empty() && labels[at] == describe::full_name(type.scope, type.name)) {
      contents.types.push_back({labels[at], describe::to_string(type.kind)});
    }
  }
  return contents;
}

std::string to_text(const ServiceExplanation& explanation) {
  constexpr std::string_view chosen = " chosen";
  std::size_t name_width = 0;
  std::size_t ids_width = 0;
  bool any_chosen = explanation.id.is_chosen;
  for (const Member& member : explanation.members) {
    name_width = std::max(name_width, member.name.size());
    ids_width = std::max(ids_width, text(member.ids, chosen).size());
    any_chosen = any_chosen || std::ranges::any_of(member.ids, &Id::is_chosen);
  }
  std::string all = fmt::format("{} {}, version {}:{}\n", explanation.name, text({explanation.id}, chosen),
                                explanation.version, explanation.members.empty() ? " no members" : "");
  for (const Member& member : explanation.members) {
    all += fmt::format("  {:6}  {:{}}  {:{}} ", member.kind, member.name, name_width,
                       text(member.ids, chosen), ids_width);
    for (const Message& message : member.messages) {
      all += fmt::format(" {}({})", message.part, message.values);
    }
    all += "\n";
  }
  return any_chosen ? all + "chosen: Trestle chose this id, because no description gives it\n" : all;
}

std::string to_text(const Contents& contents) {
  std::string all;
  std::size_t width = 0;
  for (const ServiceExplanation& service : contents.services) {
    all += to_text(service);
  }
  for (const Contents::NamedType& type : contents.types) {
    width = std::max(width, type.name.size());
  }
  all += contents.types.empty() ? "" : "types:\n";
  for (const Contents::NamedType& type : contents.types) {
    all += fmt::format("  {:{}}  {}\n", type.name, width, type.kind);
  }
  return all;
}

std::string to_json_text(const ServiceExplanation& explanation) {
  return text_of(json_of(explanation));
}

std::string to_json_text(const Contents& contents) {
  OrderedJson json{{"services", OrderedJson::array()}, {"types", OrderedJson::array()}};
  for (const ServiceExplanation& service : contents.services) {
    json["services"].push_back(json_of(service));
  }
  for (const Contents::NamedType& type : contents.types) {
    json["types"].push_back({{"name", type.name}, {"kind", type.kind}});
  }
  return text_of(json);
}

}  // namespace trestle::generate
