#include "bridge/cli/interface_options.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <utility>

#include "bridge/cli/session.hpp"
#include "bridge/cli/terminal.hpp"
#include "bridge/describe/eventgroup_title.hpp"
#include "bridge/describe/sources/kept_ids.hpp"
#include "bridge/describe/sources/sources.hpp"
#include "bridge/documents/ids_in_line.hpp"

namespace trestle::cli {
namespace {

void print(const std::vector<documents::Problem>& problems) {
  const Colours colour = colours_for(STDERR_FILENO);
  for (const documents::Problem& problem : problems) {
    // Warnings are for those who generate from a description, not for each call.
    if (problem.severity == documents::Problem::Severity::error) {
      fmt::print(stderr, "{}{}{}\n", colour.red, to_string(problem), colour.off);
    }
  }
}

bool is_id(const std::string& text) {
  return !text.empty() && text.front() >= '0' && text.front() <= '9';
}

/// What a description says of a service and of the instance that is meant.
void complete(const describe::Interfaces& interfaces, Target& target, UnnamedInstance unnamed) {
  const describe::Service& service = interfaces.model().services[*target.described];
  const std::string& name = interfaces.name_of(*target.described);
  const std::vector<const describe::Instance*> all = interfaces.instances_of(*target.described);
  const bool takes_any =
      unnamed == UnnamedInstance::any || (unnamed == UnnamedInstance::only_or_any && all.size() != 1);
  if (target.service.instance == someip::any_instance && !takes_any) {
    if (all.size() != 1) {
      std::vector<std::string> ids;
      for (const describe::Instance* one : all) {
        ids.push_back(fmt::format("{}.0x{:04x}", name, someip::value(*one->id)));
      }
      throw CLI::ValidationError(
          "SERVICE.INSTANCE",
          all.empty() ? fmt::format("the description of {} has no instance: write {}.ID", name, name)
                      : fmt::format("{} has several instances: write {}", name, fmt::join(ids, " or ")));
    }
    target.service.instance = *all.front()->id;
  }
  const auto at = std::ranges::find(all, std::optional{target.service.instance}, &describe::Instance::id);
  target.instance = at != all.end() ? *at : nullptr;
  // Without an instance, what the only one of the description says.
  const describe::Instance* const says = target.instance != nullptr ? target.instance
                                         : all.size() == 1          ? all.front()
                                                                    : nullptr;
  target.major = says != nullptr && says->major ? *says->major : service.major;
  target.minor = service.minor;
}

}  // namespace

void InterfaceOptions::add_to(CLI::App& command, const std::string& also) {
  command
      .add_option("--interfaces", files_,
                  "Interface descriptions (FIDL with FDEPL, ARXML, vsomeip JSON; files or folders): " + also)
      ->type_name("FILE");
}

void InterfaceOptions::load() {
  if (files_.empty()) {
    return;
  }
  std::vector<documents::Problem> problems;
  const std::vector<describe::SourceText> texts = describe::load_sources(files_, problems);
  print(problems);
  const auto is_error = [](const documents::Problem& one) {
    return one.severity == documents::Problem::Severity::error;
  };
  if (const auto first = std::ranges::find_if(problems, is_error); first != problems.end()) {
    throw CLI::ValidationError(
        "--interfaces",
        fmt::format("{} cannot be read (it takes all that follows: write it behind the other arguments)",
                    first->file));
  }
  describe::LoadedSystem loaded = describe::load_system(texts, files_);
  print(loaded.system.problems);
  if (!loaded.system.good) {
    throw CLI::ValidationError("--interfaces", "the descriptions are not good");
  }
  for (const std::string& line : {loaded.open_ids.moved, loaded.open_ids.kept, loaded.open_ids.chosen}) {
    if (!line.empty()) {
      fmt::print(stderr, "note: {}\n", line);
    }
  }
  interfaces_ = std::make_unique<const describe::Interfaces>(std::move(loaded.system));
}

Target parse_target(const describe::Interfaces* interfaces, const std::string& text,
                    UnnamedInstance unnamed) {
  Target target;
  const bool any_instance = unnamed != UnnamedInstance::only;
  // Who writes Door.* wants any.
  const bool says_any = any_instance && (text.ends_with(".*") || text.find(".*.") != std::string::npos);
  const UnnamedInstance wanted = says_any ? UnnamedInstance::any : unnamed;
  if (interfaces == nullptr) {
    target.service = parse_service(text, any_instance);
    return target;
  }
  if (is_id(text)) {
    target.service = parse_service(text, true);
    if (const describe::Service* const service = interfaces->service(target.service.service)) {
      target.described = static_cast<std::size_t>(service - interfaces->model().services.data());
      complete(*interfaces, target, wanted);
    } else if (!any_instance) {
      target.service = parse_service(text, false);
    }
    return target;
  }
  const auto meaning = interfaces->find(text);
  if (!meaning) {
    throw CLI::ValidationError("SERVICE", meaning.error());
  }
  const std::optional<someip::ServiceId> id = interfaces->model().services[meaning->service].id;
  if (!id) {
    throw CLI::ValidationError("SERVICE", fmt::format("{} has no id", interfaces->name_of(meaning->service)));
  }
  target.service = {.service = *id, .instance = meaning->instance.value_or(someip::any_instance)};
  target.described = meaning->service;
  target.elements = meaning->elements;
  complete(*interfaces, target, wanted);
  return target;
}

std::vector<const describe::ServiceElement*> add_element(const describe::Interfaces* interfaces,
                                                         Target& target, const std::string& name,
                                                         const std::string& text) {
  std::vector<const describe::ServiceElement*> added;
  if (interfaces == nullptr || !target.described || is_id(text)) {
    const someip::MethodId id{parse_id(name, text)};
    if (interfaces != nullptr && target.described) {
      const auto* const element = interfaces->element(target.service.service, target.major, id);
      if (element != nullptr) {
        added.push_back(element);
      }
    }
  } else {
    auto meaning = interfaces->find_in(*target.described, text);
    if (!meaning) {
      const auto whole = interfaces->find(text);
      if (!whole || whole->service != *target.described || whole->elements.empty()) {
        throw CLI::ValidationError(name, meaning.error());
      }
      meaning = whole;
    }
    added = meaning->elements;
  }
  target.elements.insert(target.elements.end(), added.begin(), added.end());
  return added;
}

std::string with_names(const describe::Interfaces* interfaces, const std::string& line) {
  if (interfaces == nullptr) {
    return line;
  }
  return documents::with_ids_replaced(line, [interfaces](const documents::IdsInLine& ids) {
    const someip::ServiceId id{ids.service};
    const describe::Service* const service = interfaces->service(id);
    std::string text = ids.eventgroup_text;
    if (service != nullptr && ids.eventgroup) {
      const std::string title = describe::title_of(service, someip::EventgroupId{*ids.eventgroup}).text;
      text += title.empty() ? "" : " (" + title + ")";
    }
    return text + ids.between + (service == nullptr ? ids.service_text : interfaces->name_of(id)) + "." +
           ids.instance_text;
  });
}

std::function<void(const std::string& line)> named_log(const describe::Interfaces* interfaces, bool quiet) {
  return
      [log = Session::log(quiet), interfaces](const std::string& line) { log(with_names(interfaces, line)); };
}

std::function<void(const std::string& line)> named_warning(const describe::Interfaces* interfaces) {
  return [interfaces](const std::string& line) { Session::warn(with_names(interfaces, line)); };
}

}  // namespace trestle::cli
