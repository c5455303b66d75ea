#pragma once
// What a model says beside bytes and ids of members, member by member: what `compare` sees of these depends
// on languages. For round_trip_test.cpp.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "bridge/describe/model.hpp"
#include "bridge/describe/ros_names.hpp"
#include "bridge/documents/format.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::generate::round_trip_test {

/// One thing that is said. What is said by default is not there.
struct Fact {
  std::string element;  ///< "Car.moved", or what an instance or constant is called in lists of losses
  std::string value;
};
/// By "method 3 request [0][1] unit": places and ids, which stay where names are others.
using Facts = std::map<std::string, Fact>;

class FactsOf {
 public:
  explicit FactsOf(const describe::Model& model) : model_{model} {}

  Facts run() {
    for (const describe::Service& service : model_.services) {
      for (const describe::Event& one : service.events) {
        start(service, one.name, fmt::format("event {}", id(one.id)));
        say("selective", one.selective ? "yes" : "");
        say("selector", one.selector);
        say_time("cycle", one.cycle);
        transfer("", one.transfer);
        payload("", one.payload);
      }
      for (const describe::Method& one : service.methods) {
        start(service, one.name, fmt::format("method {}", id(one.id)));
        say("selector", one.selector);
        say_time("timeout", one.timeout);
        transfer("request ", one.request_transfer);
        transfer("response ", one.response_transfer);
        payload("request ", one.request);
        payload("response ", one.response);
      }
      for (const describe::Field& one : service.fields) {
        start(service, one.name,
              fmt::format("field {} {} {}", id(one.notifier), id(one.getter), id(one.setter)));
        say_time("cycle", one.cycle);
        transfer("getter ", one.getter_transfer);
        transfer("setter ", one.setter_transfer);
        transfer("notifier ", one.notifier_transfer);
        payload("", one.payload);
      }
    }
    std::ranges::for_each(model_.instances, [this](const describe::Instance& one) { instance(one); });
    for (const describe::Constant& one : model_.constants) {
      element_ = describe::full_name(one.scope, one.name);
      key_ = "constant " + describe::ros_constant_name(one.name);
      say("value", one.value);
    }
    return std::move(facts_);
  }

 private:
  template <typename Id>
  static std::string id(const std::optional<Id>& id) {
    return id ? fmt::format("{:#06x}", someip::value(*id)) : std::string{"-"};
  }
  template <typename Number>
  static std::string number(const std::optional<Number>& number) {
    return number ? fmt::to_string(*number) : std::string{};
  }
  void start(const describe::Service& service, const std::string& name, const std::string& key) {
    element_ = service.name + "." + name;
    key_ = key;
  }
  void say(const std::string& what, std::string value) {
    if (!value.empty()) {
      facts_[key_ + " " + what] = {element_, std::move(value)};
    }
  }
  template <typename Time>
  void say_time(const std::string& what, const std::optional<Time>& time) {
    say(what, time ? documents::to_string(Duration{*time}) : std::string{});
  }
  void transfer(const std::string& part, const describe::Transfer& one) {
    const auto time = [](std::chrono::microseconds of) {
      return of.count() == 0 ? std::string{} : documents::to_string(Duration{of});
    };
    say(part + "debounce", time(one.debounce));
    say(part + "retention", time(one.retention));
  }
  void payload(const std::string& part, const describe::Payload& one) {
    for (std::size_t i = 0; i < one.values.size(); ++i) {
      value(fmt::format("{}[{}]", part, i), one.values[i], 0);
    }
  }
  void value(const std::string& place, const describe::Value& one, int depth) {
    constexpr int deep_enough = 8;
    if (one.type == describe::no_type || depth == deep_enough) {
      return;
    }
    std::string unit = one.notes.unit;
    describe::TypeIndex index = one.type;
    for (int steps = 0; model_.at(index).kind == describe::Kind::alias && steps < deep_enough; ++steps) {
      unit = unit.empty() ? model_.at(index).notes.unit : unit;
      index = model_.at(index).element.type;
    }
    const describe::Type& type = model_.at(index);
    say(place + " unit", unit.empty() ? type.notes.unit : unit);
    say(place + " default", one.default_value);
    if (type.kind == describe::Kind::primitive) {
      say(place + " least", number(type.minimum));
      say(place + " most", number(type.maximum));
    }
    if (type.kind == describe::Kind::primitive || type.kind == describe::Kind::enumeration) {
      say(place + " invalid", number(type.invalid_value));
    }
    const std::vector<describe::Value> members = describe::all_members(model_, type);
    for (std::size_t i = 0; i < members.size(); ++i) {
      value(fmt::format("{}[{}]", place, i), members[i], depth + 1);
    }
    value(place + "[]", type.element, depth + 1);
    value(place + "[key]", type.key, depth + 1);
  }
  /// Whoever is a server for FIDL is used by a route of a client, so that the role is none of it.
  void instance(const describe::Instance& one) {
    element_ = describe::label_of(one);
    key_ = fmt::format("instance {}", id(one.id));
    say("id", id(one.id));
    say("address", one.address ? someip::to_string(*one.address) : std::string{});
    say("UDP port", number(one.udp_port));
    say("TCP port", number(one.tcp_port));
    for (const describe::Multicast& group : one.multicast) {
      say(fmt::format("group of {}", someip::value(group.eventgroup)),
          fmt::format("{} from {} on", someip::to_string(group.group), group.threshold));
    }
    if (one.timing) {
      const sd::Timing& timing = *one.timing;
      say("timing",
          fmt::format("{} {} {} {} {} {}", timing.initial_delay_min.count(), timing.initial_delay_max.count(),
                      timing.repetitions_max, timing.repetitions_base_delay.count(),
                      timing.cyclic_offer_delay.count(), timing.ttl_s));
    }
    say("priority", number(one.priority));
    say("weight", number(one.weight));
    for (const auto& [key, text] : one.configuration) {
      say("option " + key, text.empty() ? "(nothing)" : text);
    }
  }

  const describe::Model& model_;
  Facts facts_{};
  std::string element_{};
  std::string key_{};
};

}  // namespace trestle::generate::round_trip_test
