#include "bridge/describe/write/sheet/write_sheet.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <string_view>
#include <utility>

#include "bridge/describe/instance_index.hpp"
#include "bridge/describe/layout.hpp"
#include "bridge/describe/load_e2e.hpp"
#include "bridge/describe/member_names.hpp"
#include "bridge/describe/model_json.hpp"
#include "bridge/describe/protection.hpp"
#include "bridge/describe/units.hpp"
#include "bridge/documents/format.hpp"
#include "bridge/documents/xml_text.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::describe {
namespace {

template <typename Id>
std::string id_text(const std::optional<Id>& id, bool is_chosen = false) {
  return id ? fmt::format("0x{:04x}{}", someip::value(*id), is_chosen ? " chosen" : "") : std::string{"?"};
}

/// That of a method, an event, or a part of a field.
std::string id_text(const Service& service, const std::optional<someip::MethodId>& id) {
  return id_text(id, id && service.chosen_ids.contains(*id));
}

bool has_chosen_id(const Service& service) {
  return service.id_is_chosen || !service.chosen_ids.empty() ||
         std::ranges::any_of(service.eventgroups, &Eventgroup::id_is_chosen);
}

/// What both forms of the sheet are written by.
class SheetForm {
 public:
  SheetForm() = default;
  SheetForm(const SheetForm&) = delete;
  SheetForm& operator=(const SheetForm&) = delete;
  virtual ~SheetForm() = default;
  virtual void heading(int level, std::string_view text) = 0;
  virtual void paragraph(std::string_view text) = 0;
  virtual void table(const std::vector<std::string>& head,
                     const std::vector<std::vector<std::string>>& rows) = 0;
  virtual std::string take() = 0;
};

class MarkdownSheet : public SheetForm {
 public:
  void heading(int level, std::string_view text) override {
    text_ += (text_.empty() ? "" : "\n") + std::string(static_cast<std::size_t>(level), '#') + " " +
             plain(text) + "\n";
  }
  void paragraph(std::string_view text) override { text_ += "\n" + plain(text) + "\n"; }
  void table(const std::vector<std::string>& head,
             const std::vector<std::vector<std::string>>& rows) override {
    text_ += "\n";
    row(head);
    row(std::vector<std::string>(head.size(), "---"));
    std::ranges::for_each(rows, [this](const std::vector<std::string>& one) { row(one); });
  }
  std::string take() override { return std::move(text_); }

 private:
  void row(const std::vector<std::string>& cells) {
    text_ += "|";
    for (const std::string& cell : cells) {
      text_ += " " + plain(cell) + " |";
    }
    text_ += "\n";
  }
  /// Nothing of it is markup, and it stays on one line.
  static std::string plain(std::string_view text) {
    std::string out;
    for (const char c : text) {
      if (c == '\n' || c == '\r') {
        out += ' ';
      } else if (std::string_view{"|*`<\\"}.find(c) != std::string_view::npos) {
        out += '\\';
        out += c;
      } else {
        out += c;
      }
    }
    return out;
  }
  std::string text_;
};

class HtmlSheet : public SheetForm {
 public:
  explicit HtmlSheet(std::string_view title) {
    text_ =
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
        "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>" +
        documents::xml_text(title) +
        "</title>\n<style>\n"
        ":root { color-scheme: light dark; }\n"
        "body { font: 15px/1.5 system-ui, sans-serif; max-width: 70em; margin: 2em auto; padding: 0 1em; }\n"
        "table { border-collapse: collapse; margin: .6em 0; }\n"
        "th, td { border: 1px solid #8886; padding: .2em .6em; text-align: left; vertical-align: top; }\n"
        "th { background: #8882; }\n"
        "h2 { border-bottom: 2px solid #8886; margin-top: 2em; }\n"
        "</style>\n</head>\n<body>\n";
  }
  void heading(int level, std::string_view text) override {
    text_ += fmt::format("<h{0}>{1}</h{0}>\n", level, documents::xml_text(text));
  }
  void paragraph(std::string_view text) override { text_ += "<p>" + documents::xml_text(text) + "</p>\n"; }
  void table(const std::vector<std::string>& head,
             const std::vector<std::vector<std::string>>& rows) override {
    text_ += "<table>\n";
    row(head, "th");
    std::ranges::for_each(rows, [this](const std::vector<std::string>& one) { row(one, "td"); });
    text_ += "</table>\n";
  }
  std::string take() override { return std::move(text_) + "</body>\n</html>\n"; }

 private:
  void row(const std::vector<std::string>& cells, const char* tag) {
    text_ += "<tr>";
    for (const std::string& cell : cells) {
      text_ += fmt::format("<{0}>{1}</{0}>", tag, documents::xml_text(cell));
    }
    text_ += "</tr>\n";
  }
  std::string text_;
};

class SheetWriter {
 public:
  SheetWriter(const Model& model, SheetForm& form)
      : model_{model}, form_{form}, labels_{type_labels(model)}, instances_{model} {}

  /// @return what the sheet has no room for.
  std::vector<NotCarried> write() {
    form_.heading(1, "Interfaces");
    if (!model_.services.empty()) {
      std::vector<std::vector<std::string>> rows;
      for (const Service& one : model_.services) {
        rows.push_back({full_name(one.scope, one.name), id_text(one.id, one.id_is_chosen),
                        fmt::format("{}.{}", one.major, one.minor), std::to_string(one.methods.size()),
                        std::to_string(one.events.size()), std::to_string(one.fields.size())});
      }
      form_.table({"service", "id", "version", "methods", "events", "fields"}, rows);
    }
    if (std::ranges::any_of(model_.services, has_chosen_id) ||
        std::ranges::any_of(model_.instances, &Instance::id_is_chosen)) {
      form_.paragraph(
          "chosen: Trestle chose this id, because no description gives it. Other programs do not know it.");
    }
    std::ranges::for_each(model_.services, [this](const Service& one) { service(one); });
    machines();
    types();
    constants();
    return std::move(lost_);
  }

 private:
  void notes(const Notes& notes) {
    if (const std::string text = meaning(notes); !text.empty()) {
      form_.paragraph(text);
    }
  }

  /// The description, and each annotation: "deprecated: since 2".
  static std::string meaning(const Notes& notes) {
    std::string text = notes.description;
    for (const auto& [name, value] : notes.others) {
      text += fmt::format("{}{}: {}", text.empty() ? "" : "; ",
                          std::string_view{name}.substr(name.starts_with('@') ? 1 : 0), value);
    }
    return text;
  }

  /// What is known of arguments beside their bytes.
  void arguments(const std::vector<Value>& values) {
    std::vector<std::vector<std::string>> rows;
    for (const Value& one : values) {
      const std::string unit = measured_in(model_, one);
      if (one.notes != Notes{} || !unit.empty()) {
        rows.push_back({one.name, unit, meaning(one.notes)});
      }
    }
    if (!rows.empty()) {
      form_.table({"value", "unit", "meaning"}, rows);
    }
  }

  /// "A uint8 from 0 to 100, unit %. 255 means that there is no value."
  static std::string number_text(const Type& type) {
    std::string text = fmt::format("A {}", messages::to_string(type.primitive));
    text += type.minimum ? fmt::format(" from {}", *type.minimum) : "";
    text += type.maximum ? fmt::format(" to {}", *type.maximum) : "";
    text += type.notes.unit.empty() ? "." : fmt::format(", unit {}.", type.notes.unit);
    return text +
           (type.invalid_value ? fmt::format(" {} means that there is no value.", *type.invalid_value) : "");
  }

  void service(const Service& service) {
    form_.heading(2, fmt::format("{} ({}, version {}.{})", full_name(service.scope, service.name),
                                 id_text(service.id, service.id_is_chosen), service.major, service.minor));
    notes(service.notes);
    if (!service.base.empty()) {
      form_.paragraph("It extends " + service.base + ".");
    }
    if (!service.manages.empty()) {
      form_.paragraph(fmt::format("It manages {}.", fmt::join(service.manages, ", ")));
    }
    instances(service);
    eventgroups(service);
    for (const Method& one : service.methods) {
      const std::string key = member_key(one.name, one.selector);
      form_.heading(3, fmt::format("Method {} ({})", key, id_text(service, one.id)));
      notes(one.notes);
      if (one.timeout) {
        form_.paragraph("Timeout: " + time_text(*one.timeout) + ".");
      }
      largest(one.observed_bytes);
      const std::string element = full_name(service.scope, service.name) + "." + key;
      payload(element, one.fire_and_forget ? "Request (fire and forget)" : "Request", one.request,
              one.request_transfer, one.place);
      if (!one.fire_and_forget) {
        Payload response = one.response;
        if (static_cast<std::size_t>(one.error) < model_.types.size()) {
          response.values.insert(
              response.values.begin(),
              Value{.name = "error", .type = one.error, .wire = model_.at(one.error).wire});
        }
        payload(element, "Response", response, one.response_transfer, one.place);
        errors(one);
      }
      protection(one.e2e, E2eUse::called);
    }
    for (const Event& one : service.events) {
      const std::string key = member_key(one.name, one.selector);
      form_.heading(3, fmt::format("Event {} ({})", key, id_text(service, one.id)));
      notes(one.notes);
      if (one.selective) {
        form_.paragraph("Selective: the service chooses who gets it.");
      }
      cycle(one.cycle);
      largest(one.observed_bytes);
      payload(full_name(service.scope, service.name) + "." + key, "Payload", one.payload, one.transfer,
              one.place);
      protection(one.e2e, E2eUse::sent_event);
    }
    for (const Field& one : service.fields) {
      std::string parts;
      const auto part = [&](bool there, const char* what, const std::optional<someip::MethodId>& id) {
        if (there) {
          parts += fmt::format("{}{} {}", parts.empty() ? "" : ", ", what, id_text(service, id));
        }
      };
      part(one.has_getter, "getter", one.getter);
      part(one.has_setter, "setter", one.setter);
      part(one.has_notifier, "notifier", one.notifier);
      form_.heading(3, fmt::format("Field {} ({})", one.name, parts));
      notes(one.notes);
      cycle(one.cycle);
      largest(one.observed_bytes);
      payload(full_name(service.scope, service.name) + "." + one.name, "Payload", one.payload,
              one.has_notifier ? one.notifier_transfer : one.getter_transfer, one.place);
      protection(one.e2e, E2eUse::sent_event, "Notifier: ");
      protection(one.getter_e2e, E2eUse::called, "Getter: ");
      protection(one.setter_e2e, E2eUse::called, "Setter: ");
    }
  }

  static std::string time_text(Duration time) { return documents::to_string(time); }
  void cycle(const std::optional<std::chrono::microseconds>& cycle) {
    if (cycle) {
      form_.paragraph("Cycle: " + time_text(*cycle) + ".");
    }
  }
  /// Of a capture.
  void largest(const std::optional<std::uint32_t>& observed_bytes) {
    if (observed_bytes) {
      form_.paragraph(fmt::format("The largest payload seen has {} bytes.", *observed_bytes));
    }
  }

  /// Those that no type of its own has.
  void errors(const Method& method) {
    if (static_cast<std::size_t>(method.error) < model_.types.size() &&
        model_.at(method.error).name.empty()) {
      enumerators("error", model_.at(method.error));
    }
    if (!method.application_errors.empty()) {
      form_.paragraph(
          fmt::format("Errors of the application: {}", fmt::join(method.application_errors, ", ")));
    }
  }

  void enumerators(std::string_view title, const Type& type) {
    std::vector<std::vector<std::string>> rows;
    for (const Enumerator& one : all_enumerators(model_, type)) {
      rows.push_back({one.name, std::to_string(one.value), meaning(one.notes)});
    }
    form_.table({fmt::format("{} of {}", title, messages::to_string(type.primitive)), "value", "meaning"},
                rows);
  }

  void instances(const Service& service) {
    std::vector<std::vector<std::string>> rows;
    for (const Instance* const there : instances_.of(service)) {
      const Instance& one = *there;
      rows.push_back({one.name, one.id ? id_text(one.id, one.id_is_chosen) : "any",
                      one.role == Instance::Role::provided ? "provided" : "required",
                      one.address ? someip::to_string(*one.address) : "",
                      one.udp_port ? std::to_string(*one.udp_port) : "",
                      one.tcp_port ? std::to_string(*one.tcp_port) : ""});
    }
    if (!rows.empty()) {
      form_.table({"instance", "id", "role", "address", "UDP", "TCP"}, rows);
    }
    rows.clear();
    for (const Instance* const one : instances_.of(service)) {
      for (std::string& setting : settings_of(*one)) {
        rows.push_back({label_of(*one), std::move(setting)});
      }
    }
    if (!rows.empty()) {
      form_.table({"instance", "setting"}, rows);
    }
  }

  /// What few instances have.
  static std::vector<std::string> settings_of(const Instance& one) {
    std::vector<std::string> all;
    if (!one.machine.empty()) {
      all.push_back("machine: " + one.machine);
    }
    if (one.major || one.minor) {
      all.push_back(fmt::format("version: {}.{}", one.major ? std::to_string(*one.major) : "any",
                                one.minor ? std::to_string(*one.minor) : "any"));
    }
    if (one.priority || one.weight) {
      all.push_back(fmt::format("load balancing: priority {}, weight {}", one.priority.value_or(0),
                                one.weight.value_or(0)));
    }
    for (const auto& [key, value] : one.configuration) {
      all.push_back(fmt::format("configuration option: {}={}", key, value));
    }
    if (one.timing) {
      const sd::Timing& timing = *one.timing;
      all.push_back(
          fmt::format("service discovery: first after {} to {}, {} repetitions from {} on, then each "
                      "{}; answers after {} to {}; TTL {} s",
                      time_text(timing.initial_delay_min), time_text(timing.initial_delay_max),
                      timing.repetitions_max, time_text(timing.repetitions_base_delay),
                      time_text(timing.cyclic_offer_delay), time_text(timing.request_response_delay_min),
                      time_text(timing.request_response_delay_max), timing.ttl_s));
    }
    if (const std::string text = meaning(one.notes); !text.empty()) {
      all.push_back(text);
    }
    return all;
  }

  void machines() {
    std::vector<std::vector<std::string>> rows;
    for (const Machine& one : model_.machines) {
      rows.push_back({one.name, one.address ? someip::to_string(*one.address) : "",
                      one.sd_multicast ? someip::to_string(*one.sd_multicast) : "",
                      one.sd_port ? std::to_string(*one.sd_port) : ""});
    }
    if (!rows.empty()) {
      form_.heading(2, "Machines");
      form_.table({"machine", "address", "group of service discovery", "port"}, rows);
    }
  }

  void eventgroups(const Service& service) {
    std::map<someip::EventgroupId, std::string> members;
    const auto add = [&](const auto& one) {
      for (const someip::EventgroupId group : std::set(one.eventgroups.begin(), one.eventgroups.end())) {
        std::string& all = members[group];
        if constexpr (requires { one.selector; }) {
          all += (all.empty() ? "" : ", ") + member_key(one.name, one.selector);
        } else {
          all += (all.empty() ? "" : ", ") + one.name;
        }
      }
    };
    std::ranges::for_each(service.events, add);
    std::ranges::for_each(service.fields, add);
    const std::vector<const Instance*> instances = instances_.of(service);
    std::map<someip::EventgroupId, std::string> multicast;
    for (const Instance* const instance : instances) {
      for (const Multicast& one : instance->multicast) {
        std::string& all = multicast[one.eventgroup];
        all += fmt::format("{}{}{} from {} subscribers on", all.empty() ? "" : "; ",
                           instances.size() > 1 ? label_of(*instance) + ": " : "",
                           someip::to_string(one.group), one.threshold);
      }
    }
    std::vector<std::vector<std::string>> rows;
    for (const Eventgroup& group : service.eventgroups) {
      rows.push_back({group.name, id_text(std::optional{group.id}, group.id_is_chosen), members[group.id],
                      multicast[group.id]});
    }
    if (!rows.empty()) {
      form_.table({"eventgroup", "id", "events and fields", "multicast"}, rows);
    }
  }

  void payload(const std::string& element, const std::string& title, const Payload& payload,
               const Transfer& transfer, Place place) {
    std::string how = transfer.transport == Transport::tcp ? "TCP" : "UDP";
    if (transfer.segment_bytes != 0) {
      how += fmt::format(", SOME/IP-TP with segments of {} bytes", transfer.segment_bytes);
    }
    if (transfer.separation.count() != 0) {
      how += fmt::format(", {} between segments", time_text(transfer.separation));
    }
    if (transfer.debounce.count() != 0 || transfer.retention.count() != 0) {
      how += fmt::format(", collected at least {} apart for at most {}", time_text(transfer.debounce),
                         time_text(transfer.retention));
    }
    if (!payload.known) {
      form_.paragraph(fmt::format("{}: {}; the sources do not describe its bytes", title, how));
      return;
    }
    if (rows_ >= max_sheet_rows) {
      form_.paragraph(
          fmt::format("{}: {}; no table, because the sheet already has {} rows", title, how, rows_));
      lost_.push_back({element,
                       fmt::format("its bytes: the sheet has {} rows of such tables, which are more than "
                                   "{}",
                                   rows_, max_sheet_rows),
                       place});
      return;
    }
    const Layout layout = describe::layout(model_, payload);
    for (const ByteRange& one : layout.ranges) {
      rows_ += 1 + (one.path.size() + one.offset_text.size()) / 64;
    }
    form_.paragraph(
        fmt::format("{}: {}{}", title, how, layout.ranges.empty() && layout.errors.empty() ? ", empty" : ""));
    for (const LayoutError& error : layout.errors) {
      form_.paragraph("The table is cut: " + error.text + ".");
      lost_.push_back({element, "the rest of its bytes: " + error.text, place});
    }
    if (layout.ranges.empty()) {
      return;
    }
    std::vector<std::vector<std::string>> rows;
    for (const ByteRange& one : layout.ranges) {
      rows.push_back({std::string(static_cast<std::size_t>(one.depth), '+') + one.offset_text, one.size_text,
                      one.path, one.type, one.rule});
    }
    form_.table({"offset", "bytes", "field", "type", "rule"}, rows);
    arguments(payload.values);
  }

  void protection(const Protection& e2e, E2eUse use, const std::string& part = {}) {
    if (e2e.empty()) {
      return;
    }
    const std::string fault = e2e_fault(e2e, use);
    const std::string others = other_instances(e2e);
    form_.paragraph(
        (e2e.profile.empty()
             ? part + "No E2E protection."
             : fmt::format("{}E2E profile {}; its header is in front of the payload.", part, e2e.profile)) +
        (fault.empty() ? "" : " Trestle cannot do it: " + fault + ".") +
        (others.empty() ? "" : " Instances differ: " + others + "."));
  }

  void types() {
    bool told = false;
    for (std::size_t at = 0; at < model_.types.size(); ++at) {
      const Type& type = model_.types[at];
      if (type.name.empty()) {
        continue;
      }
      if (!std::exchange(told, true)) {
        form_.heading(2, "Types");
      }
      form_.heading(3, fmt::format("{} ({})", labels_[at], to_string(type.kind)));
      notes(type.notes);
      std::vector<std::vector<std::string>> rows;
      if (type.kind == Kind::enumeration) {
        enumerators("enumerator", type);
      } else if (type.kind == Kind::structure || type.kind == Kind::choice) {
        for (const Value& one : all_members(model_, type)) {
          rows.push_back({one.name, label(one.type), measured_in(model_, one), meaning(one.notes)});
        }
        form_.table({"member", "type", "unit", "meaning"}, rows);
      } else if (type.kind == Kind::alias || type.kind == Kind::array) {
        form_.paragraph("Of " + label(type.element.type) + ".");
      } else if (type.kind == Kind::map) {
        form_.paragraph("From " + label(type.key.type) + " to " + label(type.element.type) + ".");
      } else if (type.kind == Kind::primitive) {
        form_.paragraph(number_text(type));
      }
    }
  }

  void constants() {
    std::vector<std::vector<std::string>> rows;
    for (const Constant& one : model_.constants) {
      rows.push_back(
          {full_name(one.scope, one.name), label(one.type), one.value, one.notes.unit, meaning(one.notes)});
    }
    if (!rows.empty()) {
      form_.heading(2, "Constants");
      form_.table({"constant", "type", "value", "unit", "meaning"}, rows);
    }
  }

  [[nodiscard]] std::string label(TypeIndex index) const {
    const auto at = static_cast<std::size_t>(index);
    if (at >= model_.types.size()) {
      return "?";
    }
    const Type& type = model_.types[at];
    return type.name.empty() && type.kind == Kind::array && type.element.type != index &&
                   static_cast<std::size_t>(type.element.type) < model_.types.size()
               ? labels_[static_cast<std::size_t>(type.element.type)] + "[]"
               : labels_[at];
  }

  const Model& model_;
  SheetForm& form_;
  std::vector<std::string> labels_;
  InstanceIndex instances_;
  std::size_t rows_ = 0;  ///< of bytes
  std::vector<NotCarried> lost_;
};

}  // namespace

Written write_sheet(const Model& model) {
  MarkdownSheet markdown;
  std::vector<NotCarried> lost = SheetWriter{model, markdown}.write();
  HtmlSheet html{"Interfaces"};
  SheetWriter{model, html}.write();
  return {{{"interfaces.md", markdown.take()}, {"interfaces.html", html.take()}}, std::move(lost)};
}

}  // namespace trestle::describe
