// What is written is read as it was: each interface of interfaces.txt goes through each target that has a
// reader, and what differs then is in the list of what the target does not carry.
#include <gmock/gmock.h>
#include <unistd.h>

#include <cctype>
#include <filesystem>
#include <fstream>
#include <memory>
#include <set>
#include <sstream>

#include "bridge/carry/config/describe_routes.hpp"
#include "bridge/describe/compare.hpp"
#include "bridge/describe/read/fidl/keys.hpp"
#include "bridge/describe/read/fidl/read_fidl.hpp"
#include "bridge/describe/sources/sources.hpp"
#include "bridge/describe/system.hpp"
#include "bridge/generate/targets.hpp"
#include "test/bridge/generate/interfaces.hpp"
#include "test/bridge/generate/model_facts.hpp"

namespace trestle::generate::round_trip_test {
namespace {

using ::testing::IsEmpty;
namespace fs = std::filesystem;

std::string text_of(const std::vector<documents::Problem>& problems) {
  std::string text;
  for (const documents::Problem& one : problems) {
    text += to_string(one) + "\n";
  }
  return text;
}

describe::System system_of(describe::Reading reading) {
  describe::IdLock lock;
  describe::System system = make_system(std::move(reading), lock);
  EXPECT_TRUE(lock.services.empty()) << "ids are missing: " << to_text(lock);
  return system;
}

/// What became of a model.
struct Carried {
  std::string what;  ///< "fidl"
  describe::System after;
  std::vector<describe::NotCarried> not_carried;
  std::string texts{};  ///< of the message files beside a route file
};

std::vector<describe::SourceText> sources_of(const describe::Written& written) {
  std::vector<describe::SourceText> sources;
  for (const describe::TextFile& file : written.files) {
    sources.push_back({file.path, file.text});
  }
  return sources;
}

Carried by_text(const describe::System& system, const char* name) {
  const describe::Written written = target(name)->write(system, {});
  return {name, system_of(describe::read_sources(sources_of(written), {})), written.not_carried};
}

/// As a route file with the packages of its types.
Carried by_routes(const describe::System& system) {
  const fs::path folder = fs::path{testing::TempDir()} / ("round_trip_test_" + std::to_string(getpid()));
  fs::remove_all(folder);
  TargetOptions options;
  options.routes.type_paths = {"."};
  std::vector<describe::NotCarried> lost;
  std::string texts;
  for (const char* name : {"msg", "routes"}) {
    const describe::Written written = target(name)->write(system, options);
    lost.insert(lost.end(), written.not_carried.begin(), written.not_carried.end());
    for (const describe::TextFile& file : written.files) {
      fs::create_directories((folder / file.path).parent_path());
      std::ofstream{folder / file.path} << file.text;
      texts += file.text;
    }
  }
  Carried carried{"routes", system_of(carry::describe_routes((folder / "bridge.yaml").string())),
                  std::move(lost), std::move(texts)};
  fs::remove_all(folder);
  return carried;
}

/// What a line of the list is about, and the rules of the changes that it explains.
struct Explains {
  std::string_view what;  ///< what the line begins with
  std::set<std::string_view> rules;
};

const std::vector<Explains>& explanations() {
  static const std::vector<Explains> all{
      {"its minor version", {"service-minor"}},
      {"a CRC of # byte", {"event-removed", "method-removed", "field-removed"}},
      {"all eventgroups but the first one", {"event-eventgroups"}},
      {"getter, setter and notifier by different transports", {"transport"}},
      {"its getter by", {"transport"}},
      {"its setter by", {"transport"}},
      {"its name: it is", {"type-renamed"}},
      {"getter, setter and notifier with different segments", {"segmentation"}},
      {"other segments of the answer", {"segmentation"}},
      {"that its first argument out is an error",
       {"error-changed", "value-renamed", "value-moved", "type-changed", "value-appended"}},
      {"that the selector of its union is before the length", {"layout"}},
      {"the fixed size of its union", {"layout"}},
      {"its # bits", {"layout"}},
      {"its name: who reads the file calls it", {"service-renamed"}},
      {"its package: ", {"service-renamed"}},
      {"the names of its members, which are as ROS has them: ",
       {"event-renamed", "method-renamed", "field-renamed"}},
      {"the name of its argument: ", {"value-renamed"}},
      {"its name, which ROS has otherwise: ", {"type-renamed"}},
      {"names of its members, which ROS has otherwise: ", {"value-renamed"}},
      {"names of enumerators, which as constants are in capitals: ", {"enumerator-renamed"}},
  };
  return all;
}

/// The names of all types that a payload is made of: "Side", and "car.Car.Side".
void add_types(const describe::Model& model, describe::TypeIndex index, std::set<std::string>& names,
               std::set<describe::TypeIndex>& seen) {
  if (index == describe::no_type || !seen.insert(index).second) {
    return;
  }
  const describe::Type& type = model.at(index);
  if (!type.name.empty()) {
    names.insert(describe::full_name(type.scope, type.name));
  }
  for (const describe::Value& member : type.members) {
    add_types(model, member.type, names, seen);
  }
  for (const describe::TypeIndex part : {type.base, type.element.type, type.key.type, type.variant_of}) {
    add_types(model, part, names, seen);
  }
}

/// Of a member, by its name: "Car.open".
std::set<std::string> types_of(const describe::Model& model, const std::string& member) {
  std::set<std::string> names;
  std::set<describe::TypeIndex> seen;
  const auto add = [&](const describe::Service& service, const std::string& name,
                       std::initializer_list<const describe::Payload*> payloads) {
    for (const describe::Payload* const payload : payloads) {
      for (const describe::Value& value : payload->values) {
        if (service.name + "." + name == member) {
          add_types(model, value.type, names, seen);
        }
      }
    }
  };
  for (const describe::Service& service : model.services) {
    for (const describe::Event& one : service.events) {
      add(service, one.name, {&one.payload});
    }
    for (const describe::Field& one : service.fields) {
      add(service, one.name, {&one.payload});
    }
    for (const describe::Method& one : service.methods) {
      add(service, one.name, {&one.request, &one.response});
      if (service.name + "." + one.name == member) {
        add_types(model, one.error, names, seen);
      }
    }
  }
  return names;
}

/// Whether `inner` is `outer` or something in it.
bool is_in(const std::string& inner, const std::string& outer) {
  return inner == outer || inner.starts_with(outer + ".") || inner.starts_with(outer + "[");
}

/// "car.Car.open" of "/car/Car/open", and of what the lists of ARXML call it otherwise.
std::string dotted(std::string name) {
  std::ranges::replace(name, '/', '.');
  name = name.starts_with('.') ? name.substr(1) : name;
  const auto replaced = [&](std::string_view what, std::string_view by) {
    if (const std::size_t at = name.find(what); at != std::string::npos) {
      name.replace(at, what.size(), by);
    }
  };
  replaced("Trestle.Arguments.Car_", "car.Car.");
  replaced("car.Car_Types.", "car.Car.");
  return name;
}

/// "its # bits" of "its 3 bits".
std::string without_numbers(const std::string& text) {
  std::string without;
  for (const char one : text) {
    if (std::isdigit(static_cast<unsigned char>(one)) == 0) {
      without += one;
    } else if (!without.ends_with('#')) {
      without += '#';
    }
  }
  return without;
}

/// Whether a line of the list is about the element of the change, or about a type of it, and about what
/// changed.
bool is_listed(const describe::Change& change, const describe::Model& before,
               const std::vector<describe::NotCarried>& list) {
  const std::string member = change.element.substr(0, change.element.find('.', change.element.find('.') + 1));
  std::set<std::string> types;
  for (const std::string& name : types_of(before, member)) {
    types.insert(dotted(name));
  }
  return std::ranges::any_of(list, [&](const describe::NotCarried& one) {
    const std::string element = dotted(one.element);
    const bool is_about_it =
        is_in(change.element, element) || is_in("car." + change.element, element) ||
        is_in(change.element, "Car." + element) ||
        std::ranges::any_of(types, [&](const std::string& type) { return is_in(element, type); });
    return is_about_it && std::ranges::any_of(explanations(), [&](const Explains& explains) {
             return without_numbers(one.what).starts_with(explains.what) &&
                    explains.rules.contains(change.rule->id);
           });
  });
}

/// What a line of the list is about, and the ends of the facts that it explains.
const std::vector<Explains>& explanations_of_facts() {
  static const std::vector<Explains> all{
      {"its times of collecting several messages", {"debounce", "retention"}},
      {"that messages wait up to # ms for others", {"retention"}},
      {"a CRC of # byte", {"retention", "eventgroup"}},
      {"a time that FDEPL has no key for", {"debounce", "retention"}},
      {"times in", {"debounce", "retention"}},
      {"its timeout", {"timeout"}},
      {"its cycle", {"cycle"}},
      {"a cycle", {"cycle"}},
      {"selective", {"selective"}},
      {"that it is selective", {"selective"}},
      {"its selector", {"selector"}},
      {"its least and greatest value", {"least", "most"}},
      {"limits of an integer that is not Int#", {"least", "most"}},
      {"its invalid value", {"invalid"}},
      {"its default value", {"default"}},
      {"a default value", {"default"}},
      {"the constant", {"value"}},
      {"where it is", {"address", "port"}},
      {"its TCP port", {"port"}},
      {"its multicast groups", {"group of #"}},
      {"its times of service discovery", {"timing"}},
      {"settings of service discovery", {"timing"}},
      {"load balancing", {"priority", "weight"}},
      {"configuration options", {"option"}},
  };
  return all;
}

/// Whether a line of the list is about the element of the fact, its service or its types, and about the fact.
bool is_listed(const std::string& key, const Fact& fact, const describe::Model& before,
               const std::vector<describe::NotCarried>& list) {
  std::set<std::string> types;
  for (const std::string& name : types_of(before, fact.element)) {
    types.insert(dotted(name));
  }
  const std::string said = without_numbers(key);
  return std::ranges::any_of(list, [&](const describe::NotCarried& one) {
    const std::string element = dotted(one.element);
    // "Car.level.get" and "Car.load (answer)" are parts of members.
    const std::string whole = element.substr(0, element.find(" ("));
    const bool is_about_it =
        whole == "Car" || whole == "car.Car" || one.element == fact.element || is_in(whole, fact.element) ||
        is_in(whole, "car." + fact.element) ||
        std::ranges::any_of(types, [&](const std::string& type) { return is_in(whole, type); });
    return is_about_it && std::ranges::any_of(explanations_of_facts(), [&](const Explains& explains) {
             const bool is_usual_time = one.what.starts_with("that messages wait up to 5 ms");
             return without_numbers(one.what).starts_with(explains.what) &&
                    (!is_usual_time || fact.value == "5 ms") &&
                    std::ranges::any_of(explains.rules, [&](std::string_view part) {
                      return said.find(part) != std::string::npos;
                    });
           });
  });
}

/// "Car.curveChanged" by "Car.curve_changed", which is what changes call it where an event, a method or a
/// field has another name now.
using OldNames = std::map<std::string, std::string, std::less<>>;

OldNames old_names(const std::vector<describe::Change>& changes) {
  static const std::set<std::string_view> rules{"event-renamed", "method-renamed", "field-renamed"};
  const auto last = [](const std::string& name) { return name.substr(name.rfind('.') + 1); };
  OldNames names;
  for (const describe::Change& one : changes) {
    const std::size_t dot = one.element.find('.');
    if (dot != std::string::npos && rules.contains(one.rule->id)) {
      const std::string service = one.element.substr(0, dot + 1);
      names.emplace(service + last(one.after), service + last(one.before));
    }
  }
  return names;
}

/// "Car.curveChanged.data" of "Car.curve_changed.data".
std::string as_before(const std::string& element, const OldNames& names) {
  const std::size_t dot = element.find('.');
  const std::size_t end =
      dot == std::string::npos ? dot : std::min(element.find('.', dot + 1), element.size());
  const auto found = dot == std::string::npos ? names.end() : names.find(element.substr(0, end));
  return found == names.end() ? element : found->second + element.substr(end);
}

/// A scope of AUTOSAR is a path: car.Door and /car/Door are one name.
bool is_same_by_rule(const describe::Change& change) {
  if (change.rule->wire != describe::Impact::none ||
      !std::string_view{change.rule->id}.ends_with("-renamed")) {
    return false;
  }
  const auto as_path = [](std::string name) {
    std::ranges::replace(name, '.', '/');
    return name.starts_with('/') ? name : "/" + name;
  };
  return as_path(change.before) == as_path(change.after);
}

void expect_nothing_lost(const Interface& one, const describe::System& before, const Carried& carried) {
  SCOPED_TRACE(one.name + " by " + carried.what);
  EXPECT_TRUE(carried.after.good) << text_of(carried.after.problems);
  std::string list;
  for (const describe::NotCarried& lost : carried.not_carried) {
    list += lost.element + ": " + lost.what + "\n";
  }
  const std::vector<describe::Change> changes = describe::compare(before.model, carried.after.model);
  const OldNames names = old_names(changes);
  for (describe::Change change : changes) {
    change.element = as_before(change.element, names);
    if (!is_same_by_rule(change) && !is_listed(change, before.model, carried.not_carried)) {
      ADD_FAILURE() << change.rule->id << " " << change.element << ": '" << change.before << "' -> '"
                    << change.after << "'\nnot carried:\n"
                    << list;
    }
  }
  // And what is no matter of bytes and members.
  Facts after = FactsOf{carried.after.model}.run();
  for (const auto& [key, fact] : FactsOf{before.model}.run()) {
    // No route needs the message of constants.
    if (const std::string of = "constant "; key.starts_with(of)) {
      const std::string name = key.substr(of.size(), key.rfind(' ') - of.size());
      if (carried.texts.find(" " + name + "=" + fact.value + "\n") != std::string::npos) {
        continue;
      }
    }
    const std::string& now = after[key].value;
    if (now != fact.value && !is_listed(key, fact, before.model, carried.not_carried)) {
      ADD_FAILURE() << key << " of " << fact.element << ": '" << fact.value << "' -> '" << now
                    << "'\nnot carried:\n"
                    << list;
    }
  }
}

TEST(RoundTrips, LoseNothingThatIsNotInTheList) {
  const std::vector<Interface> all = interfaces();
  EXPECT_GE(all.size(), 30U);
  for (const Interface& one : all) {
    const describe::System before = system_of(describe::read_sources(texts_of(one), {}));
    EXPECT_TRUE(before.good) << one.name << "\n" << text_of(before.problems);
    if (!before.good) {
      continue;
    }
    expect_nothing_lost(one, before, by_text(before, "fidl"));
    expect_nothing_lost(one, before, by_text(before, "arxml"));
    expect_nothing_lost(one, before, by_routes(before));
    // And from there on, by the other way.
    const Carried arxml = by_text(before, "arxml");
    expect_nothing_lost(one, arxml.after, by_text(arxml.after, "fidl"));
  }
}

TEST(RoundTrips, HaveEveryKeyOfTheDeploymentSpecifications) {
  std::ifstream in{test::source_dir() + "/test/bridge/generate/interfaces.txt"};
  const std::string text{std::istreambuf_iterator<char>{in}, {}};
  std::vector<std::string> missing;
  for (const std::string& key : describe::fidl::known_keys()) {
    if (text.find(key + " =") == std::string::npos) {
      missing.push_back(key);
    }
  }
  EXPECT_THAT(missing, IsEmpty());
}

/// Each kind of thing that a target does not carry has a line in the document.
TEST(RoundTrips, AreDescribedInTheDocument) {
  std::ifstream in{test::source_dir() + "/docs/describe.md"};
  const std::string document{std::istreambuf_iterator<char>{in}, {}};
  const std::size_t begin = document.find("## What is not carried");
  ASSERT_NE(begin, std::string::npos);
  const std::string section = document.substr(begin, document.find("\n## ", begin + 3) - begin);
  std::set<std::string> unknown;
  for (const Interface& one : interfaces()) {
    const describe::System before = system_of(describe::read_sources(texts_of(one), {}));
    for (const char* name : {"routes", "msg", "fidl", "arxml", "vsomeip", "wireshark"}) {
      for (const describe::NotCarried& lost : target(name)->write(before, {}).not_carried) {
        // The words before names and numbers: "its timeout", "SomeIpPriority".
        std::string words;
        std::istringstream in_words{lost.what.substr(0, lost.what.find_first_of(":'"))};
        for (std::string word; in_words >> word;) {
          if (std::isdigit(static_cast<unsigned char>(word[0])) != 0 || word == "=") {
            break;
          }
          words += (words.empty() ? "" : " ") + word;
        }
        if (section.find(words) == std::string::npos) {
          unknown.insert(std::string{name} + ": " + words + "   (" + lost.what + ")");
        }
      }
    }
  }
  EXPECT_THAT(unknown, IsEmpty());
}

/// `trestle generate` does not lower what no target asks for.
TEST(Targets, OfWhichMostNeedNoRosTypes) {
  const std::vector<Interface> all = interfaces();
  for (const Interface& one : {all.front(), all.back()}) {
    const auto system = [&](bool lowers) {
      describe::IdLock lock;
      return make_system(describe::read_sources(texts_of(one), {}), lock, {.lowers = lowers});
    };
    const describe::System full = system(true);
    const describe::System bare = system(false);
    ASSERT_FALSE(full.lowered.definitions.empty());
    EXPECT_TRUE(bare.good && bare.lowered.definitions.empty());
    for (const Target& each : targets()) {
      const describe::Written expected = each.write(full, {});
      const describe::Written written = each.write(bare, {});
      const bool is_same = std::ranges::equal(expected.files, written.files, {}, &describe::TextFile::text,
                                              &describe::TextFile::text);
      EXPECT_EQ(is_same, !each.needs_lowered) << each.name;
    }
  }
}

}  // namespace
}  // namespace trestle::generate::round_trip_test
