#include "bridge/carry/config/load_console.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <system_error>

#include "bridge/documents/host_and_port.hpp"
#include "bridge/documents/quote_path.hpp"
#include "bridge/documents/section.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::carry {
namespace {

std::optional<Endpoint> read_address(std::string_view text) {
  const auto parts = documents::host_and_port(text);
  if (!parts || text.find('\0') != std::string_view::npos) {
    return std::nullopt;
  }
  // Also the unspecified one: all addresses of this host.
  const auto address = someip::parse_address(std::string{parts->host});
  if (!address || address->is_multicast() || address->v6 != parts->v6) {
    return std::nullopt;
  }
  return Endpoint{*address, parts->port.value_or(ConsoleSettings::default_port)};
}

std::string next_to(const std::string& file, const std::string& path) {
  return (std::filesystem::path{file}.parent_path() / path).lexically_normal().string();
}

}  // namespace

documents::Format<Endpoint> console_address() {
  return {"an address of this host and a port, as in 127.0.0.1:9464 or [::1]:9464", read_address};
}

std::string fault_of(const ConsoleSettings& console) {
  return console.token_file.empty() && !console.at.address.is_loopback()
             ? fmt::format("{} is reached from other hosts: `token_file` is needed",
                           someip::to_string(console.at.address))
             : std::string{};
}

std::string fault_of(const ConsoleRecords& records, const std::string& file) {
  if (records.folder.empty()) {
    return {};
  }
  std::error_code error;
  if (!std::filesystem::is_directory(records.folder, error) && !error) {
    error = std::make_error_code(std::errc::not_a_directory);
  }
  if (!error && ::access(records.folder.c_str(), W_OK | X_OK) != 0) {
    error = {errno, std::generic_category()};
  }
  return error ? fmt::format("{}:{}:{}: records: {} is no folder that can be written to: {}", file,
                             records.mark.line, records.mark.column, documents::quote_path(records.folder),
                             error.message())
               : std::string{};
}

void load_console(const YAML::Node& node, const std::string& file, ConsoleSettings& into,
                  ConsoleRecords& records, documents::Problems& problems) {
  documents::Section console{node, "console", problems};
  console.read("address", console_address(), into.at);
  std::string token_file;
  if (console.read("token_file", documents::any_text("a file with the token that is to be asked for"),
                   token_file)) {
    into.token_file = next_to(file, token_file);
  }
  std::string folder;
  if (console.read("records", documents::any_text("a folder for the records that the console may make"),
                   folder)) {
    records = {next_to(file, folder), console.value_mark("records")};
  }
  into.mark = console.value_mark("address");
  console.finish();
  if (const std::string fault = fault_of(into); !fault.empty()) {
    problems.error(into.mark, "address: " + fault);
  }
}

}  // namespace trestle::carry
