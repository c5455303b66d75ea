// Property: whatever somebody writes for the name of a service or a member, what it means is there, is found
// again by its full name, and all who take names find the same.
#include <cstdlib>
#include <string>
#include <string_view>

#include "bridge/describe/interfaces.hpp"
#include "bridge/describe/member_names.hpp"
#include "bridge/generate/explanation.hpp"

using namespace trestle;
using namespace trestle::describe;

namespace {

void expect(bool good) {
  if (!good) {
    std::abort();
  }
}

Service door(std::string scope, std::uint16_t id) {
  Service service{.name = "Door", .scope = std::move(scope), .id = someip::ServiceId{id}};
  service.methods = {{.name = "open"},
                     {.name = "open", .selector = "slowly"},
                     {.name = "ring", .fire_and_forget = true},
                     {.name = "shut", .selector = "hard"}};
  service.events = {{.name = "moved"}, {.name = "moved", .selector = "far"}, {.name = "get"}};
  service.fields = {{.name = "label"}, {.name = "open"}, {.name = "0x0001", .has_setter = false}};
  return service;
}

/// Names that are like each other in many ways.
const Interfaces& interfaces() {
  static const Interfaces all = [] {
    Reading reading;
    reading.model.files = {"f"};
    reading.model.services = {door("car", 1), door("car.Door", 2), door("/Services/Body", 3), door("", 4)};
    reading.model.services.push_back({.name = "open", .scope = "Door", .id = someip::ServiceId{5}});
    IdLock lock;
    return Interfaces{make_system(std::move(reading), lock)};
  }();
  return all;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(data, data + size);
  const Model& model = interfaces().model();
  static const ServiceNames names{model};
  bool means_member = false;
  for (const NamedService& named : names.find(text)) {
    expect(named.service < model.services.size());
    expect(named.rest.empty() || named.rest.data() + named.rest.size() == text.data() + text.size());
    const Service& service = model.services[named.service];
    for (const NamedMember& member : named_members(service, named.rest)) {
      means_member = true;
      expect(member.index < (member.kind == LoweredMember::Kind::event    ? service.events.size()
                             : member.kind == LoweredMember::Kind::method ? service.methods.size()
                                                                          : service.fields.size()));
      // With the full name it is this service, and with `*` this member.
      const std::string full = full_name(service.scope, service.name) + ".*." + std::string{named.rest};
      bool again = false;
      for (const NamedService& by_full : names.find(full)) {
        again = again || (by_full.service == named.service && by_full.rest == named.rest);
      }
      expect(again);
    }
  }
  const auto meaning = interfaces().find(text);
  expect(meaning || !meaning.error().empty());
  if (meaning && !meaning->elements.empty()) {
    expect(means_member);
    expect(generate::explain(interfaces().system(), text, {}).has_value());
  }
  return 0;
}
