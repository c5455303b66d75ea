#include "bridge/generate/page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "bridge/cli/protection.hpp"
#include "bridge/describe/join.hpp"
#include "bridge/describe/layout.hpp"
#include "bridge/describe/model_json.hpp"
#include "bridge/describe/protection.hpp"
#include "bridge/describe/sources/ros_types.hpp"
#include "bridge/describe/sources/sources.hpp"
#include "bridge/documents/section.hpp"
#include "bridge/generate/explanation.hpp"
#include "bridge/generate/page_form.hpp"
#include "bridge/messages/values/byte_text.hpp"

namespace trestle::generate {

using Json = nlohmann::ordered_json;

namespace {

/// However long a description says that an answer may take.
constexpr Duration max_call_time = std::chrono::seconds{60};

/// JSON of whatever text: bytes that are no UTF-8 become U+FFFD.
web::Answer json_of(const Json& json) {
  return web::json_answer(json.dump(-1, ' ', false, Json::error_handler_t::replace));
}

bool same(const std::vector<describe::SourceText>& one, const std::vector<describe::SourceText>& other) {
  return std::ranges::equal(
      one, other, [](const auto& a, const auto& b) { return a.name == b.name && a.text == b.text; });
}

/// Without any I/O: an import is one of the files, or there is none. The reader of FIDL has taken files with
/// the very name already, and takes one of the same name in another folder after this.
describe::Load no_loader() {
  return [](const std::string&) -> tl::expected<std::string, std::string> {
    return tl::unexpected{std::string{"it is not among the files; add it"}};
  };
}

Json ranges_json(const describe::Layout& layout, std::optional<ByteView> bytes) {
  Json ranges = Json::array();
  for (const describe::ByteRange& range : layout.ranges) {
    Json json{{"offset", range.offset_text}, {"size", range.size_text}, {"depth", range.depth},
              {"path", range.path},          {"type", range.type},      {"rule", range.rule}};
    if (bytes) {
      json["value"] = range.value;
      if (range.offset && range.bytes && *range.offset <= bytes->size()) {
        std::string hex;
        messages::append_hex(
            hex, bytes->subspan(*range.offset).first(std::min(*range.bytes, bytes->size() - *range.offset)));
        json["hex"] = hex.size() > 64 ? hex.substr(0, 64) + "…" : hex;
      }
    }
    ranges.push_back(std::move(json));
  }
  return ranges;
}

/// The bytes of a payload, and what they are.
/// @param e2e  its header, which is not among the bytes, is shown as zeros.
Json bytes_json(const describe::Model& model, const describe::Payload& payload, std::vector<std::byte> bytes,
                const describe::Protection& e2e, describe::E2eUse use) {
  describe::Layout layout = describe::layout(model, payload, bytes);
  add_header(e2e, use, layout, &bytes);
  std::string hex;
  messages::append_hex(hex, ByteView{bytes}.first(std::min<std::size_t>(bytes.size(), 4096)));
  Json json{{"ranges", ranges_json(layout, bytes)}, {"hex", hex}, {"bytes", bytes.size()}};
  if (!layout.errors.empty()) {
    const describe::LayoutError& first = layout.errors.front();
    json["error"] =
        fmt::format("byte {}: {}{}{}", first.offset, first.path, first.path.empty() ? "" : ": ", first.text);
  }
  return json;
}

}  // namespace

web::Answer error_answer(const std::string& text) {
  return json_of({{"error", documents::printable(text)}});
}

Page::Page(Settings settings)
    : settings_{std::move(settings)},
      started_{fmt::format("{:x}", std::chrono::system_clock::now().time_since_epoch().count())} {}

std::shared_ptr<const PageSystem> Page::load(const PageQuestion& question) {
  const bool known = loaded_ != nullptr && same(question.files, files_);
  if (known && question.edits == edits_) {
    return loaded_;
  }
  loaded_.reset();
  if (!known) {
    files_ = question.files;
    reading_ = describe::read_sources(files_, no_loader(),
                                      {.set_event_bit = settings_.set_event_bit,
                                       .type_folders = settings_.type_folders,
                                       .look_beside = false});
    if (!settings_.captured.files.empty() && reading_.ok()) {
      describe::append(reading_.model, settings_.captured);
      std::vector<documents::Problem> contradictions = describe::join(reading_.model);
      reading_.problems.insert(reading_.problems.end(), contradictions.begin(), contradictions.end());
    }
  }
  edits_ = question.edits;
  auto loaded = std::make_shared<PageSystem>();
  loaded->was_read = reading_.ok();
  loaded->lock = settings_.lock;
  loaded->system = describe::make_system(reading_, loaded->lock, {.edits = edits_});
  if (loaded->was_read) {
    loaded->types = std::make_shared<describe::ModelSource>(loaded->system.lowered, "the files");
  }
  loaded_ = loaded;
  return loaded;
}

web::Answer Page::start() const {
  Json files = Json::array();
  for (const describe::SourceText& file : settings_.files) {
    files.push_back({{"name", file.name}, {"text", file.text}});
  }
  return json_of({{"started", started_},
                  {"files", std::move(files)},
                  {"captures", settings_.captured.files},
                  {"edits", Json::object()}});
}

web::Answer Page::system(const PageSystem& loaded) {
  Json problems = Json::array();
  for (const documents::Problem& problem : loaded.system.problems) {
    const bool error = problem.severity == documents::Problem::Severity::error;
    problems.push_back({{"severity", error ? "error" : "warning"},
                        {"file", problem.file},
                        {"line", problem.mark.line},
                        {"column", problem.mark.column},
                        {"text", problem.text}});
  }
  Json all = Json::array();
  for (const Target& target : targets()) {
    all.push_back({{"name", target.name}, {"title", target.title}});
  }
  return json_of({{"good", loaded.system.good},
                  {"problems", std::move(problems)},
                  {"targets", std::move(all)},
                  {"lock", loaded.lock.services.empty() ? std::string{} : to_text(loaded.lock)},
                  {"renamed", loaded.system.renamed},
                  {"model", loaded.was_read ? describe::to_json(loaded.system.model, true) : Json{}}});
}

web::Answer Page::preview(const PageSystem& loaded, const PageQuestion& question) const {
  const Target* const wanted = target(question.target);
  if (wanted == nullptr) {
    return web::not_found();
  }
  Json files = Json::array();
  Json lost = Json::array();
  if (loaded.system.good) {
    // Types of ROS are in no file that a target writes, so that their files go along, with the messages.
    TargetOptions options = settings_.targets;
    for (const describe::SourceText& file : question.files) {
      const auto path = describe::kind_of(file.name, file.text) == describe::SourceKind::ros
                            ? describe::ros_file_path(file)
                            : std::nullopt;
      if (path) {
        options.routes.interfaces.push_back(*path);
        if (question.target == "msg") {
          files.push_back({{"name", *path}, {"text", file.text}});
        }
      }
    }
    const describe::Written written = wanted->write(loaded.system, options);
    for (const describe::TextFile& file : written.files) {
      files.push_back({{"name", file.path}, {"text", file.text}});
    }
    for (const describe::NotCarried& one : written.not_carried) {
      lost.push_back({{"element", one.element},
                      {"what", one.what},
                      {"place", describe::to_string(loaded.system.model, one.place)}});
    }
  }
  return json_of({{"files", std::move(files)}, {"not_carried", std::move(lost)}});
}

web::Answer Page::answer(const web::Request& request) {
  if (request.path == "/api/start") {
    return start();
  }
  if (request.method != "POST") {
    return web::not_found();
  }
  const auto question = read_question(request.body);
  if (!question) {
    return {.status = 400, .body = question.error() + "\n"};
  }
  const auto loaded = load(*question);
  if (request.path == "/api/system") {
    return system(*loaded);
  }
  if (request.path == "/api/preview") {
    return preview(*loaded, *question);
  }
  if (request.path != "/api/form" && request.path != "/api/layout") {
    return web::not_found();
  }
  const auto member = PageMember::of(*loaded, question->service, question->kind, question->member);
  if (!member) {
    return error_answer("there is no such member of a service");
  }
  const describe::Model& model = loaded->system.model;
  const PagePart part = member->part(model, question->part == "response");
  if (request.path == "/api/layout" && question->values.empty()) {
    describe::Layout layout = describe::layout(model, part.payload);
    add_header(part.e2e, part.use, layout);
    return json_of({{"ranges", ranges_json(layout, std::nullopt)}});
  }
  auto tree = part.tree(*loaded);
  if (!tree) {
    return error_answer(tree.error());
  }
  if (request.path == "/api/form") {
    return json_of(form_of(model, *tree, part.values(loaded->system, tree->root())));
  }
  auto bytes = part.bytes(std::move(*tree), question->values);
  if (!bytes) {
    return json_of({{"error", to_string(bytes.error())}, {"field", bytes.error().field}});
  }
  return json_of(bytes_json(model, part.payload, std::move(*bytes), part.e2e, part.use));
}

tl::expected<PageCall, web::Answer> Page::call(const web::Request& request) {
  const auto question = read_question(request.body);
  if (!question) {
    return tl::unexpected{web::Answer{.status = 400, .body = question.error() + "\n"}};
  }
  const auto fail = [](const std::string& text) { return tl::unexpected{error_answer(text)}; };
  const auto loaded = load(*question);
  if (!loaded->system.good) {
    return fail("the files have errors");
  }
  const auto member = PageMember::of(*loaded, question->service, question->kind, question->member);
  if (!member || (member->method() == nullptr && member->field() == nullptr)) {
    return fail("there is no such method or field");
  }
  const describe::Model& model = loaded->system.model;
  const describe::Service& service = member->service();
  PageCall call;
  const bool gets = question->access == "getter";
  std::optional<someip::MethodId> id;
  if (const describe::Method* const method = member->method()) {
    id = method->id;
    call.forget = method->fire_and_forget;
    call.call.timeout = method->timeout.value_or(std::chrono::seconds{5});
    if (method->request_transfer.transport == Transport::tcp) {
      call.call.transport = Transport::tcp;
    }
  } else {
    const describe::Field& field = *member->field();
    id = gets ? field.getter : field.setter;
    if ((gets ? field.getter_transfer : field.setter_transfer).transport == Transport::tcp) {
      call.call.transport = Transport::tcp;
    }
  }
  if (!service.id || !id) {
    return fail("it has no id");
  }
  call.call.method = *id;
  call.call.timeout = std::clamp<Duration>(call.call.timeout, std::chrono::milliseconds{100}, max_call_time);
  call.service.service = *service.id;
  call.service.major = service.major;
  const auto instance = std::ranges::find_if(
      model.instances, [&](const describe::Instance& one) { return describe::is_of(one, service); });
  if (instance != model.instances.end()) {
    call.service.instance = instance->id.value_or(someip::any_instance);
    call.service.major = instance->major.value_or(service.major);
  }
  if (!gets) {
    const PagePart part = member->part(model, false);
    auto tree = part.tree(*loaded);
    if (!tree) {
      return fail(tree.error());
    }
    auto bytes = part.bytes(std::move(*tree), question->values.empty() ? "{}" : question->values);
    if (!bytes) {
      return fail(to_string(bytes.error()));
    }
    call.payload = std::move(*bytes);
  }
  const describe::Protection& e2e = member->protection(gets).of(call.service.instance);
  std::size_t header_at = 0;
  std::size_t header_bytes = 0;
  if (!e2e.profile.empty()) {
    auto spec = cli::protection_of_call(e2e, *id, !call.forget);
    if (!spec) {
      call.note = fmt::format("without its E2E protection (profile {}): {}", e2e.profile, spec.error());
    } else if (const std::string why = cli::misfit_of_protection(*spec, member->name(), call.payload);
               !why.empty()) {
      return fail(why);
    } else {
      call.service.e2e.push_back(std::move(*spec));
    }
    if (const auto header = describe::protection_header(e2e)) {
      header_at = header->at;
      header_bytes = header->bytes;
    }
  }
  call.show = [loaded, header_at, header_bytes, note = call.note,
               part = member->part(model, true)](const sd::Response& response) {
    std::vector<std::byte> payload = response.payload;
    // A check takes the header out.
    if (!response.check && payload.size() >= header_at + header_bytes) {
      const auto begin = payload.begin() + static_cast<std::ptrdiff_t>(header_at);
      payload.erase(begin, begin + static_cast<std::ptrdiff_t>(header_bytes));
    }
    const auto text = part.yaml(*loaded, payload);
    Json json = bytes_json(loaded->system.model, part.payload, std::move(payload), {}, part.use);
    std::string said = response.check ? cli::failed_check(*response.check, "the answer") : note;
    json["ok"] = text.has_value() && (!response.check || said.empty());
    said += said.empty() ? "" : "\n";
    json["text"] = said + (text ? *text : documents::printable(text.error()));
    return json_of(json);
  };
  return call;
}

}  // namespace trestle::generate
