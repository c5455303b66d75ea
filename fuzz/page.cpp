// Property: whatever the page of `trestle generate --ui` asks, or somebody else in its place, the answer is
// JSON, or says that it is no question; and a call that could be made shows whatever comes back. The first
// byte chooses what is asked; behind it is the body of the request.
#include <array>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bridge/generate/page.hpp"

using namespace trestle;

namespace {

constexpr std::array paths{"/api/system", "/api/preview", "/api/form", "/api/layout", "/api/call"};

void expect_json(const web::Answer& answer) {
  const bool is_answer = answer.status == 200 && nlohmann::json::accept(answer.body);
  if (!is_answer && answer.status != 400 && answer.status != 404) {
    std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) {
    return 0;
  }
  static generate::Page page{{}};
  const web::Request request{
      .method = "POST", .path = paths.at(data[0] % paths.size()), .body = std::string(data + 1, data + size)};
  if (request.path != "/api/call") {
    expect_json(page.answer(request));
    return 0;
  }
  const auto call = page.call(request);
  if (!call) {
    expect_json(call.error());
    return 0;
  }
  const std::span sent{call->payload};
  for (const std::size_t bytes : {std::size_t{0}, sent.size() / 2, sent.size()}) {
    expect_json(call->show({.payload = {sent.begin(), sent.begin() + static_cast<std::ptrdiff_t>(bytes)}}));
  }
  return 0;
}
