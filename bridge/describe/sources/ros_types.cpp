#include "bridge/describe/sources/ros_types.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>

#include "bridge/describe/raise.hpp"
#include "bridge/describe/ros_names.hpp"
#include "bridge/documents/section.hpp"
#include "bridge/messages/types/parsers.hpp"
#include "bridge/messages/types/type_faults.hpp"
#include "bridge/messages/types/type_files.hpp"

namespace trestle::describe {
namespace {

namespace fs = std::filesystem;
using messages::InterfaceKind;
using messages::InterfaceName;
using messages::TypeError;

documents::Problem problem_of(const TypeError& fault, const std::string& file) {
  return {
      .file = fault.file.empty() ? file : fault.file, .mark = {fault.line, fault.column}, .text = fault.text};
}

class RosReading {
 public:
  explicit RosReading(messages::TypeLibrary& library) : library_{library} {}

  Reading read(std::span<const RosInterface> interfaces) {
    for (const RosInterface& one : interfaces) {
      told_.insert(one.place);  // by the reader that has its text
    }
    for (const RosInterface& one : interfaces) {
      add(one);
    }
    std::erase_if(made_, [&](const Made& one) { return one.only_if_unused && used_.contains(one.type); });
    for (Made& one : made_) {
      one.service.name = taken_[one.service.scope].take(one.service.name, "");
      reading_.model.services.push_back(std::move(one.service));
    }
    place_types();
    return std::move(reading_);
  }

 private:
  struct Made {
    Service service;
    std::string type;
    bool only_if_unused = false;
  };

  void add(const RosInterface& wanted) {
    place_ = wanted.place.empty() ? wanted.type : wanted.place;
    auto name = messages::interface_name(wanted.type);
    if (!name) {
      error({.file = place_,
             .text = fmt::format("{} is no name of a ROS type: expected pkg/msg/Type, pkg/srv/Type or "
                                 "pkg/action/Type",
                                 documents::quote(wanted.type))});
      return;
    }
    const bool has_kind = std::ranges::count(wanted.type, '/') == 2;
    std::vector<InterfaceKind> kinds{name->kind};
    if (!has_kind) {
      kinds = {InterfaceKind::message, InterfaceKind::service, InterfaceKind::action};
    }
    std::optional<TypeError> first;
    for (const InterfaceKind kind : kinds) {
      name->kind = kind;
      const auto fault = add(*name, wanted);
      if (!fault) {
        return;
      }
      first = first ? first : fault;
    }
    error(*first);
  }

  /// @return why there is none.
  std::optional<TypeError> add(const InterfaceName& name, const RosInterface& wanted) {
    Service service;
    service.scope = name.package;
    service.from_ros = true;
    // Named after what it is made of. A type and an interface of FIDL may not have one name.
    const std::string base = wanted.name.empty() ? name.type : ros_type_name(wanted.name);
    const std::string called = wanted.name.empty() ? "/" + ros_field_name(name.type) : wanted.name;
    const std::string last = ros_field_name(called.substr(called.rfind('/') + 1));
    service.name = base + "Service";
    service.place.file = static_cast<std::uint32_t>(reading_.model.files.size());
    std::optional<TypeError> fault;
    switch (name.kind) {
      case InterfaceKind::message:
        fault = event(service, last, called, name.full());
        break;
      case InterfaceKind::service:
        fault = method(service, last, called, name.full());
        break;
      case InterfaceKind::action: {
        // The parts of an action, by the names that ROS gives them.
        const std::string action = called + "/_action/";
        fault = method(service, "send_goal", action + "send_goal", name.full() + "_SendGoal");
        fault = fault ? fault
                      : method(service, "cancel_goal", action + "cancel_goal", "action_msgs/srv/CancelGoal");
        fault =
            fault ? fault : method(service, "get_result", action + "get_result", name.full() + "_GetResult");
        fault =
            fault ? fault : event(service, "feedback", action + "feedback", name.full() + "_FeedbackMessage");
        fault =
            fault ? fault : event(service, "status", action + "status", "action_msgs/msg/GoalStatusArray");
        break;
      }
    }
    if (fault) {
      return fault;
    }
    reading_.model.files.push_back(place_);
    made_.push_back({std::move(service), name.full(), wanted.only_if_unused});
    return std::nullopt;
  }

  std::optional<TypeError> event(Service& service, std::string name, std::string called,
                                 const std::string& type) {
    const auto tree = library_.resolve(type);
    if (!tree) {
      return tree.error();
    }
    note_used(*tree);
    Event event{.name = std::move(name), .ros_name = std::move(called), .place = service.place};
    event.payload.values = {value_of(reading_.model, raise(types_, *tree), "data")};
    service.events.push_back(std::move(event));
    return std::nullopt;
  }

  std::optional<TypeError> method(Service& service, std::string name, std::string called,
                                  const std::string& type) {
    const auto types = library_.resolve_service(type);
    if (!types) {
      return types.error();
    }
    note_used(types->request);
    note_used(types->response);
    Method method = raise(types_, *types, std::move(name));
    method.ros_name = std::move(called);
    method.place = service.place;
    service.methods.push_back(std::move(method));
    return std::nullopt;
  }

  /// Types stand in the files of their messages, as far as these are sources.
  void place_types() {
    Model& model = reading_.model;
    std::map<std::string_view, std::uint32_t> files;
    for (std::size_t i = 0; i < model.files.size(); ++i) {
      files.emplace(model.files[i], static_cast<std::uint32_t>(i));
    }
    for (Type& type : model.types) {
      const auto name = files_of_types_.find(type.ros_name);
      const auto file = name == files_of_types_.end() ? files.end() : files.find(name->second);
      if (file != files.end()) {
        type.place.file = file->second;
        for (Value& member : type.members) {
          member.place.file = file->second;
        }
      }
    }
  }

  void note_used(const messages::TypeTree& tree) {
    for (const messages::MessageDefinition& message : tree.messages) {
      files_of_types_.emplace(message.name, message.file);
    }
    for (documents::Problem& warning : messages::encoding_warnings(tree, told_)) {
      reading_.problems.push_back(std::move(warning));
    }
    for (std::size_t i = 0; i + 1 < tree.messages.size(); ++i) {
      used_.insert(tree.messages[i].name);
    }
  }

  void error(const TypeError& fault) { reading_.problems.push_back(problem_of(fault, place_)); }

  messages::TypeLibrary& library_;
  Reading reading_;
  RaisedTypes types_{reading_.model};
  std::string place_;
  std::vector<Made> made_;
  std::set<std::string, std::less<>> used_;  ///< messages that others have in them
  std::map<std::string, std::string, std::less<>> files_of_types_;
  std::set<std::string> told_;              ///< files that are not UTF-8, and others that need no warning
  std::map<std::string, FreeNames> taken_;  ///< by scope
};

/// Files whose texts are there already.
class GivenFiles : public messages::TypeSource {
 public:
  struct File {
    std::string name;
    std::string_view text;
  };
  std::map<std::string, File, std::less<>> files{};  ///< by the full names of their interfaces

  [[nodiscard]] tl::expected<std::optional<messages::InterfaceMessages>, TypeError> find(
      const InterfaceName& interface) const override {
    const auto found = files.find(interface.full());
    if (found == files.end()) {
      return std::nullopt;
    }
    const auto& [name, text] = found->second;
    if (text.size() > messages::max_msg_file_bytes) {
      return tl::unexpected{
          TypeError{name, 0, 0, fmt::format("larger than {} bytes", messages::max_msg_file_bytes)}};
    }
    return name.ends_with(".idl") ? messages::parse_idl(text, interface, name)
                                  : messages::parse_interface(text, interface, name);
  }
};

/// The names of the first two modules of an `.idl` file, "pkg/srv"; empty where they are not found.
std::string modules_of(std::string_view text) {
  std::string modules;
  std::size_t at = 0;
  for (int i = 0; i < 2; ++i) {
    at = text.find("module", at);
    if (at == std::string_view::npos) {
      return {};
    }
    at += 6;
    const std::size_t begin = text.find_first_not_of(" \t\r\n", at);
    std::size_t end = begin;
    while (end < text.size() &&
           (std::isalnum(static_cast<unsigned char>(text[end])) != 0 || text[end] == '_')) {
      ++end;
    }
    if (begin == std::string_view::npos || begin == at || end == begin) {
      return {};
    }
    modules += (i == 0 ? "" : "/") + std::string{text.substr(begin, end - begin)};
    at = end;
  }
  return modules;
}

struct FileName {
  InterfaceName interface;
  fs::path packages;  ///< the folder that its package is in
};

std::optional<FileName> name_of(const SourceText& file) {
  // Without the current folder, "Type.msg" would have no package.
  std::error_code error;
  fs::path path = fs::absolute(file.name, error).lexically_normal();
  path = error ? fs::path{file.name} : path;
  const std::string type = path.stem().string();
  const std::string extension = path.extension().string();
  const fs::path folder = path.parent_path();
  const std::string kind = folder.filename().string();
  const bool is_usual = kind == "msg" || kind == "srv" || kind == "action";
  const fs::path package = is_usual ? folder.parent_path() : folder;
  std::string name = package.filename().string();
  if (!messages::interface_name(name + "/Any")) {
    const std::string mended = ros_package_name(name);
    name = mended.empty() ? "interfaces" : mended;
  }
  name += "/" + (extension == ".idl" ? (is_usual ? kind : std::string{"msg"}) : extension.substr(1));
  if (const std::string modules = extension == ".idl" ? modules_of(file.text) : std::string{};
      !modules.empty()) {
    name = modules;
  }
  const auto interface = messages::interface_name(name + "/" + type);
  if (!interface) {
    return std::nullopt;
  }
  return FileName{*interface, package.parent_path()};
}

}  // namespace

Reading describe_ros(std::span<const RosInterface> interfaces, messages::TypeLibrary& library) {
  return RosReading{library}.read(interfaces);
}

std::optional<std::string> ros_package_folder(const SourceText& file) {
  const auto name = name_of(file);
  const std::string folder = name ? name->packages.string() : std::string{};
  return folder.empty() ? std::nullopt : std::optional{folder};
}

std::optional<std::string> ros_file_path(const SourceText& file) {
  const auto name = name_of(file);
  return name ? std::optional{name->interface.full() + fs::path{file.name}.extension().string()}
              : std::nullopt;
}

Reading read_ros_files(std::span<const SourceText> files, const std::vector<std::string>& folders,
                       bool look_beside) {
  std::vector<documents::Problem> problems;
  const auto given = std::make_shared<GivenFiles>();
  std::vector<RosInterface> interfaces;
  messages::TypePlaces places{.folders = folders, .described = {given}};
  for (const SourceText& file : files) {
    const auto name = name_of(file);
    if (!name) {
      problems.push_back({.file = file.name,
                          .mark = {},
                          .text =
                              "is not named like a ROS type: expected pkg/msg/Type.msg, with letters, digits "
                              "and underscores"});
      continue;
    }
    // One that is there as an .idl file too is read once.
    if (given->files.emplace(name->interface.full(), GivenFiles::File{file.name, file.text}).second) {
      interfaces.push_back({.type = name->interface.full(), .place = file.name, .only_if_unused = true});
    }
    const std::string folder = name->packages.string();
    if (look_beside && !folder.empty() && std::ranges::find(places.folders, folder) == places.folders.end()) {
      places.folders.push_back(folder);
    }
  }
  // All that is wrong in a file at once; the first of it comes again from each type that needs the file.
  using Told = std::tuple<std::string, int, int, std::string>;
  const auto key_of = [](const documents::Problem& one) {
    return Told{one.file, one.mark.line, one.mark.column, one.text};
  };
  std::set<Told> told;
  std::erase_if(interfaces, [&](const RosInterface& one) {
    const auto name = messages::interface_name(one.type);
    const GivenFiles::File& file = given->files.at(one.type);
    const std::vector<TypeError> faults = messages::faults_of(file.text, *name, file.name);
    for (const TypeError& fault : faults) {
      problems.push_back(problem_of(fault, file.name));
      told.insert(key_of(problems.back()));
    }
    return !faults.empty();
  });
  messages::TypeLibrary library = messages::TypeLibrary::in(places);
  Reading reading = describe_ros(interfaces, library);
  std::erase_if(reading.problems, [&](const documents::Problem& one) { return told.contains(key_of(one)); });
  reading.problems.insert(reading.problems.begin(), problems.begin(), problems.end());
  return reading;
}

}  // namespace trestle::describe
