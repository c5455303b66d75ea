// Random values of everything that real FIDL files and our examples describe: to bytes and back.
#include <algorithm>

#include "test/bridge/describe/fidl/corpus.hpp"
#include "test/bridge/describe/lowered.hpp"
#include "test/bridge/describe/random_values.hpp"
#include "test/source_dir.hpp"

namespace trestle::describe {
namespace {

struct Tally {
  unsigned tried = 0;
  unsigned carried = 0;
};

/// Those of the types that a message has: the rules of a method are for its request and its response.
messages::MessageRules rules_within(const messages::TypeTree& tree, messages::MessageRules rules) {
  std::erase_if(rules.types, [&](const auto& of_type) {
    return std::ranges::none_of(tree.messages, [&](const messages::MessageDefinition& message) {
      return message.name == messages::type_of_rules(of_type.first);
    });
  });
  return rules;
}

/// Of all events, fields and methods that a file describes.
Tally carry(const std::filesystem::path& file) {
  constexpr unsigned turns = 6;
  constexpr test::RandomSizes sizes{.elements = 2, .text = 5};
  Tally tally;
  const Reading reading = corpus::read(file);
  if (!reading.ok()) {
    return tally;  // Corpus.IsReadOrRefusedForARightReason
  }
  const Lowered lowered = lower(reading.model);
  messages::TypeLibrary library = lowered::library_of(lowered);
  const auto add = [&](const messages::TypeTree& tree, const messages::MessageRules& rules) {
    SCOPED_TRACE(tree.root().name);
    if (tree.root().fields.empty()) {
      return;  // no value
    }
    tally.tried += turns;
    tally.carried += random_values::carried(tree, rules_within(tree, rules), turns, sizes);
  };
  for (const LoweredMember& member : lowered.members) {
    if (member.kind == LoweredMember::Kind::method) {
      const auto service = library.resolve_service(member.type);
      if (!service) {
        ADD_FAILURE() << to_string(service.error());
        continue;
      }
      add(service->request, member.rules);
      add(service->response, member.response);
    } else if (const auto tree = library.resolve(member.type)) {
      add(*tree, member.rules);
    } else {
      ADD_FAILURE() << to_string(tree.error());
    }
  }
  return tally;
}

TEST(ImportedValues, OfTheExamplesSurvive) {
  for (const char* file : {"/examples/door/Door.fdepl", "/examples/seat/Seat.fdepl"}) {
    SCOPED_TRACE(file);
    const Tally tally = carry(test::source_dir() + std::string{file});
    EXPECT_GE(tally.tried, 60U);
    EXPECT_EQ(tally.carried, tally.tried);
  }
}

TEST(ImportedValues, OfRealFilesSurvive) {
  if (!corpus::folder()) {
    GTEST_SKIP() << "the real files are not here";
  }
  Tally all;
  for (const char* ending : {".fidl", ".fdepl"}) {
    for (const auto& file : corpus::files("files", ending)) {
      SCOPED_TRACE(file.string());
      const Tally tally = carry(file);
      all.tried += tally.tried;
      all.carried += tally.carried;
    }
  }
  EXPECT_GT(all.tried, 1500U);
  EXPECT_EQ(all.carried, all.tried);
}

}  // namespace
}  // namespace trestle::describe
