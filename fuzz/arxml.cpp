// Property: any text is read as ARXML, or refused with problems that have places, in bounded memory and
// without a crash. What was read without an error has only indices that are there.
#include <cstdint>
#include <cstdlib>
#include <sstream>
#include <string>

#include "bridge/describe/read/arxml/arxml.hpp"

namespace {

using namespace trestle::describe;

void check(const Model& model, const Value& value) {
  if (value.type != no_type && static_cast<std::size_t>(value.type) >= model.types.size()) {
    std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::istringstream stream{std::string{reinterpret_cast<const char*>(data), size}};
  ArxmlInput input{"fuzz.arxml", stream};
  const Reading reading = read_arxml({&input, 1}, {.max_elements = 20'000, .max_types = 2'000});
  for (const Type& type : reading.model.types) {
    for (const Value& member : type.members) {
      check(reading.model, member);
    }
    check(reading.model, type.element);
    check(reading.model, type.key);
  }
  for (const Service& service : reading.model.services) {
    for (const Event& event : service.events) {
      for (const Value& value : event.payload.values) {
        check(reading.model, value);
      }
    }
  }
  for (const trestle::documents::Problem& problem : reading.problems) {
    if (problem.file.empty() || problem.text.empty()) {
      std::abort();
    }
  }
  return 0;
}
