// Property: whatever happens to a description (it is cut, a piece is doubled, a word is another one, a byte
// is wrong), it is read or refused with problems that have places, and what is read can be worked with.
// Nothing looks at a clock: what comes out is counted, because time and memory follow it.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <cstdint>

#include "bridge/describe/sources/sources.hpp"
#include "bridge/describe/system.hpp"
#include "bridge/describe/write/arxml/write_arxml.hpp"
#include "bridge/describe/write/fidl/write_fidl.hpp"
#include "bridge/describe/write/routes/write_routes.hpp"
#include "bridge/describe/write/sheet/write_sheet.hpp"
#include "bridge/describe/write/vsomeip/write_vsomeip.hpp"
#include "bridge/describe/write/wireshark/write_wireshark.hpp"
#include "test/bridge/describe/fidl/corpus.hpp"

namespace trestle::describe {
namespace {

/// The same numbers everywhere (splitmix64).
class Numbers {
 public:
  explicit Numbers(std::uint64_t seed) : state_{seed} {}
  std::size_t below(std::size_t end) { return end == 0 ? 0 : static_cast<std::size_t>(next() % end); }

 private:
  std::uint64_t next() {
    std::uint64_t mixed = state_ += 0x9e3779b97f4a7c15ULL;
    mixed = (mixed ^ (mixed >> 30U)) * 0xbf58476d1ce4e5b9ULL;
    mixed = (mixed ^ (mixed >> 27U)) * 0x94d049bb133111ebULL;
    return mixed ^ (mixed >> 31U);
  }
  std::uint64_t state_;
};

bool is_word(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
}

/// The word at or behind a place.
std::pair<std::size_t, std::size_t> word_at(const std::string& text, std::size_t at) {
  const auto begin = static_cast<std::size_t>(
      std::find_if(text.begin() + static_cast<std::ptrdiff_t>(at), text.end(), is_word) - text.begin());
  std::size_t end = begin;
  while (end < text.size() && is_word(text[end])) {
    ++end;
  }
  return {begin, end - begin};
}

std::string mutated(std::string text, Numbers& numbers) {
  const std::size_t at = numbers.below(text.size());
  const std::size_t length = 1 + numbers.below(std::min<std::size_t>(text.size() - at, 400));
  switch (numbers.below(6)) {
    case 0:  // cut off
      return text.substr(0, at);
    case 1:  // cut out
      return text.erase(at, length);
    case 2:  // doubled
      return text.insert(at, text.substr(at, length));
    case 3: {  // renamed to another word of the text
      const auto [begin, size] = word_at(text, at);
      const auto [other, other_size] = word_at(text, numbers.below(text.size()));
      return text.replace(begin, size, text.substr(other, other_size));
    }
    case 4: {  // another number
      constexpr std::array numbers_of_note{"0", "-1", "65535", "65536", "4294967296", "99999999999999999999",
                                           "0x"};
      const auto [begin, size] = word_at(text, at);
      return text.replace(begin, size, numbers_of_note.at(numbers.below(numbers_of_note.size())));
    }
    default:  // a wrong byte
      text[at] = static_cast<char>(numbers.below(256));
      return text;
  }
}

std::size_t size_of(const Model& model) {
  std::size_t all =
      model.types.size() + model.instances.size() + model.constants.size() + model.machines.size();
  for (const Type& type : model.types) {
    all += type.members.size() + type.enumerators.size();
  }
  for (const Service& service : model.services) {
    all += 1 + service.events.size() + service.methods.size() + service.fields.size();
  }
  return all;
}

/// Reads a text and does with it all that can be done.
void use(const std::string& name, const std::string& text, const Load& load, std::size_t& good) {
  Reading reading = read_sources(std::vector{SourceText{name, text}}, load);
  const bool was_good = reading.ok();
  EXPECT_TRUE(was_good || !reading.problems.empty());
  for (const documents::Problem& problem : reading.problems) {
    EXPECT_FALSE(problem.file.empty()) << problem.text;
    EXPECT_EQ(problem.text.find('\n'), std::string::npos) << problem.text;
  }
  const bool has_place = std::ranges::any_of(
      reading.problems, [](const documents::Problem& problem) { return problem.mark.line > 0; });
  EXPECT_TRUE(was_good || has_place) << name << ": " << reading.problems.front().text;
  // FIDL reads the files that it imports; else nothing is larger than what it was read from.
  EXPECT_LT(size_of(reading.model), 20'000U);
  EXPECT_LT(reading.problems.size(), 2000U);
  if (!was_good) {
    return;
  }
  ++good;
  IdLock lock;
  const System system = make_system(std::move(reading), lock);
  std::size_t bytes = 0;
  const auto count = [&](const Written& written) {
    for (const TextFile& file : written.files) {
      bytes += file.text.size();
    }
  };
  count(write_routes(system.model, system.lowered, {}));
  count(write_fidl(system.model));
  count(write_vsomeip(system.model, {}));
  count(write_sheet(system.model));
  count(write_wireshark(system.model));
  bytes += write_arxml(system.model).text.size();
  EXPECT_LT(bytes, 50'000'000U);
}

tl::expected<std::string, std::string> nothing(const std::string& /*name*/) {
  return tl::unexpected{std::string{"there is no such file"}};
}

/// A description of our own, in each language.
std::vector<SourceText> own_sources() {
  Model model;
  const TypeIndex number = model.add({.kind = Kind::primitive, .primitive = messages::Primitive::uint16});
  const TypeIndex text = model.add({.kind = Kind::string, .wire = default_wire(Kind::string)});
  const TypeIndex mode = model.add({.kind = Kind::enumeration,
                                    .name = "Mode",
                                    .scope = "car.Types",
                                    .primitive = messages::Primitive::uint8,
                                    .enumerators = {{"SLOW", 0}, {"FAST", 1}}});
  const TypeIndex state =
      model.add({.kind = Kind::structure,
                 .name = "State",
                 .scope = "car.Types",
                 .members = {{.name = "mode", .type = mode},
                             {.name = "angle", .type = number},
                             {.name = "label", .type = text, .wire = default_wire(Kind::string)}}});
  const TypeIndex either =
      model.add({.kind = Kind::choice,
                 .name = "Either",
                 .scope = "car.Types",
                 .wire = default_wire(Kind::choice),
                 .members = {{.name = "state", .type = state}, {.name = "number", .type = number}}});
  const TypeIndex states = model.add({.kind = Kind::array,
                                      .name = "States",
                                      .scope = "car.Types",
                                      .wire = default_wire(Kind::array),
                                      .element = {.type = state}});
  const TypeIndex table = model.add({.kind = Kind::map,
                                     .name = "Table",
                                     .scope = "car.Types",
                                     .wire = default_wire(Kind::map),
                                     .element = {.type = states, .wire = default_wire(Kind::array)},
                                     .key = {.type = number}});
  model.services.push_back(
      {.name = "Door",
       .scope = "car",
       .id = someip::ServiceId{0x1234},
       .has_version = true,
       .events =
           {{.name = "moved",
             .id = someip::MethodId{0x8001},
             .payload = {.values = {{.name = "states", .type = states, .wire = default_wire(Kind::array)}}},
             .eventgroups = {someip::EventgroupId{1}}}},
       .methods =
           {{.name = "open",
             .id = someip::MethodId{1},
             .request = {.values = {{.name = "how", .type = either, .wire = default_wire(Kind::choice)}}},
             .response = {.values = {{.name = "table", .type = table, .wire = default_wire(Kind::map)}}}}},
       .fields = {{.name = "mode",
                   .payload = {.values = {{.name = "mode", .type = mode}}},
                   .getter = someip::MethodId{2},
                   .setter = someip::MethodId{3},
                   .notifier = someip::MethodId{0x8002},
                   .eventgroups = {someip::EventgroupId{1}}}},
       .eventgroups = {{.name = "all", .id = someip::EventgroupId{1}}}});
  model.instances.push_back({.name = "front",
                             .service = "car.Door",
                             .service_id = someip::ServiceId{0x1234},
                             .id = someip::InstanceId{1},
                             .address = IpAddress::v4(10, 0, 0, 1),
                             .udp_port = std::uint16_t{30501}});
  std::vector<SourceText> sources;
  const auto add = [&](Written written) {
    for (TextFile& file : written.files) {
      sources.push_back({std::move(file.path), std::move(file.text)});
    }
  };
  add(write_fidl(model));
  add(write_vsomeip(model, {}));
  sources.push_back({"a.arxml", write_arxml(model).text});
  return sources;
}

TEST(MutatedDescriptions, AreReadOrRefusedWithAPlace) {
  const std::vector<SourceText> sources = own_sources();
  const Load load = [&](const std::string& name) -> tl::expected<std::string, std::string> {
    const auto found =
        std::ranges::find_if(sources, [&](const SourceText& one) { return name.ends_with(one.name); });
    return found == sources.end() ? nothing(name) : tl::expected<std::string, std::string>{found->text};
  };
  std::size_t good = 0;
  std::size_t all = 0;
  for (const SourceText& source : sources) {
    for (std::uint64_t seed = 0; seed < 150; ++seed) {
      SCOPED_TRACE(fmt::format("{}, seed {}", source.name, seed));
      Numbers numbers{seed};
      use(source.name, mutated(source.text, numbers), load, good);
      ++all;
    }
  }
  // Both happen.
  EXPECT_GT(good, all / 50);
  EXPECT_LT(good, all - all / 50);
}

TEST(MutatedDescriptions, OfTheCorporaAreReadOrRefusedWithAPlace) {
  if (!corpus::folder()) {
    GTEST_SKIP() << "the real files are not here";
  }
  std::size_t good = 0;
  for (const char* ending : {".fidl", ".fdepl", ".arxml", ".json"}) {
    for (const auto& file : corpus::files("files", ending)) {
      const std::string text = corpus::text_of(file).value_or("");
      for (std::uint64_t seed = 0; seed < 8; ++seed) {
        SCOPED_TRACE(fmt::format("{}, seed {}", file.string(), seed));
        Numbers numbers{seed + 1000};
        use(file.string(), mutated(text, numbers), corpus::load, good);
      }
    }
  }
  EXPECT_GT(good, 0U);
}

}  // namespace
}  // namespace trestle::describe
