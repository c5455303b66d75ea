#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>

#include "bridge/cli/exit_status.hpp"
#include "bridge/cli/terminal.hpp"
#include "bridge/describe/compare.hpp"
#include "bridge/describe/join.hpp"
#include "bridge/describe/member_ids.hpp"
#include "bridge/documents/problems.hpp"
#include "bridge/generate/generate_commands.hpp"
#include "bridge/generate/source_options.hpp"

namespace trestle::generate {
namespace {

using describe::Change;
using describe::Impact;

struct DiffArguments {
  SourceReaders readers;
  std::string before;
  std::string after;
  bool json = false;
  bool rules = false;
};

const char* word(Impact impact) {
  return impact == Impact::none ? "same" : impact == Impact::compatible ? "compatible" : "BREAKS";
}

describe::System read_one(const std::string& source, const SourceReaders& readers) {
  SourceArguments arguments{readers};
  arguments.sources = {source};
  arguments.options.lowers = false;     // what is compared is the model
  arguments.options.allocates = false;  // ids that nobody gave cannot change
  return arguments.read();
}

void print_rules() {
  for (const describe::ChangeRule& rule : describe::change_rules()) {
    fmt::print("{:30} wire {:10} code {:10} {}\n", rule.id, word(rule.wire), word(rule.api), rule.meaning);
  }
}

void print_json(const std::vector<Change>& changes, const describe::System& old,
                const describe::System& now) {
  nlohmann::ordered_json all = nlohmann::ordered_json::array();
  for (const Change& change : changes) {
    const auto impact = [](Impact one) {
      return one == Impact::none ? "none" : one == Impact::compatible ? "compatible" : "breaking";
    };
    all.push_back({{"rule", change.rule->id},
                   {"element", change.element},
                   {"also", change.also},
                   {"before", change.before},
                   {"after", change.after},
                   {"wire", impact(change.rule->wire)},
                   {"code", impact(change.rule->api)},
                   {"old_place", describe::to_string(old.model, change.old_place)},
                   {"new_place", describe::to_string(now.model, change.new_place)}});
  }
  fmt::print("{}\n", documents::printable_json(
                         all.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace)));
}

void print_text(const std::vector<Change>& changes, const describe::System& now) {
  const cli::Colours colour = cli::colours_for(STDOUT_FILENO);
  for (const Change& change : changes) {
    const bool breaks = change.rule->wire == Impact::breaking;
    const std::string place = describe::to_string(now.model, change.new_place);
    fmt::print("{}{}{}{}{} {}", place, place.empty() ? "" : ": ", breaks ? colour.red : "", change.rule->id,
               colour.off, change.element);
    if (!change.before.empty() || !change.after.empty()) {
      fmt::print(": {} -> {}", change.before.empty() ? "nothing" : change.before,
                 change.after.empty() ? "nothing" : change.after);
    }
    fmt::print(" (wire: {}, code: {}; {})\n", word(change.rule->wire), word(change.rule->api),
               change.rule->meaning);
    if (!change.also.empty()) {
      fmt::print("    and so in: {}\n", fmt::join(change.also, ", "));
    }
  }
  const auto breaking = std::ranges::count_if(
      changes, [](const Change& change) { return change.rule->wire == Impact::breaking; });
  const auto in_code = std::ranges::count_if(
      changes, [](const Change& change) { return change.rule->api == Impact::breaking; });
  fmt::print("{}changes: {}, of these {} break the wire and {} break source code{}\n",
             breaking > 0 ? colour.red : colour.green, changes.size(), breaking, in_code, colour.off);
}

/// Services that have an id which nobody gave.
std::set<std::string> with_open_ids(const describe::Model& model) {
  std::set<std::string> names;
  for (const describe::Service& service : model.services) {
    bool is_open = !service.id;
    const auto look = [&is_open](const std::string&, const char*, const auto& id, const auto&...) {
      is_open = is_open || !id;
    };
    describe::each_id(service, describe::IdSort::called, look);
    describe::each_id(service, describe::IdSort::sent, look);
    if (is_open) {
      names.insert(service.name);
    }
  }
  return names;
}

/// Else "changes: 0" would look as if all ids were the same.
void tell_of_open_ids(const std::string& source, const describe::Model& model) {
  const std::set<std::string> names = with_open_ids(model);
  if (!names.empty()) {
    fmt::print("ids not compared: {} does not give all those of {}{}\n", source, *names.begin(),
               names.size() == 1 ? "" : fmt::format(" and {} more", names.size() - 1));
  }
}

int run_diff(const DiffArguments& arguments) {
  if (arguments.rules) {
    print_rules();
    return cli::exit_ok;
  }
  if (arguments.before.empty() || arguments.after.empty()) {
    throw CLI::RequiredError{arguments.before.empty() ? "OLD" : "NEW"};
  }
  const describe::System old = read_one(arguments.before, arguments.readers);
  const describe::System now = read_one(arguments.after, arguments.readers);
  if (!old.good || !now.good) {
    return cli::exit_usage;
  }
  const std::vector<Change> changes = describe::compare(old.model, now.model);
  if (arguments.json) {
    print_json(changes, old, now);
  } else {
    print_text(changes, now);
    tell_of_open_ids(arguments.before, old.model);
    tell_of_open_ids(arguments.after, now.model);
  }
  const bool breaks = std::ranges::any_of(
      changes, [](const Change& change) { return change.rule->wire == Impact::breaking; });
  return breaks ? cli::exit_failure : cli::exit_ok;
}

}  // namespace

void add_diff_command(CLI::App& app, int& status, const SourceReaders& readers) {
  const auto arguments = std::make_shared<DiffArguments>();
  arguments->readers = readers;
  CLI::App* command = app.add_subcommand(
      "diff", "Show what changed in an interface, and which programs no longer work with it");
  command->add_option("OLD", arguments->before, "The older description: a file, or a folder of files");
  command->add_option("NEW", arguments->after,
                      "The newer description: in the same language, or in another one");
  command->add_flag("--json", arguments->json, "Print a JSON array");
  command->add_flag("--rules", arguments->rules, "Print all kinds of changes and what they mean");
  command->footer(
      "Examples:\n"
      "  trestle diff release-1/ release-2/\n"
      "  trestle diff Door-old.fidl Door.fidl --json | jq '.[] | select(.wire == \"breaking\")'\n"
      "What one of the two does not say is no difference: vsomeip's JSON and captures have no names and no "
      "types,\n"
      "a capture shows only what was used, and a FIDL file without FDEPL has no ids: name a folder with "
      "both.\n"
      "Exit status: 0 when old and new programs understand each other, 1 when something breaks on the wire,\n"
      "2 when a description is wrong.");
  command->callback([arguments, &status] { status = run_diff(*arguments); });
}

}  // namespace trestle::generate
