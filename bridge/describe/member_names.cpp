#include "bridge/describe/member_names.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "bridge/documents/format.hpp"

namespace trestle::describe {
namespace {

using MemberKind = LoweredMember::Kind;

/// Whether the text is "KEY" or "KEY.word".
bool is_part(std::string_view text, std::string_view key, std::string_view word) {
  return text.size() == key.size() + 1 + word.size() && text.starts_with(key) && text[key.size()] == '.' &&
         text.ends_with(word);
}

/// Takes the id of an instance that the rest begins with, up to a dot or the end; "*" is any.
void take_instance(NamedService& named) {
  const std::string_view part = named.rest.substr(0, named.rest.find('.'));
  constexpr std::size_t longest_id = 6;
  if (part != "*") {
    const auto number =
        part.size() > longest_id ? std::nullopt : documents::id_number(1, 0xfffe).read(std::string{part});
    if (!number) {
      return;
    }
    named.instance = someip::InstanceId{static_cast<std::uint16_t>(*number)};
  }
  named.rest.remove_prefix(std::min(named.rest.size(), part.size() + 1));
}

/// The event or method that has this name and a selector, if there is only one.
std::vector<NamedMember> only_one_called(const Service& service, std::string_view text) {
  std::vector<NamedMember> found;
  for (std::size_t i = 0; i < service.events.size(); ++i) {
    if (text == service.events[i].name) {
      found.push_back({MemberKind::event, i});
    }
  }
  for (std::size_t i = 0; i < service.methods.size(); ++i) {
    if (text == service.methods[i].name) {
      found.push_back({MemberKind::method, i});
    }
  }
  return found.size() == 1 ? found : std::vector<NamedMember>{};
}

}  // namespace

std::string member_key(const std::string& name, const std::string& selector) {
  return selector.empty() ? name : name + ":" + selector;
}

std::vector<NamedMember> named_members(const Service& service, std::string_view text) {
  std::vector<NamedMember> found;
  for (std::size_t i = 0; i < service.events.size(); ++i) {
    if (text == member_key(service.events[i].name, service.events[i].selector)) {
      found.push_back({MemberKind::event, i});
    }
  }
  for (std::size_t i = 0; i < service.methods.size(); ++i) {
    const Method& method = service.methods[i];
    const std::string key = member_key(method.name, method.selector);
    if (text == key) {
      found.push_back({MemberKind::method, i});
    } else if (is_part(text, key, "request")) {
      found.push_back({MemberKind::method, i, NamedMember::Part::request});
    } else if (!method.fire_and_forget && is_part(text, key, "response")) {
      found.push_back({MemberKind::method, i, NamedMember::Part::response});
    }
  }
  for (std::size_t i = 0; i < service.fields.size(); ++i) {
    const Field& field = service.fields[i];
    if (text == field.name) {
      found.push_back({MemberKind::field, i});
    } else if (field.has_getter && is_part(text, field.name, "get")) {
      found.push_back({MemberKind::field, i, NamedMember::Part::getter});
    } else if (field.has_setter && is_part(text, field.name, "set")) {
      found.push_back({MemberKind::field, i, NamedMember::Part::setter});
    } else if (field.has_notifier && is_part(text, field.name, "notify")) {
      found.push_back({MemberKind::field, i, NamedMember::Part::notifier});
    }
  }
  return found.empty() ? only_one_called(service, text) : found;
}

std::vector<std::string> member_names(const Service& service) {
  std::vector<std::string> names;
  for (const Event& event : service.events) {
    names.push_back(member_key(event.name, event.selector));
  }
  for (const Method& method : service.methods) {
    names.push_back(member_key(method.name, method.selector));
  }
  for (const Field& field : service.fields) {
    names.push_back(field.name);
  }
  return names;
}

ServiceNames::ServiceNames(const Model& model) {
  const auto add = [&](const std::string& name, std::size_t service) {
    std::vector<std::size_t>& all = services_[name];
    if (all.empty() || all.back() != service) {
      all.push_back(service);
    }
    longest_ = std::max(longest_, name.size());
  };
  for (std::size_t i = 0; i < model.services.size(); ++i) {
    const Service& service = model.services[i];
    add(full_name(service.scope, service.name), i);
    add(service.name, i);
  }
}

std::vector<NamedService> ServiceNames::find(std::string_view text) const {
  std::vector<NamedService> found;
  std::set<std::size_t> seen;
  // A full name is longer than the short one, and counts before it.
  for (std::size_t end = std::min(text.size(), longest_); end > 0; --end) {
    if (end < text.size() && text[end] != '.') {
      continue;
    }
    const auto named = services_.find(text.substr(0, end));
    if (named == services_.end()) {
      continue;
    }
    for (const std::size_t service : named->second) {
      if (seen.insert(service).second) {
        found.push_back({.service = service, .rest = text.substr(std::min(text.size(), end + 1))});
        take_instance(found.back());
      }
    }
  }
  std::ranges::sort(found, {}, &NamedService::service);
  return found;
}

std::string several_services(const Service& one, const Service& other) {
  const std::string name = full_name(one.scope, one.name);
  const std::string second = full_name(other.scope, other.name);
  return name == second ? fmt::format("there are several versions of {}", name)
                        : fmt::format("there are {} and {}: write the full name", name, second);
}

}  // namespace trestle::describe
